"""What no deck knows: members and masses are each a little off, whatever their group's factor says, and so is the mesh.

A group's factor moves all its members together; in the structure each differs by its tolerances, its welds and its
mesh. Left out, such scatter looks like a small mass or a weak spring somewhere. The scatter of all units together is a
Gaussian field; of it only the few combinations that change the modes of the band matter, and each becomes one unknown.

Elements that interpolate linearly make modes too stiff, by the square of their size over the wavelength. That is no
scatter, it grows steadily with frequency, and so it is one unknown of its own: bending waves shorten with the square
root of frequency, so that the error of a frequency grows in proportion to it. Where the mesh was refined (`mesh_error`)
that is known mode by mode, and little is left of it. What beams leave out of their own waves is known too
(`beam_errors`), and taken off the stiffness of the modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from femend.model.free_body import is_elastic
from femend.model.mesh.refined import QUADRATIC, is_linear, only_shells
from femend.model.mesh.scatter import SUPPORT_SD, Unit, units_of
from femend.model.model import Model
from femend.model.reduced.beam_waves import beam_errors
from femend.model.reduced.reduction import MODES_ABOVE, ReducedModel, Term
from femend.model.reduced.static_basis import LARGE

__all__ = ["MESH_SD", "MODE_SD", "FormErrors", "basis_modes", "form_errors"]

FloatArray = NDArray[np.float64]

# at most so many combinations, and none with less than this share of the strongest one's effect
MOST, WORTH = 30, 0.005
# units beyond this number have only their strongest combinations computed, and their matrices in the basis are held in
# so many bytes at once
MANY, AT_ONCE = 500, 1e8
# neighbouring modes are taken to be at least this share of their frequency squared apart
APART = 0.1
# relative standard deviation of the stiffness error of the mesh at the top of the band, of elements with straight edges
# and nodes at their corners alone: ten of them a wavelength make a frequency some 2 % too high
MESH_SD = 0.025
# relative standard deviation by which each mode's frequency is off by itself, for reasons no physical parameter has
# (mesh, formulation), and in solids of straight edges and nodes
# at their corners alone: bending about either axis, torsion and stretching each have a mesh error of their own (0.4 to
# 1.5 % beside what grows with frequency, on generated cases without any other error)
MODE_SD, SOLID_MODE_SD = 0.005, 0.012
# the same of a mode of a refined mesh, as a share of what refining changed, and beside that: what formulations differ
# in, and the singular stresses at clamps and points that no mesh reaches
REFINED_SHARE, REFINED_MODE_SD = 0.25, 0.003
# the same beside that of solids that were not halved: by so much quadratic bricks of the deck's size are too stiff
# where they are long and clamped, on generated cases
QUADRATIC_MODE_SD = 0.008
# what is left of an error of second order in the size of elements once they are halved
HALVED = 0.25
# share of a mode's mass that one standard deviation of all combinations may take away: three of them leave some
LEAVES = 1 / 3
# largest relative error of a mode's frequency that is taken for known: its estimate is of first order
KNOWN = 0.1
# part of a mode in other vectors of a basis that begins with it which is rounding
ROUNDING = 1e-6
# share of MODE_SD from which it is worth taking off
COUNTS = 0.05
# frequencies that agree to this are of the same mode of the same model
SAME = 1e-4
# a combination is multiplied by exp(p), p with this standard deviation: close to linear over several of them
SD = 0.02


@dataclass(frozen=True, eq=False)
class FormErrors:
    """Combinations of the units' errors: `weights` (n_combinations, n_units) of one standard deviation each; `mesh` is
    the frequency (Hz) at which the mesh's own error has its standard deviation, 0 where it has none to speak of;
    `mode_sd` is by how much (relative) each mode's frequency may be off by itself, `first_sds` the same of the first
    modes where it is known better; `mesh_sd` is the mesh's standard deviation. `beams` are frequencies (Hz) with the
    relative error that beams make in a mode of that frequency. Units and beams act on the modes up to `top` (Hz) alone:
    what else a basis holds are no shapes of their own, but may have so little mass that a few standard
    deviations of an error would take away all of it. In a structure that is cut open they act on all shapes."""

    units: tuple[Unit, ...]
    weights: FloatArray
    mesh: float = 0.0
    mode_sd: float = MODE_SD
    first_sds: tuple[float, ...] = ()
    mesh_sd: float = MESH_SD
    top: float = np.inf
    beams: tuple[tuple[float, float], ...] = ()

    def mode_sds(self, n: int) -> FloatArray:
        """Relative standard deviation by which each of the first n modes' frequencies may be off by itself (n,)."""
        return np.array([*self.first_sds[:n], *[self.mode_sd] * (n - len(self.first_sds))])

    def on(self, reduced: ReducedModel, within: ReducedModel | None = None) -> ReducedModel:
        """The reduced model with one more unknown, of prior mean zero, for every combination and for the mesh, and
        without what its beams are known to add to its frequencies.

        `within` is a model with these errors whose basis is the first part of this one: what they do to the modes up to
        `top`, which it holds, is the same in both, and is not worked out again.
        """
        reduced = self._without_beams(reduced)
        parts = self._parts(reduced, within)
        if not parts:
            return reduced
        first = len(reduced.names)
        K_fixed, M_fixed = reduced.K_fixed.copy(), reduced.M_fixed.copy()
        terms = list(reduced.terms)
        for i, (dK, dM) in enumerate(parts):
            K_fixed -= dK / SD
            M_fixed -= dM / SD
            terms.append(Term(((first + i, 1.0),), dK / SD, dM / SD))
        names = tuple(f"form {i + 1}" for i in range(len(parts)))
        return replace(
            reduced,
            K_fixed=K_fixed,
            M_fixed=M_fixed,
            terms=tuple(terms),
            names=(*reduced.names, *names),
            prior_sd=np.concatenate([reduced.prior_sd, np.full(len(names), SD)]),
            form=self,
        )

    def cut(self, reduced: ReducedModel, element: int, K: FloatArray) -> ReducedModel:
        """The reduced model with these errors where a cut of `element` takes away K (r, r) at the deck's values: the
        cut takes as much less as the element is less stiff, or the model would have negative stiffness."""
        share = self._share(element)
        if not share.any():
            return reduced
        first = reduced.names.index("form 1")
        parts = [(i, (s / SD) * K) for i, s in enumerate(share) if s != 0]
        return replace(
            reduced,
            K_fixed=reduced.K_fixed + np.sum([part for _, part in parts], axis=0),
            terms=(*reduced.terms, *(Term(((first + i, 1.0),), -part) for i, part in parts)),
        )

    def in_all_shapes(self, reduced: ReducedModel, elements: Sequence[int]) -> ReducedModel:
        """The reduced model with these errors, which is about to be cut open at `elements`, where units lack of their
        own in every shape of the basis what they lack between modes: of a large model the units of these elements.

        A member that is softer between modes alone leaves a spring in a cut of it, which takes as much less in all
        shapes.
        """
        small = reduced.model.fe.n_a < LARGE
        own = [i for i, u in enumerate(self.units) if not u.turns and (small or set(elements) & set(u.elements))]
        if not own:
            return reduced
        whole = _combined(reduced, [self.units[i] for i in own], self.weights[:, own])
        first, more, K_fixed, M_fixed = reduced.names.index("form 1"), [], reduced.K_fixed, reduced.M_fixed
        for i, ((K, M), (k, m)) in enumerate(zip(whole, _among_modes(reduced, self.top, whole), strict=True)):
            dK, dM = (K - k) / SD, (M - m) / SD
            K_fixed, M_fixed = K_fixed - dK, M_fixed - dM
            more.append(Term(((first + i, 1.0),), dK, dM))
        return replace(reduced, K_fixed=K_fixed, M_fixed=M_fixed, terms=(*reduced.terms, *more))

    def opened(self, reduced: ReducedModel) -> ReducedModel:
        """A model that was cut open without what beams add to its own modes, where it is without what they add to those
        of the whole structure: taken off a shape that the cut lets go, that is more than the shape has of stiffness."""
        if reduced.beams is None:
            return reduced
        cut = reduced.with_beams()
        omega, Q = basis_modes(cut)
        return replace(self, beams=_known(cut, omega, Q, self.top))._without_beams(cut)

    def stiffer(self, reduced: ReducedModel, element: int, p: FloatArray) -> float:
        """By what share of its stiffness as drawn an element is stiffer at unknowns `p` (n_p,) of a model with these
        errors, whatever parameters do."""
        share = self._share(element)
        if not share.any():
            return 0.0
        first = reduced.names.index("form 1")
        return float(share @ np.expm1(p[first : first + len(share)])) / SD

    def _share(self, element: int) -> FloatArray:
        """Relative change of an element's stiffness by one standard deviation of every combination (n,)."""
        return np.asarray(self.weights @ np.array([u.sd if element in u.elements else 0.0 for u in self.units]))

    def _without_beams(self, reduced: ReducedModel) -> ReducedModel:
        if not self.beams or reduced.beams is not None:
            return reduced
        omega, Q = basis_modes(reduced)
        freq, errors = np.array(self.beams).T
        error = np.zeros(len(omega))
        for i in np.flatnonzero(omega <= 2 * np.pi * self.top):
            same = np.abs(omega[i] / (2 * np.pi * freq) - 1)
            error[i] = errors[np.argmin(same)] if same.min() < SAME else 0.0
        shapes = reduced.as_drawn()[1] @ Q
        return reduced.without((shapes * (omega**2 * (1 - (1 + error) ** -2))) @ shapes.T)

    def _parts(self, reduced: ReducedModel, within: ReducedModel | None) -> list[tuple[FloatArray, FloatArray]]:
        """Changes of K and M (r, r) by one standard deviation of every unknown; `within` as of `on`."""
        parts: list[tuple[FloatArray, FloatArray]] = []
        if within is not None:
            parts += _widened(within, len(self.weights), reduced.r)
        elif len(self.weights):
            parts += _among_modes(reduced, self.top, _combined(reduced, self.units, self.weights))
        if self.mesh > 0:
            dK = _mesh_stiffness(reduced, self.mesh, self.mesh_sd)
            parts.append((dK, np.zeros_like(dK)))
        return parts


