"""Files to recordings: the kind of a file is told by its extension, its content by its own labels or by a map."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from femend.data import FRF, Geometry, IdentifiedModes, Recording, Rotating, Spectra, Test, TimeData
from femend.errors import FormatError, RecordingError
from femend.io.channel_map import ChannelMap
from femend.io.uff.frfs import frf_blocks
from femend.io.uff.reader import UniversalFile, read_uff
from femend.io.uff.scan import scan
from femend.io.uff.set55 import identified_modes
from femend.io.uff.spectra import spectra_blocks
from femend.io.uff.times import time_data
from femend.numerals import listed
from femend.units import unit_system

__all__ = ["read_modes", "read_recording", "read_recordings"]

Data = TimeData | FRF | Spectra
# outputs and inputs of a group of FRFs that are named
NAMED = 4
_UNIVERSAL = (".uff", ".unv", ".uf", ".unv58")


def read_recording(
    path: str | os.PathLike[str],
    channels: Sequence[ChannelMap] | None = None,
    *,
    name: str | None = None,
    role: str = "fit",
    excitation: str | None = None,
    configuration: str = "as modelled",
    rotating: Rotating | None = None,
    units: str = "SI",
) -> Recording:
    """Reads one recording from `path` and converts it to the unit system `units`.

    `name` defaults to the file's stem; `role`, `configuration` and `rotating` are those of the study file.
    `.uff .unv` carry node, direction, quantity and unit themselves (for time
    records `channels` may overrule some); `.csv .txt .dat .mat .h5 .hdf5 .wav .tdms` need
    `channels`. `excitation` None means measured where a force is recorded and unknown otherwise. Raises FormatError
    (damaged file), RecordingError (NaN, zero channel, unequal lengths, no force although measured), UnitError,
    FileNotFoundError.

    >>> read_recording("high.uff").time.rate       # doctest: +SKIP
    1024.0
    """
    found = _read(Path(path), channels, name, role, excitation, configuration, rotating, units)
    if len(found) > 1:
        raise RecordingError(
            f"recording {found[0].name!r}: {path} holds {len(found)} groups of FRFs that form no full grid of outputs "
            f"and inputs: {_groups_told([r.frf for r in found if r.frf is not None])}; export what is missing or leave "
            "the rest out, or give each group a file and a recording of its own (read_recordings takes them so)",
            recording=found[0].name,
        )
    return found[0]


def _groups_told(groups: Sequence[FRF]) -> str:
    """Groups of FRFs by what sets them apart: kinds, lines, and outputs that one has and another lacks."""
    every = list(dict.fromkeys(d for g in groups for d in g.output_dofs))
    alike = len({g.kind for g in groups}) == 1
    told = []
    for g in groups:
        lacks = [str(d) for d in every if d not in g.output_dofs]
        without = f", without {listed(lacks, NAMED)}" if alike and len(lacks) <= len(g.outputs) and lacks else ""
        of = f"{len(g.outputs)} output{'s' * (len(g.outputs) > 1)} by {listed(map(str, g.input_dofs), NAMED)}"
        told.append(f"{g.kind} of {of} on {g.n_freq} lines{without}")
    return "; ".join(told)


def read_recordings(
    paths: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    channels: Sequence[ChannelMap] | None = None,
    *,
    role: str = "fit",
    excitation: str | None = None,
    configuration: str = "as modelled",
    units: str = "SI",
) -> Test:
    """Reads the recordings of one or several `paths` as one Test, named by the files' stems.

    `channels`, `role`, `excitation`, `configuration` and `units` hold for all; they and the errors are those of
    `read_recording`.
    A file whose FRFs form no full grid becomes several recordings, named ``stem [1]``, ``stem [2]``, ...
    """
    listed = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    found: list[Recording] = []
    for path in listed:
        found += _split_names(_read(Path(path), channels, None, role, excitation, configuration, None, units))
    return Test(tuple(found))


def read_modes(
    path: str | os.PathLike[str], *, units: str = "SI"
) -> tuple[IdentifiedModes, Geometry | None, tuple[str, ...]] | None:
    """The mode shapes of a universal file at `path` (data sets 55), its test nodes in `units`, and notes; None where it
    holds none.

    Deviations are not known, shapes unscaled. Raises FormatError for a damaged file and for shapes without a DOF in
    common, FileNotFoundError for one that is not there.

    >>> read_modes("modes.uff")[0].freq       # doctest: +SKIP
    array([ 5.2,  7.3])
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(_no_file(path))
    if path.suffix.lower() not in _UNIVERSAL:
        return None
    if not any(raw.number == 55 for raw in scan(path.read_bytes(), str(path))):
        return None
    file = read_uff(path)
    if not file.modes:
        return None
    modes, notes = identified_modes(file.modes, file.file)
    return modes, _geometry(file, units), (*file.notes, *notes)


