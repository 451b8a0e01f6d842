"""One structure in several configurations: each a small model in the same unknowns.

The deck is read without supports. A configuration holds the DOFs of its SPC set except those a term frees, adds its
masses and the terms that exist in it, and is projected on a basis of its own. What stays is

    K(p) = sum_i prod_j v_j(p)^e_ij K_i,   M(p) likewise,   C(p) = alpha M + beta K_structure + sum_i prod v_j^e_ij C_i

with few rows, and exact derivatives with respect to every unknown. These matrices are those at rest; what turning adds
to the dynamic stiffness is told apart, line by line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend import _core
from femend.errors import ModelError
from femend.model.model import Model, model_of
from femend.model.parameter import Parameter, is_of_damping
from femend.model.reduced.parameter_moves import forces_of_moves, missed
from femend.model.reduced.reduction import MODES_ABOVE, _core_modes, _polynomial
from femend.model.reduced.unsolvable import no_solution, told_of
from femend.model.terms.linear_terms import LinearTerm, SpeedPower
from femend.model.terms.spinning import SpinningPart, gyroscopic, gyroscopic_slopes
from femend.model.terms.supports import held_rows
from femend.model.terms.unknowns import Unknowns

__all__ = ["ALPHA", "BETA", "ConfiguredModel", "Part", "TurningPart", "configure", "free_model"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# unknowns of the structure's own damping
ALPHA, BETA = "damping: alpha", "damping: beta"
# basis: modes with the terms' stiffness at these multiples of their scale (a soft, the guessed, a stiff support)
LEVELS = (1e-2, 1.0, 1e2)
FEWEST_MODES = 12
# directions that add less than this of their length to the others are left out of a basis
INDEPENDENT = 1e-4


@dataclass(frozen=True, eq=False)
class Part:
    """A part of K, M or C (r, r) under the product of value ** power over (unknown, power)."""

    kind: str
    matrix: FloatArray
    powers: tuple[tuple[int, float], ...]
    structural: bool


@dataclass(frozen=True, eq=False)
class TurningPart:
    """A part of K or C (r, r) that acts with the speed: its weight times the value of one `unknown` (None: 1)."""

    kind: str
    matrix: FloatArray
    unknown: int | None
    over_speed: SpeedPower

    def value(self, v: FloatArray) -> float:
        """What multiplies it, of the values `v` (n,) of the unknowns."""
        return 1.0 if self.unknown is None else float(v[self.unknown])

    def weight(self, s: ComplexArray, speed: FloatArray) -> ComplexArray:
        """What `matrix` counts in the dynamic stiffness on lines `s` (K,) at `speed` (K,) rad/s, per unit of value."""
        return np.asarray(self.over_speed.at(speed) * (s if self.kind == "C" else 1.0), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class ConfiguredModel:
    """A configuration in a basis of r vectors; `V` (n_g, r) gives every DOF of the g-set."""

    name: str
    model: Model
    V: FloatArray
    parts: tuple[Part, ...]
    unknowns: Unknowns
    turning: tuple[TurningPart, ...] = ()

    @property
    def spins(self) -> bool:
        """Do rotors of the deck turn in it, beside what terms make of the speed?"""
        return any(part.unknown is None for part in self.turning)

    @property
    def r(self) -> int:
        """Number of basis vectors."""
        return int(self.V.shape[1])

    def rows(self, g_rows: Sequence[int] | NDArray[np.int64], signs: FloatArray | None = None) -> FloatArray:
        """Rows (n, r) of the basis for DOFs `g_rows` of the g-set, times the sensors' signs."""
        V = self.V[np.asarray(g_rows, dtype=np.int64)]
        return V if signs is None else V * np.asarray(signs)[:, None]

    def matrices(self, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """K, M, C (r, r) at rest, at the unknowns p (n,)."""
        return self._sum(p)[:3]

    def turning_stiffness(self, p: FloatArray, s: ComplexArray, speed: FloatArray) -> ComplexArray:
        """What turning at `speed` (K,) rad/s adds to the dynamic stiffness on lines `s` (K,) at the unknowns `p` (n,):
        (K, r, r)."""
        v = self.unknowns.values(p)
        total = np.zeros((len(s), self.r, self.r), dtype=np.complex128)
        for part in self.turning:
            total += (part.value(v) * part.weight(s, speed))[:, None, None] * part.matrix
        return total

    def turning_changes(
        self, p: FloatArray, s: ComplexArray, speed: FloatArray
    ) -> list[tuple[int, ComplexArray, FloatArray]]:
        """Derivatives of `turning_stiffness` with respect to p (n,), at `s` and `speed` (K,): unknown, weight on the
        lines (K,), and matrix (r, r) of every part."""
        v, items = self.unknowns.values(p), self.unknowns.items
        found = []
        for part in self.turning:
            if part.unknown is None:
                continue
            slope = v[part.unknown] if items[part.unknown].positive else items[part.unknown].scale
            found.append((part.unknown, slope * part.weight(s, speed), part.matrix))
        return found

    def derivatives(self, p: FloatArray) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """Unknowns (m,) that change this configuration and dK, dM, dC (m, r, r) at rest with respect to their p."""
        u, r, n = self.unknowns, self.r, len(self.unknowns)
        dK, dM, dC, dS = (np.zeros((n, r, r)) for _ in range(4))
        v = u.values(p)
        touched = {part.unknown for part in self.turning if part.unknown is not None}
        into = {"K": dK, "M": dM, "C": dC}
        for part in self.parts:
            factor = float(np.prod([v[i] ** e for i, e in part.powers]))
            for i, e in part.powers:
                # d ln v / dp = 1 for a positive unknown; a real one enters to the power one
                slope = factor * e if u.items[i].positive else u.items[i].scale * _others(part, i, v)
                into[part.kind][i] += slope * part.matrix
                if part.kind == "K" and part.structural:
                    dS[i] += slope * part.matrix
                touched.add(i)
        _, M, _, S = self._sum(p)
        a, b = u.index(ALPHA), u.index(BETA)
        dC += v[a] * dM + v[b] * dS
        dC[a] += v[a] * M
        dC[b] += v[b] * S
        index = np.array(sorted(touched | {a, b}), dtype=np.int64)
        return index, dK[index], dM[index], dC[index]

    def _sum(self, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        K, M, C, S = (np.zeros((self.r, self.r)) for _ in range(4))
        v = self.unknowns.values(p)
        for part in self.parts:
            own = float(np.prod([v[i] ** e for i, e in part.powers])) * part.matrix
            if part.kind == "K":
                K += own
                S += own if part.structural else 0.0
            elif part.kind == "M":
                M += own
            else:
                C += own
        a, b = v[self.unknowns.index(ALPHA)], v[self.unknowns.index(BETA)]
        return K, M, C + a * M + b * S, S

    def modes(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega (r,) rad/s of the undamped modes and mass-normalised shapes (r, r) in the basis, at `p` (n,)."""
        from scipy.linalg import eigh

        K, M, _ = self.matrices(p)
        lam, phi = eigh(K, M)
        return np.sqrt(np.maximum(lam, 0.0)), phi

    def damped_modes(self, p: FloatArray) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Poles (m,) rad/s with positive imaginary part, by size, and complex shapes (r, m) in the basis, at
        `p` (n,)."""
        K, M, C = self.matrices(p)
        lam, psi = np.linalg.eig(
            np.block([[np.zeros_like(K), np.eye(self.r)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
        )
        keep = np.flatnonzero(lam.imag > 1e-9 * np.abs(lam).max())
        keep = keep[np.argsort(np.abs(lam[keep]))]
        return lam[keep], psi[: self.r, keep]


def _others(part: Part, i: int, v: FloatArray) -> float:
    return float(np.prod([v[j] ** e for j, e in part.powers if j != i]))


def free_model(
    deck: _core.Deck,
    *,
    units: str,
    parameters: Sequence[Parameter],
    added_mass: Sequence[tuple[int, float]] = (),
) -> Model:
    """The deck without any support; errors as of `read_model`."""
    return model_of(deck, units=units, parameters=parameters, spc=0, added_mass=added_mass)


def configure(
    name: str,
    free: Model,
    unknowns: Unknowns,
    terms: Sequence[LinearTerm],
    *,
    spc: int | None,
    added_mass: Sequence[tuple[int, float]] = (),
    f_max: float,
    g_rows: Sequence[int],
    spinning: Sequence[SpinningPart] = (),
) -> ConfiguredModel:
    """The configuration `name` of the deck behind `free`: its SPC set, its masses, and the `terms` that exist in it.

    `g_rows` are DOFs of the g-set whose static response the basis holds (where forces act). The unknowns begin with the
    parameters of the model, and hold those of the terms and of damping by name. The gyroscopic matrix of the parts of
    the deck that are `spinning` follows the parameters to first order, exactly where it is linear in each.
    """
    held = model_of(free.deck, units=free.units, spc=spc)
    own = free if not added_mass else free_model(
        free.deck, units=free.units, parameters=free.parameters, added_mass=added_mass
    )  # fmt: skip
    active = [t for t in terms if t.active(name)]
    fixed = set(held_rows(own, held).tolist()) - {int(i) for t in active for i in t.releases}
    loose = np.array([i for i in range(own.fe.n_a) if i not in fixed], dtype=np.int64)
    T = own.transformation()
    V_a = _basis(own, T, loose, active, f_max, g_rows)
    parts, turning = _parts(own, T, V_a, unknowns, active)
    turning = (*_spinning(own, V_a, unknowns, spinning), *turning)
    return ConfiguredModel(name, own, np.asarray(T @ V_a), parts, unknowns, turning)


def _spinning(
    model: Model, V_a: FloatArray, unknowns: Unknowns, spinning: Sequence[SpinningPart]
) -> tuple[TurningPart, ...]:
    """What the `spinning` parts of the deck add with the speed: as they are, and what each parameter does to that."""
    if not spinning:
        return ()
    ones = np.ones(len(model.parameters))
    indptr, indices = model.fe.assemble()[:2]

    def small(values: FloatArray) -> FloatArray:
        return np.asarray(V_a.T @ (csc_array((values, indices, indptr), shape=(model.fe.n_a,) * 2) @ V_a))

    over = SpeedPower(1, 1.0, signed=True)
    fixed = small(gyroscopic(model, spinning, ones))
    found = []
    for parameter, slope in zip(model.parameters, gyroscopic_slopes(model, spinning, ones), strict=True):
        if slope.any():
            own = small(slope)
            fixed = fixed - own
            found.append(TurningPart("C", own, unknowns.index(parameter.name), over))
    return (TurningPart("C", fixed, None, over), *found)


def _basis(
    model: Model, T: Any, loose: NDArray[np.int64], terms: Sequence[LinearTerm], f_max: float, g_rows: Sequence[int]
) -> FloatArray:
    """Modes with the freed supports soft, as guessed and stiff, what parameters do to them, and static responses to
    forces at `g_rows`."""
    from scipy.sparse.linalg import splu

    K, M = (csc_array(A)[loose][:, loose] for A in model.matrices())
    n = len(loose)
    extra = _stiffness(T, terms, supports=False)[loose][:, loose]
    support = _stiffness(T, terms, supports=True)[loose][:, loose]
    shapes, held, moves = list[FloatArray](), K, np.zeros((n, 0))
    for level in LEVELS if support.nnz else (1.0,):
        system = csc_array(K + extra + level * support)
        omega, phi = _modes(model, system, M, f_max, n)
        shapes.append(phi)
        if level == 1.0:
            patterns = T[sorted(set(g_rows))].T.toarray()[loose]
            moving = forces_of_moves(model, omega, _on_all(model, loose, phi), f_max)[loose]
            held, k = csc_array(system + 1e-9 * _mean(system) * M), patterns.shape[1]
            answers = splu(held).solve(np.ascontiguousarray(np.hstack([patterns, moving])))
            shapes.append(answers[:, :k])
            moves = answers[:, k:]
    vectors = _independent(np.hstack(shapes), M)
    vectors = _independent(np.hstack([vectors, missed(held, vectors, moves)]), M)
    return _on_all(model, loose, vectors)


def _on_all(model: Model, loose: NDArray[np.int64], vectors: FloatArray) -> FloatArray:
    """Vectors (n_a, m) on all independent DOFs of the `model`, nothing on those that are not `loose`."""
    full = np.zeros((model.fe.n_a, vectors.shape[1]))
    full[loose] = vectors
    return full


def _mean(A: Any) -> float:
    return float(np.abs(A.diagonal()).mean())


def _stiffness(T: Any, terms: Sequence[LinearTerm], *, supports: bool) -> csc_array:
    total = csc_array((T.shape[1], T.shape[1]))
    for term in terms:
        if bool(len(term.releases)) is not supports:
            continue
        for part in term.parts:
            at_rest = part.over_speed is None
            if at_rest and part.kind == "K" and part.powers and all(term.unknowns[i].positive for i, _ in part.powers):
                size = term.scale_of(part)
                total = total + size * (T.T @ part.matrix @ T)
    return csc_array(total)


def _modes(model: Model, K: Any, M: Any, f_max: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Circular frequencies (m,) and modes (n, m) up to three times `f_max` (Hz), at least a dozen, of a `model` with
    stiffness `K` and mass `M`."""
    from scipy.linalg import LinAlgError, eigh

    if n <= 400:
        try:
            lam, phi = eigh(K.toarray(), M.toarray() + 1e-12 * _mean(M) * np.eye(n))
        except LinAlgError:
            raise no_solution(model) from None
        m = max(int((lam < (2 * np.pi * MODES_ABOVE * f_max) ** 2).sum()), min(FEWEST_MODES, n))
        return np.sqrt(np.maximum(lam[:m], 0.0)), np.asarray(phi[:, :m])
    try:
        freq, phi, _, _ = _core_modes(K, M, MODES_ABOVE * f_max)
    except ModelError as error:
        raise told_of(error, model) from error
    if len(freq) < FEWEST_MODES:
        freq, phi, _, _ = _core_modes(K, M, None, FEWEST_MODES)
    return 2 * np.pi * np.asarray(freq), np.asarray(phi)


def _independent(vectors: FloatArray, M: Any) -> FloatArray:
    """M-orthonormal basis of the columns; those nearly dependent on earlier ones are dropped."""
    V = np.zeros((vectors.shape[0], 0))
    for column in vectors.T:
        size = np.sqrt(max(column @ (M @ column), 0.0))
        if size == 0.0:
            continue
        v = column / size
        for _ in range(2):
            v = v - V @ (V.T @ (M @ v))
        left = np.sqrt(max(v @ (M @ v), 0.0))
        if left > INDEPENDENT:
            V = np.hstack([V, (v / left)[:, None]])
    return V


def _parts(
    model: Model, T: Any, V_a: FloatArray, unknowns: Unknowns, terms: Sequence[LinearTerm]
) -> tuple[tuple[Part, ...], tuple[TurningPart, ...]]:
    """Parts at rest, and those that act with the speed."""
    ones = np.ones(len(model.parameters))
    K, M, C = (np.asarray(A) for A in model.fe.project(ones, np.ascontiguousarray(V_a))[0][:3])
    K_fixed, M_fixed, C_fixed = K.copy(), M.copy(), C
    parts: list[Part] = []
    for i, parameter in enumerate(model.parameters):
        at = unknowns.index(parameter.name)
        for degree, (dK, dM) in _polynomial(model, V_a, ones, i, K, M).items():
            K_fixed, M_fixed = K_fixed - dK, M_fixed - dM
            for kind, matrix in (("K", dK), ("M", dM)):
                if matrix.any():
                    parts.append(Part(kind, matrix, ((at, float(degree)),), True))
        if is_of_damping(parameter):
            double = ones + np.eye(len(ones))[i]
            dC = np.asarray(model.fe.project(double, np.ascontiguousarray(V_a))[0][2]) - C
            if dC.any():
                parts.append(Part("C", dC, ((at, 1.0),), True))
                C_fixed = C_fixed - dC
    parts += [Part("K", K_fixed, (), True), Part("M", M_fixed, (), True)]
    if C_fixed.any():
        parts.append(Part("C", C_fixed, (), True))
    V = T @ V_a
    turning: list[TurningPart] = []
    for term in terms:
        own = [unknowns.index(u.name) for u in term.unknowns]
        for part in term.parts:
            matrix = np.asarray(V.T @ (part.matrix @ V))
            powers = tuple((own[i], float(e)) for i, e in part.powers)
            if part.over_speed is not None:
                turning.append(TurningPart(part.kind, matrix, powers[0][0], part.over_speed))
            else:
                parts.append(Part(part.kind, matrix, powers, term.structural))
    return tuple(parts), tuple(turning)