def form_errors(reduced: ReducedModel, f_max: float, *, mesh_as_built: bool = False) -> FormErrors:
    """The combinations of member and mass errors that change modes up to `f_max` (Hz) most, and what beams are known to
    leave out, but for structures that are `mesh_as_built`: recordings simulated with the deck."""
    units, mesh = units_of(reduced.model), f_max if _linear(reduced.model) else 0.0
    mode_sd = SOLID_MODE_SD if _linear(reduced.model.as_drawn) & set(QUADRATIC) else MODE_SD
    first_sds = _refined_sds(reduced, mode_sd)
    mesh_sd = MESH_SD if reduced.model.mesh_error is None else HALVED * MESH_SD
    top = MODES_ABOVE * f_max
    omega, Q = basis_modes(reduced)
    beams = () if mesh_as_built else _known(reduced, omega, Q, top)
    if not units:
        return FormErrors((), np.zeros((0, 0)), mesh, mode_sd, first_sds, mesh_sd, top, beams)
    n_band = max(1, int((omega < 1.1 * 2 * np.pi * f_max).sum()))
    elastic = is_elastic(omega)
    own = np.flatnonzero(elastic[:n_band])
    square = omega[own, None] ** 2
    gap = np.maximum(np.abs(omega[None, :] ** 2 - square), APART * square)
    V = reduced.V @ Q
    effects = np.zeros((len(units), len(own) * reduced.r))
    for effect, unit in zip(effects, units, strict=True):
        at = V[unit.rows]
        first = at[:, own]
        effect[:] = ((_seen(unit.stiffness, first, at) - square * _seen(unit.mass, first, at)) / gap).ravel()
    U, s = _strongest(effects)
    # supports are off by more than the rest, which is no less worth having for that
    usual = np.array([unit.sd != SUPPORT_SD for unit in units])
    strongest = _largest(effects[usual] if usual.any() else effects)
    kept = int(min(MOST, (s > WORTH * strongest).sum())) if strongest > 0 else 0
    weights = U[:, :kept].T.copy()
    top = _heavy_enough(units, weights, omega, V, n_band, top)
    return FormErrors(units, weights, mesh, mode_sd, first_sds, mesh_sd, top, beams)


