"""FRFs from complex modes, with what the modes left out contribute."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.analysis.complex_modes import ComplexSolver
from femend.analysis.ends import PER_FORCE, dofs_of, unit_forces
from femend.analysis.turning import TurningSystem, as_turning_system
from femend.data.channel import Channel
from femend.data.complex_modes import ComplexModes
from femend.data.frf import FRF
from femend.dof import Dof
from femend.errors import ConvergenceError, PairingError
from femend.model import Model
from femend.model.terms.spinning import SpinningPart

__all__ = ["complex_frf", "complex_receptance"]

_POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}
DEFECTIVE = 1e6  # condition from which a modal a has lost too many digits
# share of the receptances at two ends below which that between them counts as none
OWN = 1e-2
NODES = (5, 9, 17, 33, 65)  # lines at which the modes left out are solved for, more until the tolerance is met

Complex = NDArray[np.complex128]


def complex_receptance(modes: ComplexModes, s: ArrayLike, out: Sequence[Dof], into: Sequence[Dof]) -> Complex:
    """Receptances (n_s, n_out, n_in) at the complex `s` (n_s,) in rad/s from the `modes` alone, in signed DOFs
    `out`, `into`.

    H = sum over poles of psi y^T / (a (s - pole)), conjugate poles included: those of structural damping are the
    `mirrored` ones. Rigid-body modes are left out. Ewins, Modal Testing, 2000, chapter 2 (general viscous damping),
    with left vectors as in Lancaster, Lambda-Matrices and Vibrating Systems, 1966. Raises PairingError for a DOF that
    the modes do not have, ConvergenceError for a defective pair of poles, whose modal a is 0.

    >>> from femend.data import ModeSet
    >>> from femend.data.complex_modes import PoleSet
    >>> none = PoleSet([], np.zeros((1, 0)), np.zeros((1, 0)), [], [])
    >>> one = ComplexModes(ModeSet([1 / (2 * np.pi)], [0.0], [[1.0 + 0j]], (Dof(1, 3),)), [1j], [[1.0]], [2j], [0.0],
    ...                    [0.0], [1.0], none, none)
    >>> complex_receptance(one, [0.5j], [Dof(1, 3)], [Dof(1, 3)])[0, 0, 0].round(6)  # 1 / (1 - 0.25)
    np.complex128(1.333333+0j)
    """
    lines = np.asarray(s, dtype=np.complex128)
    rows_out, sign_out = _rows(modes, out)
    rows_in, sign_in = _rows(modes, into)
    flexible = modes.poles != 0
    worst = int(np.argmax(np.where(flexible, modes.condition, 0.0))) if flexible.any() else 0
    if flexible.any() and modes.condition[worst] > DEFECTIVE:
        pole = modes.poles[worst]
        raise ConvergenceError(
            f"mode {worst + 1} ({abs(pole) / (2 * np.pi):.5g} Hz, zeta {-pole.real / abs(pole):.5g}) is defective: "
            f"its condition is {modes.condition[worst]:.1e}, its modal a is lost; change a damper by 1e-6 of it, or "
            "solve directly"
        )
    right, left = np.asarray(modes.modes.phi)[:, flexible], modes.left[:, flexible]
    sets = [(modes.poles[flexible], right, left, modes.modal_a[flexible])]
    others = (modes.mirrored, modes.overdamped) if modes.mirrored.n_poles else (modes.overdamped,)
    if not modes.mirrored.n_poles:
        sets.append(tuple(np.conj(a) for a in sets[0]))  # type: ignore[arg-type]
    sets += [(p.poles, p.right, p.left, p.modal_a) for p in others]
    H = np.zeros((lines.size, len(out), len(into)), dtype=np.complex128)
    for poles, psi, y, a in sets:
        share = 1.0 / (a * (lines[:, None] - poles))
        H += np.einsum("om,sm,im->soi", psi[rows_out] * sign_out[:, None], share, y[rows_in] * sign_in[:, None])
    return H


def _rows(modes: ComplexModes, dofs: Sequence[Dof]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Rows of the shapes, and signs."""
    row = {(dof.node, dof.component): (i, dof.sign) for i, dof in enumerate(modes.modes.dofs)}
    missing = [str(dof) for dof in dofs if (dof.node, dof.component) not in row]
    if missing:
        raise PairingError(f"the modes have no DOF {', '.join(missing[:8])}; pair the sensor with a DOF of the model")
    found = [(*row[dof.node, dof.component], dof.sign) for dof in dofs]
    return np.array([f[0] for f in found], dtype=np.int64), np.array([float(f[1] * f[2]) for f in found])


