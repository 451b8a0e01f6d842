"""A model in a small basis: modes of the band and well above, and what loads, sensors and places add statically."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import ModelError
from femend.model.free_body import RIGID
from femend.model.model import Model
from femend.model.parameter import is_of_damping
from femend.model.reduced.dashpots import Dashpots, dashpot_forces, dashpot_rows
from femend.model.reduced.factor_parts import DEGREE, SAMPLES, coefficients, factor_parts, sandwich
from femend.model.reduced.finite_modes import finite_modes
from femend.model.reduced.one_pattern import on_one_pattern
from femend.model.reduced.parameter_moves import forces_of_moves, missed
from femend.model.reduced.static_basis import LARGE, Held, added, joined, static_shift
from femend.model.reduced.unsolvable import no_solution, told_of
from femend.model.reduced.wider import Basis, WiderBasis, onto

__all__ = ["ReducedModel", "Term", "core_modes", "extend_model", "project_model", "reduce_model"]

FloatArray = NDArray[np.float64]

# modes are kept up to this multiple of the highest frequency asked for: enough for parameters that move by a third
MODES_ABOVE = 3.0
# modes at least, from which these are computed before it is looked whether there are more in the band
MANY = 40
# share of the lowest elastic frequency that the springs give on which a free body hangs
SUSPENDED = 1e-4


@dataclass(frozen=True, eq=False)
class Term:
    """A part of K and M (r, r) multiplied by exp(sum exponent * ln factor) over (parameter, exponent) pairs."""

    exponents: tuple[tuple[int, float], ...]
    K: FloatArray | None = None
    M: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """K(θ) and M(θ) in a basis of r vectors, θ = ln factors of the parameters.

    `V` (n_g, r) gives every DOF of the g-set, `V_a` (n_a, r) the independent ones; `freq` (r,) are the Ritz frequencies
    at the deck's values, in Hz. `names` are the model's parameters, then combinations of `form` errors where they were
    added, then `extra` ones of split parts and springs, of which `members` are the places where they are those of
    members and soft clamps; `attached` are places with the stiffness and mass that were added there. `beams` (m, m) is
    the stiffness of the first m vectors that was taken off as what the deck's beams are known to add to its modes.
    """

    model: Model
    V: Basis
    V_a: Basis
    K_fixed: FloatArray
    M_fixed: FloatArray
    terms: tuple[Term, ...]
    names: tuple[str, ...]
    prior_sd: FloatArray
    freq: FloatArray
    extra: int = 0
    form: Any = None
    members: tuple[Any, ...] = ()
    attached: tuple[tuple[Any, float, float], ...] = ()
    beams: FloatArray | None = None

    @property
    def r(self) -> int:
        """Number of basis vectors."""
        return int(self.V.shape[1])

    @cached_property
    def dashpots(self) -> Dashpots:
        """The deck's dashpots in the basis (`dashpot_rows`)."""
        return dashpot_rows(self.model, self.V, self.freq)

    def as_drawn(self) -> tuple[FloatArray, FloatArray]:
        """K and M (r, r) at the deck's values."""
        K, M = self.K_fixed.copy(), self.M_fixed.copy()
        for term in self.terms:
            K += 0.0 if term.K is None else term.K
            M += 0.0 if term.M is None else term.M
        return K, M

    def rows(self, g_rows: Sequence[int] | NDArray[np.int64], signs: FloatArray | None = None) -> FloatArray:
        """Rows (n, r) of the basis for DOFs `g_rows` of the g-set, times the sensors' signs."""
        V = self.V[np.asarray(g_rows, dtype=np.int64)]
        return V if signs is None else V * np.asarray(signs)[:, None]

    def bare(self) -> ReducedModel:
        """The same without `form` errors; the parts they take off and put on again cancel."""
        own = len(self.model.parameters)
        keep = [*range(own), *range(len(self.names) - self.extra, len(self.names))]
        new = {old: i for i, old in enumerate(keep)}
        K_fixed, M_fixed, terms = self.K_fixed.copy(), self.M_fixed.copy(), []
        for term in self.terms:
            if all(i in new for i, _ in term.exponents):
                terms.append(replace(term, exponents=tuple((new[i], a) for i, a in term.exponents)))
                continue
            K_fixed += 0.0 if term.K is None else term.K
            M_fixed += 0.0 if term.M is None else term.M
        names = tuple(self.names[i] for i in keep)
        return replace(
            self,
            K_fixed=K_fixed,
            M_fixed=M_fixed,
            terms=tuple(terms),
            names=names,
            prior_sd=self.prior_sd[keep],
            form=None,
        )

    def with_part(self, name: str, K: FloatArray, parameter: int | None, prior_sd: float) -> ReducedModel:
        """Splits a part K (r, r) off (the term of `parameter`, or the fixed one) under a factor of its own."""
        n = len(self.names)
        own = Term(((n, 1.0),) if parameter is None else ((parameter, 1.0), (n, 1.0)), K)
        return self.minus(K, parameter)._with_own(own, name, prior_sd)

    def with_mass(self, M: FloatArray, prior_sd: float) -> ReducedModel:
        """The model with a mass M (r, r) under a factor of its own."""
        return self._with_own(Term(((len(self.names), 1.0),), M=M), "mass", prior_sd)

    def _with_own(self, own: Term, name: str, prior_sd: float) -> ReducedModel:
        """The model with a term under a factor of its own."""
        return replace(
            self,
            terms=(*self.terms, own),
            names=(*self.names, name),
            prior_sd=np.append(self.prior_sd, prior_sd),
            extra=self.extra + 1,
        )

    def without(self, beams: FloatArray) -> ReducedModel:
        """The model without the stiffness `beams` (m, m) of its first m vectors."""
        return replace(self, K_fixed=self._less(beams), beams=beams)

    def with_beams(self) -> ReducedModel:
        """The model with what was taken off for its beams."""
        return self if self.beams is None else replace(self, K_fixed=self._less(-self.beams), beams=None)

    def _less(self, beams: FloatArray) -> FloatArray:
        K, m = self.K_fixed.copy(), len(beams)
        K[:m, :m] -= beams
        return K

    def minus(self, K: FloatArray, parameter: int | None) -> ReducedModel:
        """The model without a stiffness part K (r, r) that scales with a parameter, or with none."""
        if parameter is None:
            return replace(self, K_fixed=self.K_fixed - K)
        return replace(self, terms=(*self.terms, Term(((parameter, 1.0),), -K)))


