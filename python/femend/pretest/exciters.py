"""Where to excite, and where to hang the structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.pretest.placement import target_shapes

__all__ = [
    "RESIDUE_MIN",
    "ExciterChoice",
    "driving_point_residues",
    "exciters",
    "mode_indicator",
    "suspension_points",
]

FloatArray = NDArray[np.float64]

# a mode is hardly driven where its residue is below this share of the best place's (34 dB less of it in the FRFs)
RESIDUE_MIN = 0.02
# where no place drives all modes so well, those count that come this near to the best one (6 dB)
_NEAR = 0.5
# a best place whose least residue is below this share of what it should be drives some modes not at all
_NONE = 0.1
_POWER = {"receptance": 1, "mobility": 0, "accelerance": -1}


def driving_point_residues(phi: ArrayLike, omega: ArrayLike, *, kind: str = "mobility") -> FloatArray:
    """Driving-point residues (n_dof, n_modes) of mass-normalised `phi` (n_dof, n_modes) at `omega` (n_modes,) rad/s.

    phi^2 / omega for receptance, phi^2 for mobility, phi^2 omega for accelerance, each over two: the modulus of the
    residue phi_i^2 / (2 i omega) and its derivatives (Imamovic 1998, "Validation of large structural dynamics models",
    section 4.3 for the average driving-point residue). Raises PretestError for an unknown `kind`, sizes that do not
    fit, and rigid-body modes in a receptance.

    >>> driving_point_residues([[2.0]], [4.0], kind="receptance").tolist()
    [[0.5]]
    """
    x, w = target_shapes(phi), np.asarray(omega, dtype=np.float64)
    if kind not in _POWER:
        raise PretestError(f"FRF kind {kind!r} is none of {', '.join(_POWER)}")
    if w.shape != (x.shape[1],) or not (w >= 0).all() or (kind == "receptance" and not (w > 0).all()):
        raise PretestError(f"frequencies {w.shape} for {x.shape[1]} modes; one per mode, above 0 for a receptance")
    return np.asarray(0.5 * x**2 / w ** _POWER[kind]) if _POWER[kind] else np.asarray(0.5 * x**2)


def mode_indicator(
    phi: ArrayLike, omega: ArrayLike, zeta: ArrayLike, inputs: Sequence[int], outputs: Sequence[int] | None = None
) -> FloatArray:
    """Least multivariate MIF (n_modes,) near each mode with exciters at rows `inputs`: 0 found, 1 not excited.

    FRFs are superposed from mass-normalised `phi` (n_dof, n_modes), `omega` (n_modes,) rad/s, `zeta`; the indicator is
    the least over force patterns of |Re x|^2 / |x|^2 at the natural frequency (Williams, Crowley and Vold 1985), x the
    motion of `outputs` (all rows by default). A mode that neighbours hide does not dip. Raises PretestError for no
    input.
    """
    from scipy.linalg import eigh

    x, w = target_shapes(phi), np.asarray(omega, dtype=np.float64)
    z = np.broadcast_to(np.asarray(zeta, dtype=np.float64), w.shape)
    if len(inputs) == 0:
        raise PretestError("there is no exciter; give at least one row")
    out = x if outputs is None else x[list(outputs)]
    drive = x[list(inputs)]
    found = np.ones(w.size)
    for r, at in enumerate(w):
        q = 1.0 / (w**2 - at**2 + 2j * z * w * at + 1e-300)
        H = (out * q) @ drive.T
        A, B = H.real.T @ H.real, H.imag.T @ H.imag
        size = float(np.trace(A + B))
        # the mode itself has to take part, or the dip is a neighbour's
        if size > 0 and np.abs(drive[:, r]).max() > 1e-6 * np.abs(x[:, r]).max():
            patterns = eigh(A, A + B + 1e-12 * size * np.eye(len(inputs)))
            share = np.abs((drive.T @ patterns[1]) * q[:, None])
            own = share[r] >= 0.5 * share.max(axis=0)
            found[r] = float(patterns[0][own].min(initial=1.0))
    return np.clip(found, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class ExciterChoice:
    """`rows` in the order of choice, `indicator` (n_modes,) with all of them, `weakest` mode and its least relative
    residue at the best exciter."""

    rows: tuple[int, ...]
    indicator: FloatArray
    excitation: FloatArray

    @property
    def weakest(self) -> int:
        """The mode that is excited least, from 0."""
        return int(np.argmin(self.excitation))


def exciters(
    phi: ArrayLike,
    omega: ArrayLike,
    n_exciters: int,
    *,
    zeta: ArrayLike = 0.01,
    allowed: ArrayLike | None = None,
    outputs: Sequence[int] | None = None,
    kind: str = "mobility",
    indicator_max: float = 0.3,
    residue_min: float = RESIDUE_MIN,
) -> ExciterChoice:
    """`n_exciters` rows of `phi` (n_dof, n_modes), mass-normalised at `omega` (n_modes,) rad/s, that excite all modes.

    Each mode's driving-point residues (`kind`) are taken relative to its largest among the `allowed` rows (mask or
    numbers). Rows are added one by one. A row has to drive first: the least excited mode, by its best exciter, to
    `residue_min`, or where no row does, to half of what the best one does. Where no row drives all modes to a tenth of
    `residue_min`, as where they move along different axes, the rows that drive most modes count, by those. The least
    residue is what keeps exciters off the nodal lines of all modes (Kientzy, Richardson and Blakely 1989, "Using finite
    element data to set up modal tests"; Imamovic's non-optimum driving point); the indicator does not see them, being a
    ratio: where all modes hardly move alike it is as good as where all move well. Of the rows that drive, the one is
    taken with which fewest modes have an indicator above `indicator_max` (`mode_indicator` with `zeta` and `outputs`),
    then the least excited mode is excited best, as a worst case is what a test fails by. Raises PretestError where
    nothing moves, where more are wanted than there are places, and for a `residue_min` that is not from 0 to 1.

    >>> phi = np.array([[1.0, 0.0], [0.8, 0.7], [0.0, 1.0]])
    >>> exciters(phi, [10.0, 20.0], 1).rows  # the others are on a node of one mode
    (1,)
    """
    from femend.pretest.placement import candidates

    if not 0 <= residue_min <= 1:
        raise PretestError(f"residue_min {residue_min:g} is not from 0 to 1; it is a share of each mode's largest")
    residues = driving_point_residues(phi, omega, kind=kind)
    rows, _ = candidates(residues.shape[0], n_exciters, allowed, ())
    largest = residues[rows].max(axis=0)
    if not (largest > 0).all():
        mode = int(np.flatnonzero(~(largest > 0))[0])
        raise PretestError(f"no allowed row moves in mode {mode + 1}; allow more rows, or take it off the targets")
    relative = residues / largest
    chosen: list[int] = []
    while len(chosen) < n_exciters:
        free = [int(r) for r in rows if int(r) not in chosen]
        driven = {r: relative[[*chosen, r]].max(axis=0) for r in free}
        best = max(float(d.min()) for d in driven.values())
        # below that no row drives all modes, as of planes that do not couple
        enough = residue_min if best < _NONE * residue_min else min(residue_min, _NEAR * best)
        count = {r: int((d >= enough).sum()) for r, d in driven.items()}
        options = []
        for r in free:
            if count[r] < max(count.values()):
                continue
            seen = mode_indicator(phi, omega, zeta, [*chosen, r], outputs)
            hidden = int((seen > indicator_max).sum())
            least = float(driven[r][driven[r] >= enough].min(initial=1.0))
            options.append((hidden, -least, -float(driven[r].mean()), r))
        chosen.append(min(options)[3])
    return ExciterChoice(tuple(chosen), mode_indicator(phi, omega, zeta, chosen, outputs), relative[chosen].max(axis=0))


def suspension_points(
    phi: ArrayLike, n_points: int, *, allowed: ArrayLike | None = None, weights: ArrayLike | None = None
) -> tuple[int, ...]:
    """The `n_points` rows of `phi` (n_dof, n_modes) that move least in the elastic modes, the quietest first.

    The measure is the root mean square over modes of the motion relative to each mode's largest (average driving-point
    residue of shapes scaled so), with `weights` (n_modes,) of the modes; `allowed` a mask or row numbers. A soft
    suspension there changes and damps the modes least. Raises PretestError as `effective_independence`.

    >>> suspension_points([[1.0], [0.1], [-1.0]], 1)
    (1,)
    """
    from femend.pretest.placement import candidates

    x = target_shapes(phi)
    rows, _ = candidates(x.shape[0], n_points, allowed, ())
    w = np.ones(x.shape[1]) if weights is None else np.asarray(weights, dtype=np.float64)
    if w.shape != (x.shape[1],):
        raise PretestError(f"{w.shape} weights for {x.shape[1]} modes; one per mode")
    motion = np.sqrt(((x / np.maximum(np.abs(x).max(axis=0), 1e-300)) ** 2 @ w)[rows])
    return tuple(int(r) for r in rows[np.argsort(motion, kind="stable")[:n_points]])