def _heavy_enough(
    units: Sequence[Unit], weights: FloatArray, omega: FloatArray, V: FloatArray, n_band: int, top: float
) -> float:
    """The frequency (Hz), at most `top`, up to which modes `omega` (r,), `V` (n_g, r) keep a mass whatever lumps turn
    with it: nodes of slender members turn in local modes with so little that a lump's own inertia, a guess, is a
    hundred times as much. Modes of the band, the first `n_band`, always count."""
    turning = [i for i, unit in enumerate(units) if unit.turns]
    n = int((omega <= 2 * np.pi * top).sum())
    if not turning or not len(weights) or n <= n_band:
        return top
    parts = np.array([V[u.rows, :n].T @ (u.mass @ V[u.rows, :n]) for u in (units[i] for i in turning)])
    squares = sum(A @ A for A in np.tensordot(weights[:, turning], parts, 1))
    while n > n_band and np.linalg.eigvalsh(squares[:n, :n])[-1] > LEAVES**2:
        n -= 1
    return top if n == int((omega <= 2 * np.pi * top).sum()) else float(0.5 * (omega[n - 1] + omega[n]) / (2 * np.pi))


def _known(reduced: ReducedModel, omega: FloatArray, Q: FloatArray, top: float) -> tuple[tuple[float, float], ...]:
    """`FormErrors.beams` of the elastic modes `omega` (r,), `Q` (r, r) up to `top` (Hz); nothing where none counts."""
    own = np.flatnonzero(is_elastic(omega) & (omega <= 2 * np.pi * top))
    error = np.zeros(len(own))
    for _, part, _ in beam_errors(reduced.model, reduced.V, Q[:, own], omega[own]):
        error += part
    if not (np.abs(error) > COUNTS * MODE_SD).any():
        return ()
    known = np.clip(error, -KNOWN, KNOWN)
    return tuple((float(w / (2 * np.pi)), float(e)) for w, e in zip(omega[own], known, strict=True))


