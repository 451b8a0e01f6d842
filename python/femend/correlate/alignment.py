"""The test's geometry on the model's: rotation, offset, scale, and what is wrong with units, axes and points."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import finite
from femend.correlate._fits import Fit, Fits, best_fits
from femend.errors import CorrelationError
from femend.numerals import plain

__all__ = ["AXES_NEAR", "Alignment", "align_points", "posed", "unit_scales"]

FloatArray = NDArray[np.float64]

# model units per test unit that a wrong unit gives
UNITS = {
    1.0: "the same unit", 1e-3: "test in mm, model in m", 1e3: "test in m, model in mm",
    0.0254: "test in inch, model in m", 25.4: "test in inch, model in mm", 1 / 0.0254: "test in m, model in inch",
    1 / 25.4: "test in mm, model in inch", 0.3048: "test in ft, model in m", 1 / 0.3048: "test in m, model in ft",
    10.0: "test in cm, model in mm", 0.01: "test in cm, model in m", 100.0: "test in m, model in cm",
}  # fmt: skip
# two geometries of one structure: a scale this near to a unit's is the unit's, a rotation this near to axes is of axes
SCALE_NEAR, AXES_NEAR = 0.02, 0.05
# of a shift, components below this are told as 0
ZERO = 1e-4
# of the model's size: sensors are spread over a good part of it and hardly beyond
SIZES = (0.2, 1.2)
# consensus is sought over at most so many triples of points
TRIPLES = 300


@dataclass(frozen=True, eq=False, repr=False)
class Alignment:
    """`model = scale * R @ test + offset` for points: `R` (3, 3) orthogonal, `offset` (3,) in model units.

    `xyz` (n, 3) are the test points in the model's frame, `mate` (n,) the model points they belong to, `distance` (n,)
    between both; `off` are points beyond the tolerance. `alike` counts other turns and shifts that fit as well (a
    symmetric structure, a regular mesh: points alone do not decide), `others` are they, nearest to this one first;
    `decided` is False where nothing makes this one more likely than they are. `notes` say in words what was wrong.
    """

    R: FloatArray
    scale: float
    offset: FloatArray
    xyz: FloatArray
    mate: NDArray[np.int64]
    distance: FloatArray
    off: tuple[int, ...]
    alike: int
    notes: tuple[str, ...]
    decided: bool = True
    others: tuple[Alignment, ...] = ()

    @property
    def mirrored(self) -> bool:
        """Is the test's frame left-handed where the model's is right-handed?"""
        return bool(np.linalg.det(self.R) < 0)

    def directions(self, vectors: ArrayLike) -> FloatArray:
        """Directions (..., 3) of the test's frame in the model's: `vectors` turned, not scaled."""
        return np.asarray(np.asarray(vectors, dtype=np.float64) @ self.R.T)

    def __repr__(self) -> str:
        rms = float(np.sqrt(np.mean(self.distance**2)))
        return "\n".join([f"Alignment({len(self.mate)} points, scale {self.scale:.6g}, rms {plain(rms)})", *self.notes])


def align_points(
    test: ArrayLike,
    model: ArrayLike,
    mate: ArrayLike | None = None,
    *,
    scale: Literal["unit", "free", "none"] = "unit",
    tolerance: float = 0.02,
) -> Alignment:
    """Brings points `test` (n, 3) onto points `model` (m, 3), where `mate` (n,) gives the model point of each, if
    known.

    With mates three points that are not in line are enough (two and a plane are not); the similarity is that of least
    squares (Umeyama 1991, IEEE PAMI 13, 376-380), mirrored where that is needed, over the largest set of points that
    agree within `tolerance` of the model's diagonal: the others are named, two that stand in each other's place as
    exchanged. Without mates points stay where each is near a model point already, within a quarter of the mesh pitch;
    else all turns of axes, common units and shifts are tried, each with nearest points (iterated closest points, Besl
    and McKay 1992), and of those that fit as well one without a turn or shift is preferred. `scale` "unit" takes a
    factor near that of two units for exactly it, "free" as it comes, "none" is 1. Raises CorrelationError for fewer
    than three points, points in line, or sizes that do not fit.

    >>> model = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3.0]]
    >>> test = [[0, 0, 0], [0, 1000, 0], [-2000, 0, 0], [0, 0, 3000.0]]  # in mm, turned about Z
    >>> found = align_points(test, model, [0, 1, 2, 3])
    >>> round(found.scale, 6), found.mirrored, found.notes[0]
    (0.001, False, 'scale 0.001: test in mm, model in m')
    """
    a, b = _points(test, "test"), _points(model, "model")
    reach = tolerance * float(np.linalg.norm(np.ptp(b, axis=0)))
    if mate is None:
        fits = _closest(a, b, scale, reach)
        pairs = fits.taken.mate
    else:
        fits, pairs = None, np.asarray(mate, dtype=np.int64).ravel()
        if pairs.shape != (len(a),) or pairs.min() < 0 or pairs.max() >= len(b):
            raise CorrelationError(f"{pairs.size} mates for {len(a)} test points among {len(b)} model points; one each")
    if fits is not None and _as_is(fits.taken):
        R, s, t = np.eye(3), 1.0, np.zeros(3)
    else:
        R, s, t, _ = _consensus(a, b[pairs], scale, reach)
    xyz = s * a @ R.T + t
    distance = np.linalg.norm(xyz - b[pairs], axis=1)
    off = tuple(int(i) for i in np.flatnonzero(distance > reach))
    notes = [*_frame_notes(R, s), *_point_notes(xyz, b, pairs, off, reach)]
    others = () if fits is None else fits.others
    if fits is not None and (others or not fits.prefers):
        notes.append(_alike_note(fits))
    decided = fits is None or fits.prefers
    too = tuple(_aligned(fit, a, reach) for fit in others)
    return Alignment(R, s, t, xyz, pairs, distance, off, len(others), tuple(notes), decided, too)


def _aligned(fit: Fit, a: FloatArray, reach: float) -> Alignment:
    """Points `a` (n, 3) brought to the model by a `fit`."""
    off = tuple(int(i) for i in np.flatnonzero(fit.distance > reach))
    xyz = fit.scale * a @ fit.R.T + fit.shift
    notes = tuple(_frame_notes(fit.R, fit.scale))
    return Alignment(fit.R, fit.scale, fit.shift, xyz, fit.mate, fit.distance, off, 0, notes)


def posed(test: FloatArray, model: FloatArray, R: FloatArray, scale: float) -> Alignment:
    """Points `test` (n, 3) turned by `R` and scaled, with no shift, each with the nearest of `model` (m, 3) as mate,
    none of them off. Raises nothing."""
    xyz = scale * test @ R.T
    mate = np.array([int(np.argmin(np.linalg.norm(model - x, axis=1))) for x in xyz])
    distance = np.linalg.norm(xyz - model[mate], axis=1)
    return Alignment(R, scale, np.zeros(3), xyz, mate, distance, (), 0, tuple(_frame_notes(R, scale)))


def unit_scales(test: FloatArray, model: FloatArray) -> list[float]:
    """Model units per test unit for which points `test` (n, 3) are spread over a good part of `model` (m, 3)."""
    of_test, of_model = (float(np.linalg.norm(np.ptp(x, axis=0))) for x in (test, model))
    return [u for u in UNITS if SIZES[0] < u * of_test / of_model < SIZES[1]]


def _as_is(fit: Fit) -> bool:
    return fit.scale == 1.0 and not fit.shift.any() and bool((np.eye(3) == fit.R).all())


def _points(values: ArrayLike, what: str) -> FloatArray:
    x = np.asarray(finite(values, f"the {what} geometry"), dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 3 or len(x) < 3:
        raise CorrelationError(f"the {what} geometry has shape {x.shape}; it takes three points or more, (n, 3)")
    if np.linalg.svd(x - x.mean(axis=0), compute_uv=False)[1] < 1e-6 * np.ptp(x, axis=0).max():
        raise CorrelationError(f"the {len(x)} points of the {what} geometry are in line: the turn about it is open")
    return x


def _similarity(a: FloatArray, b: FloatArray, scale: str, flip: bool) -> tuple[FloatArray, float, FloatArray]:
    """R, s, t of b = s R a + t by least squares; det R = -1 where `flip`."""
    ca, cb = a.mean(axis=0), b.mean(axis=0)
    U, w, Vt = np.linalg.svd((b - cb).T @ (a - ca))
    D = np.ones(3)
    D[2] = np.sign(np.linalg.det(U) * np.linalg.det(Vt)) * (-1.0 if flip else 1.0)
    R = (U * D) @ Vt
    s = 1.0
    if scale != "none":
        s = float((w * D).sum() / ((a - ca) ** 2).sum())
        near = min(UNITS, key=lambda u: abs(np.log(max(s, 1e-300) / u)))
        if scale == "unit" and abs(s / near - 1) < SCALE_NEAR:
            s = near
    return R, s, cb - s * R @ ca


def _consensus(
    a: FloatArray, b: FloatArray, scale: str, reach: float
) -> tuple[FloatArray, float, FloatArray, NDArray[np.bool_]]:
    n = len(a)
    flat = np.linalg.matrix_rank(a - a.mean(axis=0), tol=1e-6 * np.ptp(a, axis=0).max()) < 3
    flips = (False,) if flat else (False, True)  # points in a plane are mirrored by a turn

    def fit(at: NDArray[np.int64] | NDArray[np.bool_], flip: bool) -> tuple[FloatArray, float, FloatArray, FloatArray]:
        R, s, t = _similarity(a[at], b[at], scale, flip)
        return R, s, t, np.linalg.norm(s * a @ R.T + t - b, axis=1)

    options = [(fit(np.arange(n), flip), flip) for flip in flips]
    best, flip = min(options, key=lambda o: float((o[0][3] ** 2).sum()))
    if best[3].max() <= reach:
        return *best[:3], np.ones(n, dtype=bool)
    triples = list(combinations(range(n), 3 if flat else min(4, n)))
    if len(triples) > TRIPLES:
        rng = np.random.default_rng(0)
        triples = [triples[i] for i in rng.choice(len(triples), TRIPLES, replace=False)]
    count, found = 0, (best, flip)
    for at in triples:
        for flip in flips:
            one = fit(np.array(at), flip)
            agree = int((one[3] <= reach).sum())
            if one[1] > 0 and agree > count:
                count, found = agree, (one, flip)
    inside = found[0][3] <= reach
    if inside.sum() >= 3:
        again = fit(inside, found[1])
        return *again[:3], again[3] <= reach
    return *best[:3], best[3] <= reach


def _closest(a: FloatArray, b: FloatArray, scale: str, reach: float) -> Fits:
    """Mates by nearest points over all turns of axes and units."""
    size_a, size_b = (float(np.linalg.norm(np.ptp(x, axis=0))) for x in (a, b))
    scales = [1.0] if scale == "none" else unit_scales(a, b)
    if scale == "free" or not scales:
        scales.append(size_b / size_a)
    return best_fits(a, b, scales, reach)


def _frame_notes(R: FloatArray, s: float) -> list[str]:
    notes = []
    near = min(UNITS, key=lambda u: abs(np.log(max(s, 1e-300) / u)))
    if abs(s - 1.0) > 1e-12:
        word = UNITS[near] if abs(s / near - 1) < 1e-9 else "no common pair of units"
        notes.append(f"scale {s:.6g}: {word}")
    if np.abs(R - np.rint(R)).max() < AXES_NEAR:
        moved = _axes(R)
        notes += [moved] if moved else []
    else:
        angle = np.degrees(np.arccos(np.clip((np.trace(R * np.sign(np.linalg.det(R))) - 1) / 2, -1, 1)))
        notes.append(f"the test's frame is turned by {angle:.1f} degrees about an axis of its own")
    if np.linalg.det(R) < 0:
        notes.append("the test's frame is left-handed: an axis has the wrong sign")
    return notes


def _axes(R: FloatArray) -> str:
    """Which axis of the test is which of the model, where they differ."""
    axes = np.rint(R)
    moved = [
        f"test {'XYZ'[j]} is model {'-' if axes[i, j] < 0 else ''}{'XYZ'[i]}"
        for j in range(3) for i in range(3) if axes[i, j] and (i != j or axes[i, j] < 0)
    ]  # fmt: skip
    return ", ".join(moved)


def _alike_note(fits: Fits) -> str:
    """That others fit as well, the nearest of them, and what follows."""
    if not fits.others:
        return "a geometry scaled so fits somewhere on any mesh as fine as this; give the `mate` of each"
    n, taken, other = len(fits.others), _fit_words(fits.taken), _fit_words(fits.others[0])
    if fits.prefers:
        said = f"{n} other {'turn or shift fits' if n == 1 else 'turns or shifts fit'} as well"
        return f"{said} ({other}{'' if n == 1 else ', to name one'}); the one nearest to the frame as it is was taken"
    if fits.taken.same_turn(fits.others[0]):
        other = f"by {_shift_words(fits.others[0])}"
    said = f"{n + 1} turns and shifts fit alike ({taken}, or {other}{'' if n == 1 else ', to name two'})"
    return f"{said}: the points are symmetric or the mesh is regular; give the `mate` of each"


def _fit_words(fit: Fit) -> str:
    return f"{_axes(fit.R) or 'no turn'}, shifted by {_shift_words(fit)}"


def _shift_words(fit: Fit) -> str:
    return f"({', '.join(plain(float(v)) for v in np.where(np.abs(fit.shift) > ZERO * fit.size, fit.shift, 0.0))})"


def _point_notes(
    xyz: FloatArray, b: FloatArray, pairs: NDArray[np.int64], off: tuple[int, ...], reach: float
) -> list[str]:
    notes, told = [], set()
    for i, j in combinations(off, 2):
        if np.linalg.norm(xyz[i] - b[pairs[j]]) <= reach and np.linalg.norm(xyz[j] - b[pairs[i]]) <= reach:
            notes.append(f"test points {i} and {j} are exchanged")
            told |= {i, j}
    for i in off:
        if i not in told:
            apart = float(np.linalg.norm(xyz[i] - b[pairs[i]]))
            notes.append(f"test point {i} is {plain(apart)} from its mate {int(pairs[i])}")
    return notes
