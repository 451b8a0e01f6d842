"""A modal test that was recorded point by point: a hammer that roves, or a sensor, a recording for each point.

A recording with one or two responses to one force shows shapes at a DOF or two, where MAC says nothing. Several of them
in one configuration that share the responses, or the force, are the columns, or the rows, of one test's FRFs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femend.data import FRF, Channel, Recording, TimeData
from femend.dof import Dof
from femend.errors import FemendError
from femend.numerals import listed
from femend.signal.suited import blow_block, blows, suited_frf

__all__ = ["Part", "is_part", "joined_part", "parts_of_one_test"]

# responses up to which a recording by itself tells no shape, and points that make a test of several recordings
FEW, POINTS = 2, 3
# names and points told
TOLD = 6


@dataclass(frozen=True, eq=False)
class Part:
    """A recording `full` of few responses to one force, with its DOFs without their signs, and which of several
    nominally equal structures it is of, "" where there is one."""

    full: Recording
    outputs: frozenset[Dof]
    force: Dof
    structure: str = ""

    def shares(self, moved: str) -> tuple[object, ...]:
        """What parts of one test have in common, where the hammer or the sensors `moved`."""
        same = self.outputs if moved == "hammer" else self.force
        return (self.full.role, self.full.configuration, self.structure, same)

    def point(self, moved: str) -> object:
        """The point that is this recording's alone."""
        return self.force if moved == "hammer" else self.outputs


def is_part(full: Recording, structure: str = "") -> Part | None:
    """`full`, of the `structure`, as a part of a test, or None where it has more responses than two, none, or not one
    force, or where a channel has no DOF."""
    if isinstance(full.data, FRF):
        outputs, inputs = full.data.outputs, full.data.inputs
    elif isinstance(full.data, TimeData):
        outputs = tuple(c for c in full.data.channels if c.dof is not None and c.quantity != "force")
        inputs = tuple(full.data.channels[i] for i in full.data.rows("force"))
    else:
        return None
    at = _dofs(outputs)
    if len(inputs) != 1 or inputs[0].dof is None or not 1 <= len(outputs) <= FEW or len(at) != len(outputs):
        return None
    return Part(full, at, inputs[0].dof.unsigned, structure)


def _dofs(channels: Iterable[Channel]) -> frozenset[Dof]:
    return frozenset(c.dof.unsigned for c in channels if c.dof is not None)


def parts_of_one_test(parts: Sequence[Part]) -> list[tuple[str, list[int]]]:
    """Which `parts` are one test, by position, and what moved in it, "hammer" or "sensor"; each part in one at most,
    those with the most points first. Points have to be three."""
    found: list[tuple[str, list[int]]] = []
    for moved in ("hammer", "sensor"):
        groups: dict[tuple[object, ...], list[int]] = {}
        for i, part in enumerate(parts):
            groups.setdefault(part.shares(moved), []).append(i)
        found += [(moved, g) for g in groups.values() if len({parts[i].point(moved) for i in g}) >= POINTS]
    kept: list[tuple[str, list[int]]] = []
    taken: set[int] = set()
    for moved, group in sorted(found, key=lambda one: -len(one[1])):
        if not taken & set(group):
            kept.append((moved, group))
            taken |= set(group)
    return kept