def reduce_model(model: Model, f_max: float, g_rows: Sequence[int], loads: FloatArray | None = None) -> ReducedModel:
    """The model in a basis of its modes up to three times `f_max` (Hz) and the static responses to unit forces.

    `g_rows` are DOFs of the g-set whose static response is kept (sensors, shakers), `loads` (n_a, m) further force
    patterns. Raises SingularModelError naming the DOFs that have neither stiffness nor mass.
    """
    T, large = model.transformation(), model.fe.n_a >= LARGE
    K, M = (factor_parts(model).K, factor_parts(model).M) if large else model.matrices()
    try:
        omega, phi = _modes(K, M, MODES_ABOVE * f_max, len(set(g_rows)))
    except ModelError as error:
        raise told_of(error, model) from error
    patterns = np.hstack([T[sorted(set(g_rows))].T.toarray(), dashpot_forces(model)])
    if loads is not None and loads.size:
        patterns = np.hstack([patterns, loads])
    held = Held.of(K + static_shift(omega) * M)
    if large:
        _kept[model] = held
    V_a = _basis(held, M, phi, patterns, forces_of_moves(model, omega, phi, f_max))
    return _suspended(project_model(model, V_a, np.asarray(T @ V_a)))


def core_modes(K: Any, M: Any, f_max: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n,) in Hz and mass-normalised shapes (n_a, n) of all modes up to `f_max` (Hz)."""
    freq, phi, _, _ = _core_modes(K, M, f_max)
    return np.asarray(freq), np.asarray(phi)


def _modes(K: Any, M: Any, f_max: float, at_least: int) -> tuple[FloatArray, FloatArray]:
    """All modes up to `f_max` (Hz), and two more than `at_least`."""
    # of many the number comes first, since it is seldom too small: modes are worked out once
    many = at_least > MANY
    freq, phi, _, _ = _core_modes(K, M, None, at_least + 2) if many else _core_modes(K, M, f_max)
    if many and freq[-1] <= f_max:
        freq, phi, _, _ = _core_modes(K, M, f_max)
    if not many and len(freq) < at_least + 2:
        freq, phi, _, _ = _core_modes(K, M, None, at_least + 2)
    return 2 * np.pi * np.asarray(freq), np.asarray(phi)


def _core_modes(K: Any, M: Any, f_max: float | None, n: int | None = None) -> tuple[Any, ...]:
    n = None if n is None else min(n, K.shape[0])
    indptr, indices, k, m = K.indptr, K.indices, K.data, M.data
    if not (np.array_equal(indptr, M.indptr) and np.array_equal(indices, M.indices)):
        indptr, indices, (k, m) = on_one_pattern([K, M])
    pattern = indptr.astype(np.int64), indices.astype(np.int64)
    try:
        return _core.modes(*pattern, k, m, n_modes=n, f_max=f_max)
    except ValueError as error:
        # where few DOFs have a mass there are no more modes than these, and static answers do for the rest
        all_of_them = finite_modes(error, n)
        if all_of_them is None:
            raise
        return _core.modes(*pattern, k, m, n_modes=all_of_them, f_max=f_max)


def _basis(held: Held, M: Any, phi: FloatArray, patterns: FloatArray, moving: FloatArray) -> FloatArray:
    """Modes, what the static responses to `patterns` (n_a, m) add to them, and what the answers to the forces `moving`
    (n_a, k) of parameters still do."""
    n, answers = patterns.shape[1], held.responses(np.hstack([patterns, moving]))
    V = joined(phi, answers[:, :n], M)
    return joined(V, missed(held.A, V, answers[:, n:]), M)


# of every large model the one its last reduction made: bases of it are extended again and again
_kept: weakref.WeakKeyDictionary[Model, Held] = weakref.WeakKeyDictionary()


def extend_model(reduced: ReducedModel, loads: FloatArray) -> ReducedModel:
    """A model with its parameters alone (no form errors, nothing split off or added) in its basis and what the static
    responses to `loads` (n_a, m) add to it.

    Only what is new is projected: of a large model a whole reduction takes twenty times as long.
    """
    model, V_a, parts = reduced.model, reduced.V_a, factor_parts(reduced.model)
    held = _kept.get(model)
    if held is None:
        held = _kept[model] = Held.of(parts.K + static_shift(2 * np.pi * reduced.freq) * parts.M)
    new = added(V_a, held.responses(loads), parts.M)
    if not new.shape[1]:
        return reduced

    r, shape = reduced.r, (reduced.r + new.shape[1], new.shape[1])

    def border(A: Any) -> FloatArray:
        moved = A @ new
        corner = new.T @ moved
        return np.vstack([onto(V_a, moved), 0.5 * (corner + corner.T)])

    def bordered(old: FloatArray, column: FloatArray) -> FloatArray:
        return np.block([[old, column[:r]], [column[:r].T, column[r:]]])

    fixed = [border(parts.K), border(parts.M)]
    terms = []
    for term in reduced.terms:
        ((i, power),) = term.exponents
        own = parts.powers[i].get(int(power), (None, None))
        made: list[FloatArray | None] = []
        for which, (old, A) in enumerate(zip((term.K, term.M), own, strict=True)):
            column = np.zeros(shape) if old is None or A is None else border(A)
            fixed[which] = fixed[which] - column
            made.append(None if old is None else bordered(old, column))
        terms.append(replace(term, K=made[0], M=made[1]))
    out = replace(
        reduced,
        V=WiderBasis(reduced.V, np.asarray(model.transformation() @ new)),
        V_a=WiderBasis(V_a, new),
        K_fixed=bordered(reduced.K_fixed, fixed[0]),
        M_fixed=bordered(reduced.M_fixed, fixed[1]),
        terms=tuple(terms),
    )
    return replace(out, freq=ritz_frequencies(out))


def ritz_frequencies(reduced: ReducedModel) -> FloatArray:
    """Ritz frequencies (r,) at the deck's values, Hz."""
    from scipy.linalg import eigh

    K, M = reduced.as_drawn()
    return np.asarray(np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi))