def _strongest(effects: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Left singular vectors and singular values of effects (n_units, n): all of few units, the `MOST` largest of many,
    for which a whole decomposition would take longer than everything else."""
    if len(effects) <= MANY:
        U, s, _ = np.linalg.svd(effects, full_matrices=False)
        return U, s
    from scipy.sparse.linalg import svds

    U, s, _ = svds(effects, MOST, v0=np.ones(min(effects.shape)))
    order = np.argsort(-s)
    return np.asarray(U[:, order]), np.asarray(s[order])


def _largest(A: FloatArray) -> float:
    """Largest singular value of A (m, n), near enough for a threshold, by power iteration."""
    v = A.T @ (A @ np.ones(A.shape[1]))
    for _ in range(10):
        v = A.T @ (A @ (v / max(float(np.linalg.norm(v)), 1e-300)))
    return float(np.sqrt(np.linalg.norm(v)))


def _linear(model: Model) -> set[str]:
    """Cards of the model's shells and solids that interpolate linearly."""
    return {card for _, card, nodes in model.fe.elements() if is_linear(card, len(nodes))}


def _refined_sds(reduced: ReducedModel, mode_sd: float) -> tuple[float, ...]:
    """`FormErrors.first_sds` of a refined model: of the modes whose error in the deck's mesh is known; `mode_sd` of the
    others. Nothing of a model that is not refined, nor of one of beams, whose error was no part of `mode_sd`."""
    error = reduced.model.mesh_error
    if error is None or not _linear(reduced.model.as_drawn):
        return ()
    beside = REFINED_MODE_SD if error.halved or only_shells(reduced.model.as_drawn) else QUADRATIC_MODE_SD
    sds = []
    for f in reduced.freq[reduced.freq <= np.nanmax(error.refined) * (1 + SAME)]:
        own = error.error[np.abs(error.refined / max(f, 1e-300) - 1) < SAME]
        own = own[np.isfinite(own)]
        sds.append(float(np.hypot(REFINED_SHARE * own[0], beside)) if own.size else mode_sd)
    return tuple(sds)


def _mesh_stiffness(reduced: ReducedModel, f_top: float, sd: float) -> FloatArray:
    """Change of K (r, r) that raises each frequency in proportion to itself, by `sd` at `f_top` (Hz) and above."""
    omega, Q = basis_modes(reduced)
    growth = 2 * sd * np.minimum(omega / (2 * np.pi * f_top), 1.0)
    shapes = reduced.as_drawn()[1] @ Q
    return np.asarray((shapes * (growth * omega**2)) @ shapes.T)


def basis_modes(reduced: ReducedModel) -> tuple[FloatArray, FloatArray]:
    """Circular frequencies (r,) and mass-normalised shapes (r, r) in the basis at the deck's values."""
    from scipy.linalg import eigh

    values, Q = eigh(*reduced.as_drawn())
    return np.sqrt(np.maximum(values, 0.0)), Q


def _seen(A: csr_array, left: FloatArray, right: FloatArray) -> FloatArray:
    """What shapes (m, n_left) and (m, n_right) see of a unit's matrix A (m, m): (n_left, n_right)."""
    return np.asarray(left.T @ (A @ right)) if A.nnz else np.zeros((left.shape[1], right.shape[1]))


def _among_modes(
    reduced: ReducedModel, top: float, parts: Sequence[tuple[FloatArray, FloatArray]]
) -> list[tuple[FloatArray, FloatArray]]:
    """Changes of K and M (r, r) as they act between the modes up to `top` (Hz), and on nothing else in the basis."""
    omega, Q = basis_modes(reduced)
    own = Q[:, omega <= 2 * np.pi * top]
    onto = own @ (own.T @ reduced.as_drawn()[1])
    among = [(onto.T @ dK @ onto, onto.T @ dM @ onto) for dK, dM in parts]
    # a basis that begins with these modes has nothing but rounding elsewhere, which nobody need go through
    n = own.shape[1]
    if reduced.model.fe.n_a < LARGE or np.abs(own[n:]).max(initial=0.0) > ROUNDING:
        return among
    return [(_first(dK, n), _first(dM, n)) for dK, dM in among]


def _first(A: FloatArray, n: int) -> FloatArray:
    """The matrix with nothing but its first n rows and columns."""
    out = np.zeros_like(A)
    out[:n, :n] = A[:n, :n]
    return out


def _widened(within: ReducedModel, n: int, r: int) -> list[tuple[FloatArray, FloatArray]]:
    """Changes of K and M (r, r) by one standard deviation of the first n combinations, from those of a model in the
    first vectors of the basis."""
    first, more = within.names.index("form 1") if n else 0, (0, r - within.r)
    # what a cut takes off comes after what it is taken off from
    of = {term.exponents: term for term in reversed(within.terms)}
    parts = []
    for i in range(n):
        term = of[((first + i, 1.0),)]
        assert term.K is not None
        assert term.M is not None
        parts.append((SD * np.pad(term.K, more), SD * np.pad(term.M, more)))
    return parts


def _combined(reduced: ReducedModel, units: Sequence[Unit], weights: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Stiffness and mass (r, r) of every row of `weights` (n, n_units) times the units' standard deviations, at the
    deck's values; some units at a time, since the matrices of all of them outgrow the memory."""
    V, r = reduced.V, reduced.r
    K, M = np.zeros((len(weights), r, r)), np.zeros((len(weights), r, r))
    at_once = max(1, int(AT_ONCE / (8 * r * r)))
    for first in range(0, len(units), at_once):
        some = units[first : first + at_once]
        own = weights[:, first : first + at_once]
        bases = [V[u.rows] for u in some]
        K += np.tensordot(own, np.array([_seen(u.stiffness, B, B) for u, B in zip(some, bases, strict=True)]), 1)
        M += np.tensordot(own, np.array([_seen(u.mass, B, B) for u, B in zip(some, bases, strict=True)]), 1)
    return list(zip(K, M, strict=True))
