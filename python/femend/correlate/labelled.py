"""The criteria on labelled data: rows matched by DOF, signs of sensors applied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.correlate.assurance import mac
from femend.correlate.pairing import ModePairing, pair_modes
from femend.correlate.tables import ModeTable, mode_table
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import CorrelationError, PairingError

__all__ = ["DofMatch", "ModeComparison", "compare_modes", "mac_of_modes", "match_dofs"]

# Share of a mode's own largest motion: one that stays below it at the DOFs compared cannot be seen there.
_SEEN = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class DofMatch:
    """Rows of both sets that are one DOF: `rows_a`, `rows_b` (n,), and `sign` (n,) that turns `b` into `a`.

    `dofs` are those of the first set; `n_rotations` counts shared rotations that were left out.
    """

    dofs: tuple[Dof, ...]
    rows_a: NDArray[np.int64]
    rows_b: NDArray[np.int64]
    sign: NDArray[np.float64]
    n_rotations: int = 0


def match_dofs(
    dofs_a: Sequence[Dof],
    dofs_b: Sequence[Dof],
    *,
    places: Mapping[Dof, Dof] | None = None,
    rotations: bool = False,
) -> DofMatch:
    """The DOFs that `dofs_a` and `dofs_b` share, in the order of the first.

    `places` maps a sensor of the first set to its DOF in the second where their names differ (the pairs of
    `femend.pair_sensors`). Rotations are left out unless `rotations`, since a sum over metres and radians depends on
    the unit of length. Raises PairingError where nothing is shared or a DOF stands twice in a set.

    >>> match_dofs([Dof(1, 3), Dof(2, 3)], [Dof(2, 3, -1), Dof(5, 1)]).sign.tolist()
    [-1.0]
    """
    row_b = _rows(dofs_b, "second")
    _rows(dofs_a, "first")
    # A map is looked up whatever the sign: a sensor mounted the other way round has its place there, turned.
    mapped = {(k.node, k.component): (k.sign, target) for k, target in (places or {}).items()}
    dofs, rows, others, signs, left_out = [], [], [], [], 0
    for i, dof in enumerate(dofs_a):
        turn, target = mapped.get((dof.node, dof.component), (dof.sign, dof))
        j = row_b.get((target.node, target.component))
        if j is None:
            continue
        if dof.is_rotation and not rotations:
            left_out += 1
            continue
        dofs.append(dof)
        rows.append(i)
        others.append(j)
        signs.append(float(dof.sign * turn * target.sign * dofs_b[j].sign))
    if not dofs:
        why = f" ({left_out} shared rotations are left out; ask for them with rotations=True)" if left_out else ""
        raise PairingError(
            f"the two sets share none of their {len(dofs_a)} and {len(dofs_b)} DOFs{why}: the first has "
            f"{_some(dofs_a)}, the second {_some(dofs_b)}; map sensors to DOFs of the model (pair_sensors)"
        )
    return DofMatch(
        tuple(dofs), np.array(rows, dtype=np.int64), np.array(others, dtype=np.int64), np.array(signs), left_out
    )


@dataclass(frozen=True, slots=True, eq=False)
class ModeComparison:
    """Two sets of modes compared at the DOFs they share.

    `mac` (n_a, n_b) over all modes, `phi_a`, `phi_b` the shapes at the shared DOFs in the directions of the first set,
    `pairing` and `table` of the pairs.
    """

    match: DofMatch
    phi_a: NDArray
    phi_b: NDArray
    mac: NDArray[np.float64]
    pairing: ModePairing
    table: ModeTable

    def __repr__(self) -> str:
        return f"ModeComparison over {len(self.match.dofs)} DOFs\n{self.table.text()}"


def mac_of_modes(
    a: ModeSet, b: ModeSet, *, places: Mapping[Dof, Dof] | None = None, rotations: bool = False
) -> NDArray[np.float64]:
    """MAC (n_a, n_b) of the modes `a` with `b` at the DOFs they share; `places` and `rotations` as in `match_dofs`.

    Raises PairingError where nothing is shared.

    >>> one = ModeSet([1.0], [0.0], [[1.0], [2.0]], (Dof(1, 3), Dof(2, 3)))
    >>> other = ModeSet([1.1], [0.0], [[-2.0], [1.0]], (Dof(2, 3, -1), Dof(1, 3)))
    >>> mac_of_modes(one, other).tolist()
    [[1.0]]
    """
    match = match_dofs(a.dofs, b.dofs, places=places, rotations=rotations)
    return mac(a.phi[match.rows_a], match.sign[:, None] * b.phi[match.rows_b])


def compare_modes(
    a: ModeSet,
    b: ModeSet,
    *,
    places: Mapping[Dof, Dof] | None = None,
    rotations: bool = False,
    mac_min: float = 0.5,
    closeness: float = 0.02,
    frequency_weight: float = 0.1,
) -> ModeComparison:
    """Pairs the modes of `a` (the reference, a test say) with those of `b` and tabulates what they differ in.

    `places` and `rotations` as in `match_dofs`; `mac_min`, `closeness`, `frequency_weight` as in `pair_modes`. A mode
    whose motion at the shared DOFs stays below 1e-4 of its largest motion anywhere is said to be unseen and not
    paired. Raises PairingError where no DOF is shared, and CorrelationError for what is no ModeSet.

    >>> phi = [[1.0, 1.0], [1.0, -1.0]]
    >>> test = ModeSet([9.0, 12.0], [0.01, 0.02], phi, (Dof(1, 3), Dof(2, 3)))
    >>> model = ModeSet([10.0, 12.6], [0.0, 0.0], phi, (Dof(1, 3), Dof(2, 3)))
    >>> [round(row.freq_difference, 3) for row in compare_modes(test, model).table.rows]
    [0.111, 0.05]
    """
    for given in (a, b):
        if not isinstance(given, ModeSet):
            raise CorrelationError(
                f"`compare_modes` takes two ModeSet, and a {type(given).__name__} was given: those of a model are "
                "`femend.model_modes(model)`, those of a modal test `test.modes.to_mode_set()`"
            )
    match = match_dofs(a.dofs, b.dofs, places=places, rotations=rotations)
    phi_a, phi_b = a.phi[match.rows_a], match.sign[:, None] * b.phi[match.rows_b]
    pairing = pair_modes(
        phi_a,
        phi_b,
        a.freq,
        b.freq,
        mac_min=mac_min,
        closeness=closeness,
        frequency_weight=frequency_weight,
        seen_a=_seen(a, match.rows_a, rotations),
        seen_b=_seen(b, match.rows_b, rotations),
    )
    table = mode_table(pairing, a.freq, b.freq, phi_a, phi_b, a.zeta, b.zeta)
    return ModeComparison(match, phi_a, phi_b, mac(phi_a, phi_b), pairing, table)


def _seen(modes: ModeSet, rows: NDArray[np.int64], rotations: bool) -> NDArray[np.bool_]:
    """Modes that move at `rows`, measured against their own largest motion of the same kind."""
    size = np.abs(modes.phi)
    alike = size if rotations else size[[i for i, dof in enumerate(modes.dofs) if not dof.is_rotation]]
    return np.asarray(size[rows].max(axis=0) > _SEEN * alike.max(axis=0, initial=0.0), dtype=np.bool_)


def _rows(dofs: Sequence[Dof], which: str) -> dict[tuple[int, int], int]:
    found: dict[tuple[int, int], int] = {}
    for i, dof in enumerate(dofs):
        first = found.setdefault((dof.node, dof.component), i)
        if first != i:
            raise PairingError(f"DOF {dof} stands twice in the {which} set, at {first} and {i}; leave one row out")
    return found


def _some(dofs: Sequence[Dof]) -> str:
    return " ".join(str(d) for d in dofs[:4]) + (" …" if len(dofs) > 4 else "")
