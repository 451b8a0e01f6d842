"""Which modes a test has to find: by effective mass and by energy in a region."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.numerals import plain

__all__ = ["TargetModes", "TargetRow", "energy_fractions", "target_modes"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TargetRow:
    """One mode, numbered from 0: `freq` in Hz, fractions of effective mass in X, Y, Z and of `energy` in the region."""

    mode: int
    freq: float
    mass: tuple[float, ...]
    energy: float
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class TargetModes:
    """`rows` of all modes; `modes` are the chosen ones, `total` (3,) the share of mass that they carry together."""

    rows: tuple[TargetRow, ...]
    total: FloatArray

    @property
    def modes(self) -> tuple[int, ...]:
        """Numbers of the target modes, from 0."""
        return tuple(r.mode for r in self.rows if r.reason)

    def __repr__(self) -> str:
        lines = [f"{'mode':>4} {'f [Hz]':>10} {'mass of X Y Z [%]':>20} {'energy [%]':>10}  target for"]
        for r in self.rows:
            mass = " ".join(f"{100 * x:6.1f}" for x in r.mass)
            lines.append(f"{r.mode + 1:4d} {r.freq:10.4g} {mass:>20} {100 * r.energy:10.1f}  {r.reason}")
        lines.append("targets carry " + " ".join(f"{100 * x:.1f} %" for x in self.total))
        return "\n".join(lines)


def energy_fractions(phi: ArrayLike, A: Any, rows: ArrayLike | None = None) -> FloatArray:
    """Share (n_modes,) of each shape's energy x^T A x that DOFs `rows` carry; `phi` (n_dof, n_modes), `A` K or M.

    phi_i (A phi)_i summed over `rows`, over the sum over all. With all rows left out (None) every DOF's share is
    returned, (n_dof, n_modes). Raises PretestError for a shape without energy.

    >>> energy_fractions([[1.0], [2.0]], np.diag([2.0, 1.0]), [1]).round(3).tolist()
    [0.667]
    """
    x = np.asarray(phi, dtype=np.float64)
    part = x * np.asarray(A @ x)
    total = part.sum(axis=0)
    if not (total > 0).all():
        mode = int(np.flatnonzero(~(total > 0))[0])
        raise PretestError(f"mode {mode + 1} has no energy in this matrix; leave rigid-body modes out")
    return np.asarray(part / total if rows is None else part[np.asarray(rows, dtype=np.int64)].sum(axis=0) / total)


def target_modes(
    freq: ArrayLike,
    effective_mass: ArrayLike,
    total_mass: ArrayLike,
    *,
    band: tuple[float, float] | None = None,
    mass_share: float = 0.05,
    energy: ArrayLike | None = None,
    energy_share: float = 0.1,
) -> TargetModes:
    """Modes at `freq` (n_modes,) Hz with enough effective mass in a direction, or energy in a region of interest.

    `effective_mass` (n_modes, 3) is that of `femend.analysis.effective_mass`, `total_mass` a number or (3,); modes
    outside `band` (Hz) are no targets. A mode counts with `mass_share` of the mass in one direction (NASA-HDBK-7005
    and ECSS-E-ST-32-11 take 5 %), or `energy_share` of its energy in the region, whose shares `energy` (n_modes,) are
    given by `energy_fractions`. Raises PretestError for sizes that do not fit or masses that are not above 0.

    >>> target_modes([5.0, 9.0], [[8.0, 0, 0], [0.1, 0, 0]], 10.0).modes
    (0,)
    """
    f = np.asarray(freq, dtype=np.float64)
    m = np.asarray(effective_mass, dtype=np.float64)
    if f.ndim != 1 or m.ndim != 2 or m.shape[0] != f.size:
        raise PretestError(f"{f.shape} frequencies and effective masses {m.shape}; one row per mode")
    whole = np.broadcast_to(np.asarray(total_mass, dtype=np.float64), (m.shape[1],))
    if not (whole > 0).all():
        said = ", ".join(plain(v) for v in sorted(set(whole.tolist())))
        raise PretestError(
            f"the total mass of the model is {said}, and it has to be above 0: look for negative masses (CONM2, "
            "CMASS2) and for materials without a density (RHO of MAT1)"
        )
    e = np.zeros(f.size) if energy is None else np.asarray(energy, dtype=np.float64)
    if e.shape != f.shape:
        raise PretestError(f"{e.shape} shares of energy for {f.size} modes; one per mode")
    share = m / whole
    low, high = band if band is not None else (-np.inf, np.inf)
    rows = []
    for i in range(f.size):
        why = []
        if low <= f[i] <= high:
            heavy = share[i] >= mass_share
            why += ["mass " + " ".join("XYZ"[j] for j in np.flatnonzero(heavy))] if heavy.any() else []
            why += ["energy"] if energy is not None and e[i] >= energy_share else []
        rows.append(TargetRow(i, float(f[i]), tuple(float(s) for s in share[i]), float(e[i]), ", ".join(why)))
    chosen = [r.mode for r in rows if r.reason]
    return TargetModes(tuple(rows), share[chosen].sum(axis=0))
