"""Which measured modes count in an update, and how well they are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.bench.doubting.doubted import doubted_times
from femend.bench.doubting.doubted_frequencies import doubted_frequencies, in_another_unit
from femend.bench.reading.measured import MeasuredModes
from femend.bench.updating.without_mistaken import Sound, same_test
from femend.correlate import compare_modes
from femend.data import FRF, ModeSet
from femend.dof import Dof
from femend.errors import StudyError, UpdatingError
from femend.estimate.frf import ORDER, frf_lines_of
from femend.estimate.picked_up import ACROSS_SD
from femend.estimate.updating import scatter_of
from femend.numerals import listed, plain
from femend.study.file.study import Study

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["Counted", "counted_modes"]

FloatArray = NDArray[np.float64]

# least damping ratio that a share of it is taken of, for its deviation
LEAST_ZETA = 1e-4
# modes of which it is told why they do not count, where none does
TOLD = 3


@dataclass(frozen=True, eq=False)
class Counted:
    """The modes that count in one configuration of the problem: `freq`, `zeta` (n_modes,), `phi` (n_dof, n_modes) with
    largest component 1, and their deviations, floors included. `numbers` are those of the recording, from 1; `sources`
    the recordings; `frf` FRFs on the lines that count with the deviations `frf_sd` of their logarithms, None where none
    do, with `frf_noise` and `frf_floor` below which their magnitudes say nothing; `left_out` says which modes do not
    count, and why."""

    name: str
    configuration: str
    dofs: tuple[Dof, ...]
    numbers: tuple[int, ...]
    freq: FloatArray
    freq_sd: FloatArray
    zeta: FloatArray
    zeta_sd: FloatArray
    phi: FloatArray
    phi_sd: FloatArray
    sources: tuple[str, ...]
    frf: FRF | None = None
    frf_sd: FloatArray | None = None
    frf_noise: FloatArray | float = 0.0
    frf_floor: FloatArray | float = 0.0
    left_out: tuple[str, ...] = ()

    def select(self, at: Sequence[int] | NDArray[np.int64]) -> Counted:
        """The modes at positions `at`."""
        keep = np.asarray(at, dtype=np.int64)
        return replace(
            self,
            numbers=tuple(self.numbers[int(i)] for i in keep),
            freq=self.freq[keep],
            freq_sd=self.freq_sd[keep],
            zeta=self.zeta[keep],
            zeta_sd=self.zeta_sd[keep],
            phi=self.phi[:, keep],
            phi_sd=self.phi_sd[:, keep],
        )


def counted_modes(sound: Sound) -> tuple[Counted, ...]:
    """What the recordings with role fit measured, one entry each, or one for several that repeat one test.

    Where the study names no modes, those count that have a mate in the model as it stands with a frequency
    not too far off: a second pole of one resonance, or a mode the model lacks, would be paired with whatever looks like
    it and pull the parameters there. Raises StudyError for a mode number that a recording does not have, and
    UpdatingError for frequencies in another unit, where repetitions are asked for and there are none, or where no mode
    counts; without modes an update may be on a rotor's `orders`.
    """
    prepared, before = sound.prepared, sound.compared
    study = prepared.study
    fit = [m for m in prepared.measured if m.role == "fit"]
    # what a rotor's runs say counts without modes too
    if set(study.updating.responses) == {"orders"} or ("orders" in study.updating.responses and not fit):
        return ()
    wrong = in_another_unit([c for c in sound.recorded if c.measured.role == "fit"])
    if wrong:
        raise UpdatingError(f"no update is made of frequencies in another unit: {'; '.join(wrong)}")
    every = [_merged(g, study) for g in (_groups(fit) if study.updating.repeated else [[m] for m in fit])]
    solved: dict[str, ModeSet] = {}
    for c in before:
        best = solved.get(c.measured.configuration)
        if best is None or c.modes.n_modes > best.n_modes:
            solved[c.measured.configuration] = c.modes
    found = [_selected(one, prepared, solved) for one in every]
    if set(study.updating.responses) == {"frfs"}:
        return tuple(found)
    if not any(c.freq.size for c in found):
        raise UpdatingError(_none_counts(sound, [text for c in found for text in c.left_out]))
    kept = [c for c in found if c.freq.size]
    # what a recording lost all of its modes by is told with the others
    lost = tuple(text for c in found if not c.freq.size for text in c.left_out)
    return (replace(kept[0], left_out=(*kept[0].left_out, *lost)), *kept[1:])


def _none_counts(sound: Sound, left_out: Sequence[str]) -> str:
    """That no mode counts: what of the test looks mistaken, if anything does, and why modes were left out."""
    doubts = [*doubted_times(sound.prepared, sound.recorded), *doubted_frequencies(sound.recorded), *sound.doubts]
    said = "; ".join(text for text in [*doubts, listed(left_out, TOLD, "; ")] if text)
    mend = (
        "" if doubts else "; check sensors, directions and supports (`femend correlate`), or name modes in [updating]"
    )
    return f"no measured mode counts: {said}{mend}"


def _groups(fit: Sequence[MeasuredModes]) -> list[list[MeasuredModes]]:
    """Recordings of one configuration and the same sensors together."""
    groups: dict[tuple[str, frozenset[Dof]], list[MeasuredModes]] = {}
    for m in fit:
        groups.setdefault(same_test(m), []).append(m)
    if all(len(g) == 1 for g in groups.values()):
        raise UpdatingError(
            f"[updating] repeated = true, but none of the {len(fit)} recordings to fit repeats another one's sensors "
            "in its configuration; leave it out, or give the repetitions the same sensors"
        )
    return list(groups.values())


def _merged(group: Sequence[MeasuredModes], study: Study) -> Counted:
    """All modes of a recording, or the mean of several with the deviation of the mean."""
    return _weighed(group[0], study) if len(group) == 1 else _repeated(group, study)


def _weighed(m: MeasuredModes, study: Study) -> Counted:
    s = study.updating
    test = m.modes.to_mode_set()
    phi = test.phi / np.abs(test.phi).max(axis=0)
    shape_sd = np.full(phi.shape, s.shape_sd)
    if m.shape_sd is not None:
        shape_sd = np.hypot(shape_sd, np.nan_to_num(m.shape_sd / np.abs(m.modes.shapes).max(axis=0)))
    freq_sd = np.hypot(_known(m.modes.freq_sd, test.freq), s.freq_sd * test.freq)
    zeta_sd = np.hypot(_known(m.modes.zeta_sd, test.freq), s.damping_sd * np.maximum(test.zeta, LEAST_ZETA))
    numbers = tuple(range(1, test.n_modes + 1))
    return Counted(
        m.name, m.configuration, m.modes.dofs, numbers, test.freq, freq_sd, test.zeta, zeta_sd, phi, shape_sd,
        (m.name,), *_frf(m, study),
    )  # fmt: skip


def _repeated(group: Sequence[MeasuredModes], study: Study) -> Counted:
    s = study.updating
    found = scatter_of([m.modes.to_mode_set() for m in group], mac_min=study.correlation.mac_min).of_mean()
    freq_sd = np.hypot(np.nan_to_num(found.freq_sd), s.freq_sd * found.freq)
    zeta_sd = np.hypot(np.nan_to_num(found.zeta_sd), s.damping_sd * np.maximum(found.zeta, LEAST_ZETA))
    numbers = tuple(range(1, found.freq.size + 1))
    return Counted(
        " + ".join(m.name for m in group), group[0].configuration, found.dofs, numbers, found.freq, freq_sd,
        found.zeta, zeta_sd, found.phi, np.hypot(np.nan_to_num(found.phi_sd), s.shape_sd),
        tuple(m.name for m in group), *_frf(group[0], study),
    )  # fmt: skip


def _selected(c: Counted, prepared: Prepared, solved: Mapping[str, ModeSet]) -> Counted:
    """The modes that the study names, or those with a mate near enough."""
    study = prepared.study
    wanted = study.updating.modes
    if wanted is not None:
        lacking = [n for n in wanted if n > c.freq.size]
        if lacking:
            raise StudyError(
                f"{study.file}: updating.modes: mode {lacking[0]} is wanted and recording {c.name!r} shows "
                f"{c.freq.size} (up to {plain(c.freq[-1])} Hz); `femend correlate` numbers them",
                key="updating.modes",
            )
        return c.select([n - 1 for n in wanted])
    test = ModeSet(c.freq, c.zeta, c.phi, c.dofs, "max")
    model = solved[c.configuration]
    found = compare_modes(test, model, places=prepared.placed.places, mac_min=study.correlation.mac_min)
    mates = {p.a: p.b for p in found.pairing.pairs}
    keep, told = [], []
    for i, f in enumerate(c.freq):
        who = f"recording {c.name!r}: mode {i + 1} at {plain(f)} Hz does not count"
        if i not in mates:
            told.append(f"{who}: {_lone(found.mac[i], mates, study.correlation.mac_min)}")
        elif abs(model.freq[mates[i]] / f - 1) > study.updating.freq_far:
            off = 100 * (model.freq[mates[i]] / f - 1)
            told.append(
                f"{who}: its mate is at {plain(model.freq[mates[i]])} Hz, {_share(off)} % off ([updating] freq_far is "
                f"{100 * study.updating.freq_far:g} %)"
            )
        else:
            keep.append(i)
    return replace(c.select(keep), left_out=tuple(told))


def _share(off: float) -> str:
    """Per cent with its sign, as many digits as tell it from nothing."""
    return f"{off:+.0f}" if abs(off) >= 1 else plain(off, 1, signed=True)


def _lone(mac: FloatArray, mates: Mapping[int, int], mac_min: float) -> str:
    """Why a mode with MACs `mac` (n_model,) has no mate in the model."""
    like = int(np.argmax(np.nan_to_num(mac)))
    best = float(np.nan_to_num(mac)[like])
    taken = next((a for a, b in mates.items() if b == like), None)
    if best >= mac_min and taken is not None:
        return (
            f"it looks like the model's mode {like + 1} (MAC {best:.2f}), whose mate is mode {taken + 1}; a second "
            "pole of one resonance?"
        )
    return f"it has no mate of MAC {mac_min:g} in the model (best {best:.2f})"


def _frf(
    m: MeasuredModes, study: Study
) -> tuple[FRF | None, FloatArray | None, FloatArray | float, FloatArray | float]:
    """The lines of the measured FRFs that count, even over the band, and (n_freq, n_out, n_in) each: the deviations of
    the logarithms of their magnitudes (what the study says, and in squares the noise of the lines over the magnitude),
    the noise, and what sensors pick up of the motion across them, below which an FRF is that of its neighbours."""
    if "frfs" not in study.updating.responses or m.frf is None:
        return None, None, 0.0, 0.0
    f = m.frf
    above = np.flatnonzero(f.freq > 0)
    rows = above[np.unique(np.linspace(0, above.size - 1, study.updating.frf_lines).round().astype(np.int64))]
    lines = np.stack([frf_lines_of(f, j).noise for j in range(len(f.inputs))], axis=2)[rows - above[0]]
    noise = lines / ((2 * np.pi * f.freq[rows]) ** ORDER[f.kind])[:, None, None]
    size = np.abs(f.H[rows])
    moved = np.array([d is not None and d.component <= 3 for d in f.output_dofs])
    floor = ACROSS_SD * moved[:, None] * np.where(moved[:, None], size, 0.0).max(axis=1, keepdims=True)
    sd = np.hypot(study.updating.frf_sd, noise / np.maximum(np.hypot(np.maximum(size, noise), floor), 1e-300))
    return FRF(f.name, f.freq[rows], f.H[rows], f.outputs, f.inputs, f.kind, f.unit), sd, noise, floor


def _known(sd: FloatArray | None, freq: FloatArray) -> FloatArray:
    """Deviations with 0 where they are not known."""
    return np.zeros(freq.size) if sd is None else np.nan_to_num(sd)