def project_model(model: Model, V_a: FloatArray, V: FloatArray) -> ReducedModel:
    """The model in the basis `V_a` (n_a, r), `V` (n_g, r) of its independent and all DOFs."""
    n = len(model.parameters)
    ones = np.ones(n)
    V_a = np.ascontiguousarray(V_a)
    K, M = _projected(model, V_a)
    K_fixed, M_fixed, terms = K.copy(), M.copy(), []
    for i in range(n):
        for degree, (dK, dM) in _polynomial(model, V_a, ones, i, K, M).items():
            K_fixed, M_fixed = K_fixed - dK, M_fixed - dM
            terms.append(Term(((i, float(degree)),), dK if dK.any() else None, dM if dM.any() else None))
    from scipy.linalg import LinAlgError, eigh

    try:
        omega2 = eigh(K, M, eigvals_only=True)
    except LinAlgError:
        raise no_solution(model) from None
    return ReducedModel(
        model,
        V,
        V_a,
        K_fixed,
        M_fixed,
        tuple(terms),
        tuple(p.name for p in model.parameters),
        np.array([p.prior_sd for p in model.parameters]),
        np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi),
    )


def _projected(model: Model, V_a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """K and M (r, r) at the deck's values in the basis `V_a` (n_a, r)."""
    if len(V_a) >= LARGE:
        parts = factor_parts(model)
        return sandwich(parts.K, V_a), sandwich(parts.M, V_a)
    K, M = model.fe.project(np.ones(len(model.parameters)), V_a)[0][:2]
    return np.asarray(K), np.asarray(M)


def _suspended(reduced: ReducedModel) -> ReducedModel:
    """The `reduced` model of a free body on the springs it hangs on: free decays of a mode of 0 Hz have no frequency,
    and a ten-thousandth of the lowest elastic one is below any band."""
    from scipy.linalg import eigh

    free = reduced.freq < RIGID * reduced.freq[-1]
    if not free.any():
        return reduced
    K, M = reduced.as_drawn()
    carried = M @ eigh(K, M)[1][:, : int(free.sum())]
    soft = (2 * np.pi * SUSPENDED * reduced.freq[~free][0]) ** 2
    return replace(reduced, K_fixed=reduced.K_fixed + soft * carried @ carried.T)


def _polynomial(
    model: Model, V: FloatArray, ones: FloatArray, i: int, K: FloatArray, M: FloatArray
) -> dict[int, tuple[FloatArray, FloatArray]]:
    """Coefficients of K and M over powers 1..3 of factor i, those that are zero left out.

    Exact for every property that enters as a polynomial (all but nu); nu is met at the factors used, which bracket any
    sensible prior.
    """
    if len(V) >= LARGE:
        own = factor_parts(model).powers[i]
        found = [own.get(degree, (None, None)) for degree in range(DEGREE + 1)]
        all_k, all_m = (
            [np.zeros_like(K) if A is None else sandwich(A, V) for A in of] for of in zip(*found, strict=True)
        )
    else:
        Ks, Ms = [], []
        for factor in SAMPLES:
            factors = ones.copy()
            factors[i] = factor
            k, m = model.fe.project(factors, V)[0][:2]
            Ks.append(np.asarray(k))
            Ms.append(np.asarray(m))
        all_k, all_m = coefficients(np.array(Ks)), coefficients(np.array(Ms))
    parts = {}
    for degree in range(1, DEGREE + 1):
        dK, dM = all_k[degree], all_m[degree]
        small_k = np.abs(dK).max() < 1e-9 * np.abs(K).max()
        small_m = np.abs(dM).max() < 1e-9 * np.abs(M).max()
        if not (small_k and small_m):
            parts[degree] = (np.zeros_like(dK) if small_k else dK, np.zeros_like(dM) if small_m else dM)
    if not parts and not is_of_damping(model.parameters[i]):
        name = model.parameters[i].name
        raise ModelError(
            f"parameter {name!r} changes nothing in the band: choose another property or target, and look whether its "
            "value, or another one of the property, is 0 in the deck"
        )
    return parts