def joined_part(parts: Sequence[Part], moved: str) -> Recording | str:
    """The recording of all FRFs of `parts`, called as the first of them, or why they cannot be joined.

    FRFs of points that were recorded several times are averaged; lines have to be the same. Raises what the estimators
    raise.
    """
    first = parts[0].full
    names = [p.full.name for p in parts]
    who = f"recordings {listed([repr(n) for n in names], TOLD)}"
    try:
        frfs, told = _frfs(parts)
    except FemendError as error:
        return f"{who} are not taken as one test: {error}"
    lines = frfs[0].freq
    for name, f in zip(names, frfs, strict=True):
        if f.freq.shape != lines.shape or not np.allclose(f.freq, lines, rtol=1e-6, atol=0.0) or f.kind != frfs[0].kind:
            return (
                f"{who} look like one test in which the {moved} went from point to point, and are not taken as one: "
                f"{name!r} has other lines or another quantity than {names[0]!r}; give them the same length and rate"
            )
    whole = _stacked(frfs, moved)
    points, place = (whole.inputs, whole.outputs) if moved == "hammer" else (whole.outputs, whole.inputs)
    what = "struck" if moved == "hammer" else "measured"
    said = (
        f"with {len(names) - 1} more ({listed([repr(n) for n in names[1:]], TOLD)}) it is taken as one test, in which "
        f"the {moved} went from point to point: {len(points)} points {what}, "
        f"{'responses' if moved == 'hammer' else 'the force'} at {listed([str(c.dof) for c in place], TOLD)}"
    )
    warnings = tuple(dict.fromkeys(w for p in parts for w in p.full.warnings))
    notes = tuple(f"recording {first.name!r}: {t}" for t in (said, *dict.fromkeys(told)))
    return replace(first, data=whole, warnings=(*warnings, *notes))


def _frfs(parts: Sequence[Part]) -> tuple[list[FRF], list[str]]:
    """The FRFs of every part, those of blows from pieces of one length, and what to mind about them."""
    times = {i: p.full.data for i, p in enumerate(parts) if isinstance(p.full.data, TimeData)}
    blocks = [blow_block(data, at) for data in times.values() if (at := blows(data)).size]
    block = min(blocks, default=None)
    out: list[FRF] = []
    told: list[str] = []
    for i, p in enumerate(parts):
        if isinstance(p.full.data, FRF):
            out.append(p.full.data)
            continue
        frf, notes = suited_frf(times[i], block)
        out.append(frf)
        told += notes
    return out, told


def _stacked(frfs: Sequence[FRF], moved: str) -> FRF:
    """One grid of all, the sense of a sensor or a force turned to that of its first recording, and means of points that
    stand in several."""
    outputs, inputs = _once(c for f in frfs for c in f.outputs), _once(c for f in frfs for c in f.inputs)
    H = np.zeros((frfs[0].n_freq, len(outputs), len(inputs)), dtype=np.complex128)
    coherence, count = np.zeros(H.shape), np.zeros(H.shape[1:])
    for f in frfs:
        at = np.ix_(range(f.n_freq), *(_rows(side, c) for side, c in ((outputs, f.outputs), (inputs, f.inputs))))
        signs = np.outer(_signs(outputs, f.outputs), _signs(inputs, f.inputs))
        H[at] += f.H * signs
        coherence[at] += 0.0 if f.coherence is None else f.coherence
        count[at[1][0], at[2][0]] += 1
    told = all(f.coherence is not None for f in frfs)
    return FRF(
        frfs[0].name, frfs[0].freq, H / count, tuple(outputs.values()), tuple(inputs.values()), frfs[0].kind,
        frfs[0].unit, coherence / count if told else None,
    )  # fmt: skip


def _once(channels: Iterable[Channel]) -> dict[Dof, Channel]:
    """The first channel at each DOF."""
    found: dict[Dof, Channel] = {}
    for c in channels:
        if c.dof is not None:
            found.setdefault(c.dof.unsigned, c)
    return found


def _rows(side: dict[Dof, Channel], channels: Sequence[Channel]) -> list[int]:
    """Positions of `channels` on their side of the grid."""
    rows = list(side)
    return [rows.index(c.dof.unsigned) for c in channels if c.dof is not None]


def _signs(side: dict[Dof, Channel], channels: Sequence[Channel]) -> list[int]:
    """-1 where a channel has the sense opposite to that of its place on the grid."""
    first = {at: c.dof.sign for at, c in side.items() if c.dof is not None}
    return [c.dof.sign * first[c.dof.unsigned] for c in channels if c.dof is not None]