def complex_frf(
    system: Model | TurningSystem,
    freq: ArrayLike,
    outputs: Sequence[Channel],
    inputs: Sequence[Channel],
    *,
    n_modes: int | None = None,
    f_max: float | None = None,
    speed: float = 0.0,
    parts: Sequence[SpinningPart] = (),
    preload: Mapping[Dof, float] | None = None,
    factors: Mapping[str, float] | None = None,
    kind: str = "accelerance",
    tolerance: float = 1e-6,
    unit: str | None = None,
    name: str = "model",
) -> FRF:
    """FRFs (n_freq, n_out, n_in) at the rising `freq` (n_freq,) in Hz from complex modes and what those left out
    contribute.

    `system`, `speed`, `parts`, `preload`, `factors` as in `complex_modes`; the modes are the lowest `n_modes`, or
    those up to `f_max` in Hz (1.2 times the last line by default). `outputs` and `inputs` are channels with DOFs,
    `kind` receptance, mobility or accelerance, `unit` the unit of H (SI if not given), `name` its name.

    What is left out is the whole model's response less the modes' own at a few lines, solved in the space of the modes
    enlarged until ||f - D(s) u|| <= `tolerance` / 100 ||f||, and interpolated over the band (Chebyshev points; it is
    smooth where its poles lie beyond the band; times s^2 for a free model). Lines are added until interpolation
    misses at most `tolerance` of the largest receptance between two of them (of those at the ends themselves, where
    these hardly know of each other).

    Raises ValueError for lines that are not positive and rising, a channel without DOF or an unknown kind;
    PairingError for a DOF that is not there; ConvergenceError for defective poles or where the tolerance is not
    reached; and what `complex_modes` raises.

    >>> from scipy.sparse import csc_array
    >>> one = csc_array([[1.0]])
    >>> place = [Channel(Dof(1, 3), "acceleration", "m/s^2")]
    >>> system = TurningSystem(one, 100 * one, (Dof(1, 3),), C=2 * one)
    >>> H = complex_frf(system, [5 / np.pi], place, place, n_modes=1, kind="receptance").H  # at resonance, 1 / (i w c)
    >>> abs(H[0, 0, 0].round(9)) == 0.05
    np.True_
    """
    lines, out, into = _checked(freq, outputs, inputs, kind)
    system = as_turning_system(system, parts, preload, factors)
    if n_modes is None and f_max is None:
        f_max = 1.2 * float(lines[-1])
    solver = ComplexSolver(system, n_modes=n_modes, f_max=f_max, speed=speed, left_tolerance=1e-8)
    modes = solver.solve(speed)
    H = complex_receptance(modes, 2j * np.pi * lines, out, into)
    H += _left_out(solver, modes, lines, out, into, tolerance)
    s = 2j * np.pi * lines[:, None, None]
    return FRF(name, lines, H * s ** _POWER[kind], tuple(outputs), tuple(inputs), kind, unit or PER_FORCE[kind])


