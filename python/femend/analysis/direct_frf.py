"""FRFs solved directly, without modes: any damping, stiffness that depends on the frequency."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.analysis.ends import PER_FORCE, dofs_of, unit_forces
from femend.data.channel import Channel
from femend.data.frf import FRF
from femend.dof import Dof
from femend.errors import ModelError, SingularModelError
from femend.model import Model
from femend.model.reduced.one_pattern import on_one_pattern

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["DirectFrf", "direct_frf", "reduced_frf"]

LINEAR = 1e-9
"""Relative change of a derivative up to which it counts as constant."""

FloatArray = NDArray[np.float64]
Law = Callable[[FloatArray], ArrayLike] | ArrayLike


@dataclass(frozen=True, slots=True, eq=False)
class DirectFrf:
    """FRFs by reduced direct solution, with the evidence that they are right.

    `frf` holds H (n_freq, n_out, n_in). `error` is the true error beside the largest magnitude of the line, measured on
    the lines that joined last before they were solved themselves, those of largest residual; `residual` the largest
    |F - Z X| / |F| over all lines, afterwards. `solved` are the lines in Hz that were solved directly, in the order in
    which they were, `n_basis` the size of the space in which all others are. `converged` tells whether `error` is
    within the tolerance; where it is not, `advice` says what to do.
    """

    frf: FRF
    converged: bool
    error: float
    residual: float
    solved: FloatArray
    n_basis: int
    advice: str = ""


def reduced_frf(
    terms: Sequence[tuple[csc_array, ArrayLike]],
    dofs: Sequence[Dof],
    freq: ArrayLike,
    outputs: Sequence[Channel],
    inputs: Sequence[Channel],
    *,
    kind: str = "accelerance",
    tolerance: float = 1e-6,
    max_solutions: int = 60,
    unit: str | None = None,
    name: str = "model",
) -> DirectFrf:
    """FRFs (n_freq, n_out, n_in) at `freq` (n_freq,) in Hz of Z(s) = sum c_t(s) A_t, s = 2 pi i freq.

    `terms` are real symmetric sparse A_t (n, n), the first one the stiffness, each with its coefficient c_t, a number
    or one for each line (n_freq,), complex: 1 for K, s for viscous and 1j for structural damping, s^2 for M, any
    function of the line for what depends on the frequency. `dofs` (n,) names the rows; `outputs` and `inputs` are
    channels with DOFs among them. `kind`, `unit` (SI if not given) and `name` are those of the FRF.

    Some lines are solved directly, all others in the space of those solutions and of their slopes along the frequency
    axis (rational Krylov; Beattie and Gugercin, Systems & Control Letters 58 (2009) 225). Lines join where the true
    residual is largest, at most `max_solutions`, until what they add is an error of `tolerance` of the largest
    magnitude on a line. That this was not reached is told by `converged`, not raised.

    Raises ValueError for coefficients or lines that do not fit, a channel without DOF or an unknown kind; PairingError
    for a DOF that is not there; SingularModelError naming DOFs where Z has no inverse on a line that is solved;
    MemoryLimitError for a factor that does not fit.

    >>> from scipy.sparse import csc_array
    >>> one = csc_array([[1.0]])
    >>> place = [Channel(Dof(1, 3), "displacement", "m")]
    >>> s = 2j * np.pi * np.array([1.0, 2.0])
    >>> found = reduced_frf([(9e3 * one, 1 + 0.1j), (one, s**2)], [Dof(1, 3)], [1.0, 2.0], place, place,
    ...                     kind="receptance")
    >>> bool(np.allclose(found.frf.H[:, 0, 0], 1 / (9e3 * (1 + 0.1j) + s**2), rtol=1e-12))
    True
    """
    lines = np.asarray(freq, dtype=np.float64)
    given = ("the matrices have", f"give one of the {len(dofs)} rows")
    ends = (unit_forces(dofs, dofs_of(outputs), *given), unit_forces(dofs, dofs_of(inputs), *given))
    coefficients = [_on_lines(c, lines, f"matrix {t}") for t, (_, c) in enumerate(terms)]
    indptr, indices, values = on_one_pattern([a for a, _ in terms])
    return _solved(
        (indptr, indices, np.array(values)),
        np.array(coefficients),
        ends,
        FRF(name, lines, _zeros(lines, outputs, inputs), tuple(outputs), tuple(inputs), kind, unit or _unit(kind)),
        [str(d) for d in dofs],
        tolerance,
        max_solutions,
    )


def direct_frf(
    model: Model,
    freq: ArrayLike,
    outputs: Sequence[Channel],
    inputs: Sequence[Channel],
    *,
    laws: Mapping[str, Law] | None = None,
    factors: Mapping[str, float] | None = None,
    kind: str = "accelerance",
    tolerance: float = 1e-6,
    max_solutions: int = 60,
    unit: str | None = None,
    name: str = "model",
) -> DirectFrf:
    """FRFs (n_freq, n_out, n_in) of a `model` at `freq` (n_freq,) in Hz, solved directly with all of its damping.

    Dashpots, loss factors (GE) and direct matrices of the deck act as they stand, however local they are. `laws` makes
    stiffness depend on the frequency: the name of a parameter of the model (a modulus E or G, a spring's k1 to k6) and
    the complex factor on the deck's value, one for each line (n_freq,) or a function of the lines in Hz. A law stands
    for the whole complex modulus of its elements: their own loss factor is left out. `factors` are factors on other
    parameters by name. `outputs` and `inputs` are channels with DOFs in the nodes' displacement frames; `kind`,
    `tolerance`, `max_solutions`, `unit` and `name` as in `reduced_frf`, whose method it is.

    Raises ModelError for a law on what is no parameter, or on one that is not a plain factor on a part of the
    stiffness (a thickness, a density, elements that two laws share); PairingError for a node that is not there; and
    what `reduced_frf` raises.

    A rubber whose modulus doubles with the frequency, about 160 Hz (standard linear solid, 1 ms):

    >>> rubber = lambda f: 1 + 2j * np.pi * f * 1e-3 / (1 + 2j * np.pi * f * 1e-3)
    >>> direct_frf(model, freq, outputs, inputs, laws={"E rubber": rubber})  # doctest: +SKIP
    """
    lines = np.asarray(freq, dtype=np.float64)
    ends = (_forces(model, outputs), _forces(model, inputs))
    named = FRF(name, lines, _zeros(lines, outputs, inputs), tuple(outputs), tuple(inputs), kind, unit or _unit(kind))
    at = model.factors(factors)
    indptr, indices, K, M, C, H = model.fe.assemble(at)
    s = 2j * np.pi * lines
    one = np.ones(lines.size, dtype=np.complex128)
    parts = [(K, one), (M, s**2), (C, s), (H, 1j * one)]
    for law, (stiffness, loss) in _parts(model, at, list(laws or {})).items():
        factor = _on_lines((laws or {})[law], lines, f"the law on {law!r}")
        parts += [(stiffness, factor - 1.0), (loss, -1j * one)]
    kept = [(values, c) for values, c in parts if np.any(values)]
    rows = [f"{n}:{c}" for n, c in zip(model.fe.dof_nodes.tolist(), model.fe.dof_components.tolist(), strict=True)]
    matrices = (indptr, indices, np.array([values for values, _ in kept]))
    return _solved(matrices, np.array([c for _, c in kept]), ends, named, rows, tolerance, max_solutions)


def _solved(
    matrices: tuple[Any, Any, FloatArray],
    coefficients: NDArray[np.complex128],
    ends: tuple[FloatArray, FloatArray],
    named: FRF,
    rows: Sequence[str],
    tolerance: float,
    max_solutions: int,
) -> DirectFrf:
    """The core's answer as labelled data; `named` holds all but the values of H."""
    s = np.asarray(2j * np.pi * named.freq, dtype=np.complex128)
    limits: dict[str, Any] = {"tolerance": tolerance, "max_solutions": max_solutions}
    try:
        H, told = _core.frf_reduced(*matrices, coefficients, ends[0], ends[1], s, named.kind, **limits)
    except SingularModelError as error:
        moving = tuple(rows[int(row)] for row in error.dofs)
        raise SingularModelError(
            f"the dynamic stiffness has no inverse on a line: {', '.join(moving[:12])} move without resistance; leave "
            "out the line (0 Hz of a free model), constrain them or give them damping",
            dofs=moving,
        ) from error
    advice = ""
    if not told["converged"]:
        advice = (
            f"{len(told['solved'])} lines solved leave an error of {told['error']:.1e} of the largest magnitude and "
            f"a residual of {told['residual']:.1e} (asked {tolerance:.1e}); raise max_solutions, or take the band in "
            "parts"
        )
    frf = FRF(named.name, named.freq, H, named.outputs, named.inputs, named.kind, named.unit)
    solved = named.freq[np.asarray(told["solved"], dtype=np.int64)]
    return DirectFrf(frf, told["converged"], told["error"], told["residual"], solved, told["basis"], advice)


def _parts(model: Model, at: FloatArray, laws: Sequence[str]) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Stiffness and structural damping that each of `laws` multiplies at the factors `at`."""
    model.factors(dict.fromkeys(laws, 1.0))
    places = {p.name: i for i, p in enumerate(model.parameters)}
    # a stiffness that is linear in every law has derivatives that no law changes
    halved = at.copy()
    halved[[places[law] for law in laws]] *= 0.5
    out = {}
    for law in laws:
        i = places[law]
        dK, dM, dC, dH = model.fe.derivative(i, at)
        other = model.fe.derivative(i, halved)[0]
        reason = ""
        if not np.any(dK):
            reason = "it has no part in the stiffness"
        elif np.any(dM) or np.any(dC):
            reason = "it changes mass or dashpots too"
        elif np.abs(other - dK).max() > LINEAR * np.abs(dK).max():
            reason = "its part of the stiffness is no plain multiple of it, or belongs to another law too"
        if reason:
            prop = model.parameters[i].property
            raise ModelError(
                f"no law can stand for parameter {law!r} ({prop}): {reason}; take a modulus (E, G) or a spring's "
                "stiffness (k1 to k6), each element in one law"
            )
        out[law] = (at[i] * dK, at[i] * dH)
    return out


def _on_lines(value: Law, lines: FloatArray, what: str) -> NDArray[np.complex128]:
    """One complex number for each line."""
    given = np.asarray(value(lines) if callable(value) else value, dtype=np.complex128)
    if given.shape not in ((), lines.shape):
        raise ValueError(f"{what} has coefficients of shape {given.shape} for {lines.size} lines; give one for each")
    if not np.isfinite(given).all():
        line = int(np.flatnonzero(~np.isfinite(np.broadcast_to(given, lines.shape)))[0])
        raise ValueError(f"{what} is not a number at {lines[line]:.6g} Hz; leave the line out or correct the law")
    return np.broadcast_to(given, lines.shape).copy()


def _zeros(lines: FloatArray, outputs: Sequence[Channel], inputs: Sequence[Channel]) -> NDArray[np.complex128]:
    """H before it is known, so that lines, channels and kind are checked before anything is solved."""
    return np.zeros((lines.size, len(outputs), len(inputs)), dtype=np.complex128)


def _unit(kind: str) -> str:
    """SI unit of H; that of another kind is refused by the FRF."""
    return PER_FORCE.get(kind, "")


def _forces(model: Model, channels: Sequence[Channel]) -> FloatArray:
    """Unit forces at signed DOFs of nodes, as columns over the a-set; nothing where a DOF is held."""
    wanted = dofs_of(channels)
    rows = model.transformation().tocsr()[[model.row(d) for d in wanted]]
    return np.ascontiguousarray(rows.toarray().T * np.array([float(d.sign) for d in wanted]))
