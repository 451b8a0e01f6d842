"""Data set 55, data at nodes: one mode shape each, with its frequency and damping."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import IdentifiedModes
from femend.data._arrays import frozen
from femend.dof import Dof
from femend.errors import FormatError
from femend.io.uff.header58 import Fail
from femend.io.uff.scan import RawSet, decode
from femend.numerals import listed

__all__ = ["Mode55", "identified_modes", "lines_of_55", "modes_55", "read_55"]

NORMAL, COMPLEX, COMPLEX_VELOCITY = 2, 3, 7  # analysis types whose data are mode shapes
# values per node of a translation vector, and of translations with rotations
WIDTHS = (3, 6)
# a format of six digits tells values apart by this share
PRINTED = 1e-5
# damping that no structure has: the pole of such a mode is none
LARGEST_ZETA = 1.0
# DOFs that are named in a note
NAMED = 6


@dataclass(frozen=True, slots=True, eq=False)
class Mode55:
    """One shape: `nodes` (n,), `values` (n, 3 or 6) real or complex in the directions X Y Z (RX RY RZ), and its `pole`
    in rad/s, p = -zeta omega + i omega sqrt(1 - zeta^2). `number` is the mode's, `record` that of the data set."""

    number: int
    pole: complex
    nodes: NDArray[np.int64]
    values: NDArray[Any]
    title: str = ""
    record: int = 0

    @property
    def freq(self) -> float:
        """Natural frequency |p| / 2 pi in Hz."""
        return abs(self.pole) / (2 * np.pi)