def _checked(
    freq: ArrayLike, outputs: Sequence[Channel], inputs: Sequence[Channel], kind: str
) -> tuple[NDArray[np.float64], list[Dof], list[Dof]]:
    """The lines and the DOFs of both sides, or ValueError."""
    lines = np.asarray(freq, dtype=np.float64)
    if lines.ndim != 1 or lines.size == 0 or not np.all(np.diff(lines) > 0) or not lines[0] >= 0:
        raise ValueError(f"freq of shape {lines.shape} must be rising lines in Hz, none negative")
    if kind not in PER_FORCE:
        raise ValueError(f"FRF kind {kind!r} is unknown; use {', '.join(PER_FORCE)}")
    return lines, dofs_of(outputs), dofs_of(inputs)


def _left_out(
    solver: ComplexSolver,
    modes: ComplexModes,
    lines: NDArray[np.float64],
    out: Sequence[Dof],
    into: Sequence[Dof],
    tolerance: float,
) -> Complex:
    """Receptances (n_freq, n_out, n_in) at `lines` in Hz of what the `modes` leave out, from few of them."""
    b_out, b_in = _patterns(solver, out), _patterns(solver, into)
    free = bool(np.any(modes.poles == 0))

    def rest(s: Complex) -> tuple[Complex, float]:
        """What the modes do not tell at `s`, and the largest receptance."""
        whole = solver.receptance(b_out, b_in, s, modes.speed, 1e-2 * tolerance)
        missing = whole - complex_receptance(modes, s, out, into)
        return (missing * s[:, None, None] ** 2 if free else missing), float(np.max(np.abs(whole)))

    def own(s: Complex) -> float:
        """The receptance at the ends themselves: of ends that hardly know of each other, as two planes of one beam,
        the largest between them is rounding."""
        ends = [solver.receptance(b, b, s, modes.speed, 1e-2 * tolerance) for b in (b_out, b_in)]
        return float(np.sqrt(np.prod([np.max(np.abs(H)) for H in ends])))

    return _interpolated(rest, own, lines, tolerance, free)


def _patterns(solver: ComplexSolver, dofs: Sequence[Dof]) -> NDArray[np.float64]:
    """Unit forces at signed DOFs, as columns over the rows of the system."""
    advice = "pair the sensor with a DOF of the model"
    return solver.to_system(unit_forces(solver.dofs, dofs, "the model has", advice))


def _interpolated(
    value: Callable[[Complex], tuple[Complex, float]],
    own: Callable[[Complex], float],
    freq: NDArray[np.float64],
    tolerance: float,
    free: bool,
) -> Complex:
    """A smooth function of the lines `freq` from its `value` at few of them; `own` is the size at both ends."""
    from scipy.interpolate import BarycentricInterpolator

    lo, hi = float(freq[0]), float(freq[-1])
    if freq.size <= NODES[0]:
        found = value(np.asarray(2j * np.pi * freq, dtype=np.complex128))[0]
        return found / (2j * np.pi * freq[:, None, None]) ** 2 if free else found
    miss, off, before = np.inf, np.inf, None
    for n in NODES:
        nodes = 0.5 * (lo + hi) - 0.5 * (hi - lo) * np.cos((np.arange(n) + 0.5) * np.pi / n)
        rest, largest = value(np.asarray(2j * np.pi * nodes, dtype=np.complex128))
        curve = BarycentricInterpolator((nodes - lo) / (hi - lo), rest)
        found = np.asarray(curve((freq - lo) / (hi - lo)))
        if free:
            found = found / (2j * np.pi * freq[:, None, None]) ** 2
        if before is not None:
            off = float(np.max(np.abs(found - before)))
            if off <= tolerance * largest:  # both are 0 where all outputs or all inputs are held
                return found
            miss = off / largest if largest > 0 else np.inf
        before = found
    if off <= OWN * tolerance * own(np.asarray(2j * np.pi * freq[-1:], dtype=np.complex128)):
        return found
    raise ConvergenceError(
        f"what the modes leave out misses {miss:.1e} of the largest receptance between {NODES[-1]} lines "
        f"(asked {tolerance:.1e}); take more modes, or the band in parts"
    )
