"""Sensors that look mistaken, which an update leaves out of what is fitted: its parameters would make up for them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femend.bench.doubting.doubted import MEND_FIRST, doubted_sensors
from femend.bench.reading.compared import Compared
from femend.bench.reading.measured import MeasuredModes
from femend.data import FRF, IdentifiedModes
from femend.dof import Dof
from femend.errors import UpdatingError

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["LeftOut", "Sound", "same_test", "without_mistaken"]

# sensors that have to be left: any two shapes at fewer look alike, or nearly so
FEWEST = 3


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Sensors `dofs` of a `recording` that have no part in the update, and what is `told` of them."""

    recording: str
    dofs: tuple[Dof, ...]
    told: tuple[str, ...]

    @property
    def names(self) -> str:
        """The sensors, as a sentence lists them."""
        return ", ".join(str(d) for d in self.dofs)


@dataclass(frozen=True, eq=False)
class Sound:
    """What is `prepared` without the sensors `left_out` of recordings to fit, and all recordings `compared` so, and as
    they were `recorded`."""

    prepared: Prepared
    compared: tuple[Compared, ...]
    recorded: tuple[Compared, ...]
    left_out: tuple[LeftOut, ...] = ()

    @property
    def doubts(self) -> list[str]:
        """What is told of sensors that look mistaken: those that were left out, then those of other recordings."""
        return [*(text for o in self.left_out for text in o.told), *doubted_sensors(self._others)]

    @property
    def mend(self) -> list[str]:
        """What is to be done about them."""
        if not self.left_out:
            return [MEND_FIRST] if doubted_sensors(self._others) else []
        which = "; ".join(f"{o.names} of {o.recording!r}" for o in self.left_out)
        return [f"mend the sensors that look mistaken, and update again: this update is without {which}"]

    @property
    def _others(self) -> list[Compared]:
        mended = {o.recording for o in self.left_out}
        return [c for c in self.recorded if c.measured.name not in mended]


def without_mistaken(prepared: Prepared, recorded: Sequence[Compared]) -> Sound:
    """Leaves out of recordings to fit, shapes and FRFs, the sensors that look reversed, exchanged or a factor off where
    these are compared with the model, as `recorded`, until none does; recordings that are repetitions of one test are
    left the same sensors.

    Raises UpdatingError where fewer than three sensors would be left, or a mode that moves none of these.
    """
    measured = {c.measured.name: c.measured for c in recorded}
    compared = {c.measured.name: c for c in recorded}
    told: dict[str, list[str]] = {}
    while found := _told(prepared, compared.values()):
        for name, (wrong, texts) in found.items():
            told.setdefault(name, []).extend(texts)
            measured[name] = _without(measured[name], wrong, told[name])
            compared[name] = prepared.compare(measured[name])
    if not told:
        return Sound(prepared, tuple(recorded), tuple(recorded))
    left_out = []
    for c in recorded:
        lost = set(c.measured.modes.dofs) - set(measured[c.measured.name].modes.dofs)
        if lost:
            dofs = tuple(d for d in c.measured.modes.dofs if d in lost)
            left_out.append(LeftOut(c.measured.name, dofs, tuple(told[c.measured.name])))
    sound = replace(prepared, measured=tuple(measured[m.name] for m in prepared.measured))
    return Sound(sound, tuple(compared[c.measured.name] for c in recorded), tuple(recorded), tuple(left_out))


def same_test(m: MeasuredModes) -> tuple[str, frozenset[Dof]]:
    """What recordings have in common that repeat one test: configuration and sensors."""
    return m.configuration, frozenset(d.unsigned for d in m.modes.dofs)


def _told(prepared: Prepared, compared: Collection[Compared]) -> dict[str, tuple[set[Dof], list[str]]]:
    """Mistaken sensors by the name of the recording to fit that they are to be left out of, and what is told."""
    found: dict[str, tuple[set[Dof], list[str]]] = {}
    fit = [c.measured for c in compared if c.measured.role == "fit"]
    for c in compared:
        if c.measured.role != "fit" or not c.mistaken:
            continue
        wrong = {c.dofs[row].unsigned for row in c.mistaken}
        texts = [f"recording {c.measured.name!r}: {text}" for text in _texts(c)]
        repeated = [m.name for m in fit if m is not c.measured and same_test(m) == same_test(c.measured)]
        for name in (c.measured.name, *(repeated if prepared.study.updating.repeated else ())):
            before = found.setdefault(name, (set(), []))
            before[0].update(wrong)
            before[1].extend(texts)
    return found


def _texts(c: Compared) -> list[str]:
    """What is told of the mistaken sensors of a recording, with what is to be done."""
    own = []
    for f in c.faults:
        pair = f.kind == "exchanged"
        who = "both are" if pair else "it is"
        mend = "give each the name of the other" if pair else "turn its direction round"
        own.append(f"{f.text}; {who} left out of what is fitted: {mend} in the recording, and update again")
    return [*own, *(f"{s.text}; it is left out of what is fitted" for s in c.scaled)]


def _without(m: MeasuredModes, wrong: Collection[Dof], told: Sequence[str]) -> MeasuredModes:
    """The recording without its sensors `wrong` (unsigned)."""
    rows = [i for i, d in enumerate(m.modes.dofs) if d.unsigned not in wrong]
    shapes = m.modes.shapes[rows]
    said = "; ".join(told)
    if len(rows) < FEWEST:
        raise UpdatingError(
            f"{said}. Without the sensors that look mistaken {len(rows)} would be left in recording {m.name!r}, by "
            f"which modes are not told apart ({FEWEST} are needed): mend these first, or measure at more places"
        )
    still = np.flatnonzero(~shapes.any(axis=0))
    if still.size:
        raise UpdatingError(
            f"{said}. Mode {still[0] + 1} of recording {m.name!r} moves no other sensor: mend these first, or leave "
            "the mode out of the file"
        )
    own = m.modes
    modes = IdentifiedModes(
        tuple(own.dofs[i] for i in rows), own.poles, shapes, own.participation, own.reference_dofs, own.freq_sd,
        own.zeta_sd, own.scaling,
    )  # fmt: skip
    shape_sd = None if m.shape_sd is None else m.shape_sd[rows]
    return replace(m, modes=modes, shape_sd=shape_sd, frf=None if m.frf is None else _frf(m.frf, wrong))


def _frf(frf: FRF, wrong: Collection[Dof]) -> FRF | None:
    """The FRFs without what was measured by sensors `wrong`; with a roving hammer those of blows there, since shapes
    live on these; None where none is left."""
    sides = {"outputs": frf.outputs, "inputs": frf.inputs}
    roved = "outputs" if len(frf.inputs) <= len(frf.outputs) else "inputs"
    keep = [i for i, c in enumerate(sides[roved]) if c.dof is None or c.dof.unsigned not in wrong]
    return frf.select(**{roved: keep}) if keep else None