def read_55(raw: RawSet, fail: Fail) -> Mode55 | None:
    """The mode of a data set, None where it holds something else at its nodes (static displacements, temperatures).

    Raises what `fail` makes, for numbers that are none or too few.
    """
    lines = [decode(line) for line in raw.body.splitlines()]
    if len(lines) < 9:
        raise fail(f"has {len(lines)} lines; a mode has at least 10: export it again")
    kind = _integers(lines[5], fail)
    if len(kind) < 6 or kind[1] not in (NORMAL, COMPLEX, COMPLEX_VELOCITY) or kind[5] not in WIDTHS:
        return None
    analysis, is_complex, width = kind[1], kind[4] in (5, 6), kind[5]
    counts = _integers(lines[6], fail)
    # the count of integers and of reals stand first; they wrap after eight and six
    n_integer, n_real = (counts[0], counts[1]) if len(counts) > 1 else (2, 4)
    at = 6 + max(1, -(-(n_integer + 2) // 8))
    reals: list[float] = []
    while len(reals) < n_real and at < len(lines):
        reals += _reals(lines[at], fail)
        at += 1
    pole = _pole(analysis, reals, fail)
    nodes, values = _shape(lines[at:], width * (2 if is_complex else 1), fail)
    if is_complex:
        values = values[:, 0::2] + 1j * values[:, 1::2]
        if analysis != NORMAL and reals[1] < 0:  # a pole below the real axis: its conjugate is the mode
            values = values.conj()
    number = counts[3] if len(counts) > 3 else 0
    return Mode55(number, pole, frozen(nodes), frozen(values), lines[0].strip(), raw.record)


def _shape(lines: Sequence[str], width: int, fail: Fail) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    per_node = 1 + -(-width // 6)
    rows = [line for line in lines if line.strip()]
    if not rows or len(rows) % per_node:
        raise fail(f"has {len(rows)} lines of data, {per_node} belong to each node: the file is cut short")
    nodes, values = [], []
    for i in range(0, len(rows), per_node):
        nodes.append(_integers(rows[i], fail)[0])
        one = [v for line in rows[i + 1 : i + per_node] for v in _reals(line, fail)]
        if len(one) != width:
            raise fail(f"node {nodes[-1]} has {len(one)} values, {width} were announced; export the shape again")
        values.append(one)
    return np.array(nodes, dtype=np.int64), np.array(values, dtype=np.float64)


def _pole(analysis: int, reals: Sequence[float], fail: Fail) -> complex:
    if analysis == NORMAL:
        freq = reals[0] if reals else float("nan")
        viscous, hysteretic = (reals[2] if len(reals) > 2 else 0.0), (reals[3] if len(reals) > 3 else 0.0)
        zeta = viscous or hysteretic / 2
        if not (np.isfinite(freq) and freq >= 0 and 0 <= zeta < LARGEST_ZETA):
            raise fail(
                f"frequency {freq:g} Hz with damping {zeta:g} is no mode; correct the file (damping is a ratio, 1 % is "
                "0.01)"
            )
        omega = 2 * np.pi * freq
        return complex(-zeta * omega, omega * np.sqrt(1 - zeta**2))
    if len(reals) < 2:
        raise fail("a complex mode has no eigenvalue; export it again")
    return complex(reals[0], abs(reals[1]))


def _integers(line: str, fail: Fail) -> list[int]:
    try:
        return [int(v) for v in line.split()]
    except ValueError:
        raise fail(f"the line {line.strip()[:60]!r} does not hold whole numbers; export the file again") from None


def _reals(line: str, fail: Fail) -> list[float]:
    """Numbers of 13 columns that may touch each other."""
    text = line.rstrip().replace("D", "E").replace("d", "e")
    try:
        return [float(text[i : i + 13]) for i in range(0, len(text), 13) if text[i : i + 13].strip()]
    except ValueError:
        pass
    try:
        return [float(v) for v in text.split()]
    except ValueError:
        raise fail(f"the line {text.strip()[:60]!r} does not hold numbers only; export the file again") from None


def identified_modes(modes: Sequence[Mode55], file: str) -> tuple[IdentifiedModes, tuple[str, ...]]:
    """The shapes of a file as one set of modes, and what was left out.

    Directions that are 0 in all modes were not measured (the format has no other way to say so), which is noted where
    most nodes move along them, and of nodes that move along none, since a dead sensor looks the same; DOFs that a mode
    lacks are left out, modes at 0 Hz (of a free body) too, and those that stand twice, as with both poles of a
    conjugate pair. Raises FormatError where nothing is left, a value is no number, or a mode moves nowhere.
    """
    for m in modes:
        wrong = np.argwhere(~np.isfinite(m.values))
        if wrong.size:
            dof = Dof(int(m.nodes[wrong[0, 0]]), int(wrong[0, 1]) + 1)
            raise FormatError(
                f"{file}: data set {m.record} (type 55): the mode at {m.freq:g} Hz is not a number at {dof} "
                f"({len(wrong)} in all); write 0 in directions that were not measured, or leave the node out",
                file=file,
            )
    elastic = [m for m in modes if m.pole.imag > 1e-9]
    notes = [f"left out: {len(modes) - len(elastic)} at 0 Hz, of a free body"] if len(elastic) < len(modes) else []
    twice = [m for i, m in enumerate(elastic) if any(_same(m, one) for one in elastic[:i])]
    if twice:
        notes.append(f"{len(twice)} modes that stand twice, or as conjugates of others, are left out")
        elastic = [m for m in elastic if all(m is not one for one in twice)]
    tables = [
        {Dof(int(n), c + 1): v for n, row in zip(m.nodes, m.values, strict=True) for c, v in enumerate(row)}
        for m in elastic
    ]
    shared = [d for d in (tables[0] if tables else {}) if all(d in t for t in tables)]
    lost = len({d for t in tables for d in t}) - len(shared)
    if lost:
        notes.append(f"{lost} DOFs that not every mode has are left out")
    shapes = np.array([[t[d] for t in tables] for d in shared], dtype=np.complex128).reshape(len(shared), len(elastic))
    moving = np.any(shapes != 0, axis=1)
    if not moving.any():
        raise FormatError(
            f"{file}: its {len(modes)} data sets 55 share no DOF that moves in a mode with a frequency above 0 Hz; "
            "export shapes and frequencies together",
            file=file,
        )
    for m, shape in zip(elastic, shapes.T, strict=True):
        if not shape.any():
            raise FormatError(
                f"{file}: data set {m.record} (type 55): the mode at {m.freq:g} Hz is 0 at all of the {len(shared)} "
                "DOFs that every mode has; export its shape again, or leave the mode out",
                file=file,
            )
    dofs = tuple(d for d, m in zip(shared, moving, strict=True) if m)
    still = _perhaps_dead(shared, dofs)
    if still:
        notes.append(
            f"{listed(still, NAMED)} {'is' if len(still) == 1 else 'are'} 0 in all modes and taken as not measured, "
            "though other nodes move in that direction: if a sensor was there it is dead, or was not exported"
        )
    return IdentifiedModes(dofs, np.array([m.pole for m in elastic]), shapes[moving]), tuple(notes)


def _perhaps_dead(every: Sequence[Dof], moving: Sequence[Dof]) -> list[Dof]:
    """Of the DOFs `every` that are not `moving` those whose direction is measured at half of the nodes or more, and
    those of nodes without any that moves, in directions that are measured somewhere."""
    nodes, moved = {d.node for d in every}, {d.node for d in moving}
    at = Counter(d.component for d in moving)
    rest = set(every) - set(moving)
    return [
        d for d in every if d in rest and at[d.component] and (2 * at[d.component] >= len(nodes) or d.node not in moved)
    ]


def _same(a: Mode55, b: Mode55) -> bool:
    """Are both one mode, to the digits that the format has?"""
    if abs(a.pole - b.pole) > PRINTED * abs(b.pole) or not np.array_equal(a.nodes, b.nodes):
        return False
    return a.values.shape == b.values.shape and bool(np.allclose(a.values, b.values, rtol=PRINTED, atol=0.0))


def modes_55(modes: IdentifiedModes, title: str = "mode") -> list[Mode55]:
    """`modes` as data sets 55, to be written with `write_uff`: complex shapes with their eigenvalues, 0 in directions
    that were not measured. `title` begins their first line."""
    nodes = sorted({d.node for d in modes.dofs})
    width = 6 if any(d.is_rotation for d in modes.dofs) else 3
    place = {n: i for i, n in enumerate(nodes)}
    out = []
    for r in range(modes.n_modes):
        values = np.zeros((len(nodes), width), dtype=np.complex128)
        for dof, value in zip(modes.dofs, modes.shapes[:, r], strict=True):
            values[place[dof.node], dof.component - 1] = dof.sign * value
        out.append(Mode55(r + 1, complex(modes.poles[r]), np.array(nodes), values, f"{title} {r + 1}"))
    return out


def lines_of_55(mode: Mode55) -> list[str]:
    """The lines of a data set 55, with its type line."""
    is_complex = np.iscomplexobj(mode.values)
    width = mode.values.shape[1]
    omega = abs(mode.pole)
    zeta = -mode.pole.real / omega if omega else 0.0
    head = [2 if not is_complex else COMPLEX, 3 if width == 6 else 2, 8, 5 if is_complex else 2, width]
    real = [mode.pole.real, mode.pole.imag, 1.0, 0.0, 1.0, 0.0] if is_complex else [mode.freq, 1.0, zeta, 0.0]
    lines = ["    55", (mode.title or "NONE")[:80], "NONE", "NONE", "NONE", "NONE"]
    lines.append("".join(f"{v:10d}" for v in (1, *head)))
    lines.append("".join(f"{v:10d}" for v in (2, len(real), 1, mode.number)))
    lines.append(_row(real))
    for node, row in zip(mode.nodes.tolist(), mode.values, strict=True):
        flat = np.column_stack([row.real, row.imag]).ravel() if is_complex else row
        lines.append(f"{node:10d}")
        lines += [_row(flat[i : i + 6].tolist()) for i in range(0, len(flat), 6)]
    return lines


def _row(values: Sequence[float]) -> str:
    return "".join(f"{v:13.5E}" for v in values)