def _no_file(path: Path) -> str:
    return f"{path} is a folder; name a file in it" if path.is_dir() else f"there is no file {path}"


def _split_names(found: list[Recording]) -> list[Recording]:
    if len(found) == 1:
        return found
    return [replace(r, name=f"{r.name} [{i}]") for i, r in enumerate(found, start=1)]


def _read(
    path: Path,
    channels: Sequence[ChannelMap] | None,
    name: str | None,
    role: str,
    excitation: str | None,
    configuration: str,
    rotating: Rotating | None,
    units: str,
) -> list[Recording]:
    unit_system(units)
    name = path.stem if name is None else name
    if not path.is_file():
        raise FileNotFoundError(f"recording {name!r}: {_no_file(path)}")
    geometry = None
    if path.suffix.lower() in _UNIVERSAL:
        file = read_uff(path)
        blocks, notes = _from_uff(file, channels or (), name, units)
        geometry = _geometry(file, units)
    else:
        blocks, notes = _from_table(path, channels, name, units)
    return [
        Recording(
            name,
            data,
            role,
            excitation or _excitation(data, rotating),
            configuration,
            rotating,
            str(path),
            tuple(notes),
            geometry,
        )
        for data in blocks
    ]


def _geometry(file: UniversalFile, units: str) -> Geometry | None:
    ids, xyz = file.node_table()
    if not ids.size:
        return None
    return Geometry(ids, xyz / unit_system(units).length, file.displacement_systems(), file.node_unit())


def _excitation(data: Data, rotating: Rotating | None) -> str:
    if rotating is not None:
        return "rotating"
    measured = isinstance(data, FRF) or (isinstance(data, TimeData) and bool(data.rows("force")))
    return "measured" if measured else "unknown"


def _from_uff(
    file: UniversalFile, channels: Sequence[ChannelMap], name: str, units: str
) -> tuple[list[Data], list[str]]:
    notes = list(file.notes)
    if file.unknown:
        notes.append("data sets passed over: " + ", ".join(str(n) for n in sorted({n for n, _ in file.unknown})))
    frfs = [f for f in file.functions if f.header.func_type in (4, 6)]
    times = [f for f in file.functions if f.header.func_type in (0, 1)]
    if channels and (frfs or not times):
        raise RecordingError(
            f"recording {name!r}: [[recording.channel]] applies to time records and tables; the functions of "
            f"{file.file} carry node and direction themselves: leave the channels out",
            recording=name,
        )
    if any(f.header.func_type == 4 for f in frfs):
        blocks, said = frf_blocks(file, frfs, name, units)
        if times:
            notes.append(f"{len(times)} time records beside the FRFs are passed over")
        return [*blocks], notes + said
    if times:
        data, said = time_data(file, times, name, units, channels)
        return [data], notes + said
    spectra, said = spectra_blocks(file, file.functions, name)
    if spectra:
        return [*spectra], notes + said
    if file.modes:
        raise FormatError(
            f"recording {name!r}: {file.file} holds {len(file.modes)} mode shapes (data set 55) and no time records, "
            "FRFs or spectra (58); `femend correlate` and `femend update` compare modes, here the functions are needed",
            file=file.file,
        )
    others = sum(number == 55 for number, _ in file.unknown)
    beside = (
        f", and {others} data set{'s' * (others > 1)} 55 without modes (operating or static shapes)" if others else ""
    )
    raise FormatError(
        f"recording {name!r}: {file.file} holds no time records, FRFs or spectra (data set 58){beside}; "
        "check that the functions were exported",
        file=file.file,
    )


def _from_table(
    path: Path, channels: Sequence[ChannelMap] | None, name: str, units: str
) -> tuple[list[Data], list[str]]:
    from femend.io.tables import read_table, table_data

    data, notes = table_data(read_table(path), channels or (), name, units)
    return [data], notes
