"""A superelement as bulk data: DMIG for its matrices, SPOINT for its modal coordinates.

Source: MSC Nastran Quick Reference Guide, DMIG (large field, IFO 6 symmetric, TIN 2 real double) and SPOINT.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ModelError
from femend.io.atomic import write_atomic
from femend.io.superelement.matrices import Superelement

__all__ = ["case_control", "dmig_cards", "superelement_cards", "write_superelement"]

# command of case control, first letters of the matrix's name
_KINDS = {"K": ("K2GG", "K"), "M": ("M2GG", "M"), "B": ("B2GG", "B"), "K4": ("K42GG", "K4")}
# with the letters of the kind before it, a name has at most eight characters
MAX_NAME = 6
WIDTH = 16


def _names(superelement: Superelement, name: str) -> dict[str, tuple[str, str]]:
    """For every matrix that is there: command of case control and name of the matrix."""
    if not re.fullmatch(rf"[A-Za-z0-9]{{1,{MAX_NAME}}}", name):
        raise ModelError(f"{name!r} is no name for a superelement; give one to {MAX_NAME} letters and digits")
    there = {kind: _KINDS[kind] for kind in _KINDS if getattr(superelement, kind) is not None}
    return {kind: (command, f"{letters}{name.upper()}") for kind, (command, letters) in there.items()}


def case_control(superelement: Superelement, name: str) -> list[str]:
    """Lines of case control that select the matrices of a `superelement` called `name`: `K2GG = KSE` and so on.

    Several superelements share a line: `K2GG = KSE1, KSE2`. Raises ModelError for a name that is none.
    """
    return [f"{command} = {matrix}" for command, matrix in _names(superelement, name).values()]


def dmig_cards(name: str, matrix: ArrayLike, dofs: Sequence[tuple[int, int]]) -> list[str]:
    """Lines of a symmetric `matrix` (n, n) on `dofs` (node, component) as DMIG `name`.

    A term fills its sixteen columns: twelve digits or more from 1e-9 to 1e14, ten beyond.

    Units are those of the matrix. Zeros are left out; a matrix of zeros keeps one, since Nastran wants a column.

    >>> print(*dmig_cards("K", [[2.0]], [(7, 1)]), sep="\\n")
    DMIG    K              0       6       2       0
    DMIG*   K                              7               1
    *                      7               1             2.0
    """
    A = np.asarray(matrix, dtype=np.float64)
    lines = [f"{'DMIG':8s}{name:8s}{0:8d}{6:8d}{2:8d}{0:8d}"]
    for j, (node, component) in enumerate(dofs):
        rows = [i for i in range(j, len(dofs)) if A[i, j] != 0.0]
        if not rows and not (j == 0 and not A.any()):
            continue
        lines.append(f"{'DMIG*':8s}{name:16s}{node:16d}{component:16d}")
        for i in rows or [0]:
            lines.append(f"{'*':8s}{dofs[i][0]:16d}{dofs[i][1]:16d}{_number(float(A[i, j])):>16s}")
    return lines


def superelement_cards(superelement: Superelement, name: str, *, scalar_points: bool = True) -> list[str]:
    """Bulk data of a `superelement` called `name`: its SPOINTs (unless `scalar_points` is False) and DMIG cards.

    GRIDs of its nodes are the deck's. Units are those of the matrices, which must be the deck's. Raises ModelError for
    a name that is none.
    """
    names = _names(superelement, name)
    n_scalar = len(superelement.scalar_points)
    source = f", {superelement.source}" if superelement.source else ""
    lines = [
        f"$ superelement {name.upper()}{source}",
        f"$ {len(superelement.dofs) - n_scalar} DOFs of {len(superelement.nodes)} nodes, {n_scalar} scalar points",
        *(f"$ case control: {line}" for line in case_control(superelement, name)),
    ]
    if scalar_points:
        points = [f"{node:8d}" for node in superelement.scalar_points]
        lines += [f"{'SPOINT':8s}{''.join(points[i : i + 8])}" for i in range(0, len(points), 8)]
    for kind, (_, matrix) in names.items():
        values: NDArray[np.float64] = getattr(superelement, kind)
        lines += dmig_cards(matrix, values, superelement.dofs)
    return lines


def write_superelement(
    path: str | os.PathLike[str], superelement: Superelement, name: str, *, scalar_points: bool = True
) -> None:
    """Writes the cards of `superelement_cards` to a file that a deck takes in by INCLUDE, complete or not at all.

    `superelement`, `name` and `scalar_points` as there. The deck's case control needs the lines of `case_control`.
    Raises ModelError for a name that is none.

    >>> write_superelement("se.bdf", superelement, "SE102")  # doctest: +SKIP
    """
    write_atomic(path, "\n".join([*superelement_cards(superelement, name, scalar_points=scalar_points), ""]))


def _number(value: float) -> str:
    """A real in sixteen columns, the nearest that fits; the exponent as Nastran allows it, without E."""
    best = ""
    for digits in range(15, 8, -1):
        mantissa, exponent = f"{value:.{digits}E}".split("E")
        text = f"{mantissa.rstrip('0')}{int(exponent):+d}"
        if len(text) <= WIDTH:
            best = text
            break
    plain = ""
    for digits in range(15, -1, -1):
        plain = f"{value:#.{digits}f}"
        if len(plain) <= WIDTH:
            head, tail = plain.split(".")
            plain = f"{head}.{tail.rstrip('0') or '0'}"[:WIDTH]
            break
    if plain and len(plain) <= WIDTH and abs(float(plain) - value) <= abs(_value(best) - value):
        return plain
    return best


def _value(text: str) -> float:
    mantissa, sign, exponent = re.fullmatch(r"(-?[0-9.]+)([+-])([0-9]+)", text).groups()  # type: ignore[union-attr]
    return float(f"{mantissa}e{sign}{exponent}")
