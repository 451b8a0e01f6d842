"""One run's operating shapes against the model: its peaks with the modes, all lines with the response to unbalance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from femend.analysis.frf import modal_frf
from femend.analysis.model_modes import model_modes
from femend.analysis.turning_modal_frf import modal_gyroscopic, turning_modal_frf
from femend.bench.reading.models import modes_up_to
from femend.bench.reading.runs import MeasuredRun
from femend.correlate import ModeComparison, compare_modes, csac, csf, dac
from femend.data import Channel, ModeSet
from femend.dof import Dof
from femend.estimate.joint import Unbalance
from femend.model import Model
from femend.model.cards.near_ids import near_ids
from femend.model.terms.spinning import SpinningPart
from femend.numerals import plain

__all__ = ["ComparedRun", "OperatingResponse", "compare_run"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# the model's response is superposed from modes up to this multiple of the run's highest line, as FRFs are
ABOVE = 3.0
# points at which a line's width is averaged over (Gauss and Legendre)
POINTS = 7
# powers of the speed with which forces of another order than 1 may grow, and the fewest lines that tell them apart
POWERS = tuple(0.25 * i for i in range(17))
FEWEST_FOR_POWER = 3


@dataclass(frozen=True, eq=False)
class OperatingResponse:
    """What forces at the bearings `nodes` make of the model, beside what was measured.

    Of order 1 they are those of unbalance: `unbalance` (n_bearings,) are m r exp(i phase) against the tacho's angle 0,
    in mass times length of the model, turning in the `sense` (+1 about the shaft's axis by the right hand); they are
    those of the study where it knows them (`known`, at the `nodes` that it says). Of another
    order nothing says how they turn: `forces` (n_bearings, 2), complex amplitudes along e_u and e_v (`Unbalance.plane`)
    at the run's highest line, grow with the speed to the `power`; sense is 0 then. Sizes that are not known are chosen
    so that the responses agree best (see `compare_run`). `shapes` (n_lines, n_dof) are accelerations per unit course at
    the run's lines and sensors, in the sensors' directions; `csac`, `csf` (n_lines,) compare line with line, `dac`
    (n_lines, n_lines) every measured line with every line of the model. `level` (n_lines,) is the length of the model's
    shape over the measured one's, `phase` (n_lines,) by how much it is ahead, rad, over all sensors. `spin` is the
    sense in which the shaft turns, +1 or -1, where the model depends on it, else 0.
    """

    nodes: tuple[int, ...]
    sense: int
    unbalance: ComplexArray
    shapes: ComplexArray
    csac: FloatArray
    csf: FloatArray
    dac: FloatArray
    level: FloatArray
    phase: FloatArray
    forces: ComplexArray | None = None
    power: float = 2.0
    known: bool = False
    spin: int = 0

    def likest(self, line: int) -> int:
        """The line of the model whose response is likest to the measured one at `line`."""
        return int(np.argmax(np.nan_to_num(self.dac[line])))


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """The operating shapes of a run, `measured`, against the model in its configuration.

    `modes` are the model's up to one and a half times the run's highest line. `comparison` pairs the shapes at the
    peaks, in their order, with them; None where the run has no peak. `response` is None where the model has none, and
    `why` says why.
    """

    measured: MeasuredRun
    modes: ModeSet
    comparison: ModeComparison | None
    response: OperatingResponse | None
    why: str = ""

    @property
    def n_pairs(self) -> int:
        """Number of peaks whose shape is that of a mode of the model."""
        return 0 if self.comparison is None else len(self.comparison.pairing.pairs)


def compare_run(
    measured: MeasuredRun,
    model: Model,
    places: dict[Dof, Dof],
    *,
    zeta: float,
    mac_min: float = 0.5,
    factors: Mapping[str, float] | None = None,
    parts: Sequence[SpinningPart] = (),
) -> ComparedRun:
    """Compares the operating shapes of a `measured` run with the `model`, whose modes have the damping ratio `zeta`, at
    `factors` of its parameters and amplitudes of its morphs by name. Its `parts` turn at the speed of every line,
    positive about the run's axis by the right hand; modes compared with the shapes at the peaks are those at rest.

    `places` has the model's DOF of each sensor, `mac_min` is as in `pair_modes`. At each peak the shape, complex as it
    is, is paired with a mode. Over all lines it is compared with the response to unbalance at the bearings, whose
    sizes and phases nobody measured: in either sense of rotation those are taken under which the cross signature scale
    factor (Dascotte and Strobbe 1999), with the phase counting, is largest on average over the lines,

        sum over lines of |y - H u|^2 / (|y|^2 + |H u|^2) = least,

    so that no line counts more for being loud, nor less where the model's resonances are elsewhere. An unbalance that
    the study knows is taken as it is, and so is the sense. Of another order than 1 the forces across the shaft are free
    at every bearing, and so is the power of the speed with which they grow, in quarters from 0 to 4, where there are
    three lines. Where the lines hold no more values than free forces have, there is no response. Raises what
    `model_modes` and `compare_modes` raise.
    """
    top = float(measured.freq[-1])
    modes = modes_up_to(model, top, 1, zeta, factors)
    comparison = None
    if measured.peaks.size:
        freq = measured.peak_freq
        test = ModeSet(freq, np.zeros(freq.size), measured.shapes[measured.peaks].T, measured.dofs, "unscaled")
        comparison = compare_modes(test, modes, places=places, mac_min=mac_min)
    why = _without_response(measured, model)
    if why:
        return ComparedRun(measured, modes, comparison, None, why)
    every = model_modes(model, f_max=ABOVE * top, zeta=zeta, factors=factors)
    if not every.n_modes:
        why = (
            f"recording {measured.name!r}: its lines end at {plain(top)} Hz, and the model has no mode up to "
            f"{ABOVE:g} times that, so that its response is not compared; check the time axis (a column that counts "
            "milliseconds is called 'time [ms]') and the sampling"
        )
        return ComparedRun(measured, modes, comparison, None, why)
    turning = modal_gyroscopic(model, every, parts, factors) if parts else None
    response = _response(measured, _Moved(every, turning, places))
    if response is None:
        why = f"recording {measured.name!r}: forces at {_listed(_loaded(measured))} move no sensor of the model"
        return ComparedRun(measured, modes, comparison, None, why)
    return ComparedRun(measured, modes, comparison, response)


def _loaded(measured: MeasuredRun) -> tuple[int, ...]:
    """The nodes at which forces act: those of the unbalance where it is known, else the bearings."""
    return tuple(n for n, _ in measured.unbalance) or measured.nodes


def _without_response(measured: MeasuredRun, model: Model) -> str:
    """Why the model's response cannot be compared; nothing where it can."""
    who, nodes = f"recording {measured.name!r}", _loaded(measured)
    lacking = [n for n in nodes if n not in set(model.node_ids.tolist())]
    if lacking:
        what = "unbalance node" if measured.unbalance else "bearing node"
        rest = "the shapes at the peaks are compared with the modes alone"
        return (
            f"{who}: {what} {lacking[0]} of [recording.rotating] is not among the {len(model.node_ids)} nodes of the "
            f"model ({near_ids(lacking[0], model.node_ids)}), so that its response to unbalance is "
            f"not known{'' if measured.held else f'; {rest}'}"
        )
    n_free = len(nodes) * (1 if measured.order == 1.0 else 2)
    if not measured.unbalance and measured.shapes.size <= n_free:
        return (
            f"{who}: {measured.shapes.size} measured amplitudes are followed by the {n_free} of the forces at "
            f"{_listed(nodes)} whatever the model is, so that its response is not compared; add sensors, or recordings "
            "at other speeds, or say the unbalance"
        )
    return ""


@dataclass(frozen=True, eq=False)
class _Moved:
    """What forces move: `modes` of the model, its gyroscopic matrix between them where parts turn, and the model's DOF
    of each sensor."""

    modes: ModeSet
    G: FloatArray | None
    places: dict[Dof, Dof]


def _response(measured: MeasuredRun, moved: _Moved) -> OperatingResponse | None:
    nodes = _loaded(measured)
    senses = (measured.sense,) if measured.sense else (1, -1)
    across = {senses[0]: _per_force(measured, nodes, moved, senses[0])}
    if not np.abs(across[senses[0]]).any():
        return None
    for sense in senses[1:]:
        across[sense] = across[senses[0]] if moved.G is None else _per_force(measured, nodes, moved, sense)
    if measured.order != 1.0:
        spins = senses if moved.G is not None else (0,)
        found = [_response_of_order(measured, across.get(s, across[senses[0]]), s) for s in spins]
        return min(found, key=lambda f: f[0])[1]
    Y = measured.shapes
    known = np.array([u for _, u in measured.unbalance], dtype=np.complex128)
    fits = []
    for sense in senses:
        # the sine course is -i times the cosine course at positive frequencies
        H = across[sense][..., 0] - 1j * sense * across[sense][..., 1]
        left, u = (_left(H, Y, known), known) if known.size else _fitted(H, Y)
        fits.append((left, sense, u, np.asarray(H @ u)))
    _, sense, u, shapes = min(fits, key=lambda fit: fit[0])
    spin = 0 if moved.G is None else sense
    return OperatingResponse(nodes, sense, u, shapes, *_agreement(Y, shapes), known=bool(known.size), spin=spin)


def _left(H: ComplexArray, Y: ComplexArray, u: ComplexArray) -> float:
    """What `_fitted` makes least, at the forces `u`."""
    z = H @ u
    size = (np.abs(Y) ** 2).sum(axis=1) + (np.abs(z) ** 2).sum(axis=1)
    return float(((np.abs(Y - z) ** 2).sum(axis=1) / np.maximum(size, 1e-300)).sum())


def _response_of_order(measured: MeasuredRun, across: ComplexArray, spin: int) -> tuple[float, OperatingResponse]:
    """The response to forces that are free across the shaft, which turns in the sense `spin`, and what it leaves."""
    Y, K = measured.shapes, measured.freq.size
    H = across.reshape(K, Y.shape[1], -1)
    grown = np.log(measured.freq / measured.freq[-1])
    # one or two lines are met by any growth of forces that are free anyway
    powers = POWERS if K >= FEWEST_FOR_POWER else (2.0,)
    fits = []
    for power in powers:
        left, u = _fitted(H * np.exp((power - 2.0) * grown)[:, None, None], Y)
        fits.append((left, power, u))
    left, power, u = min(fits, key=lambda fit: fit[0])
    shapes = np.asarray((H * np.exp((power - 2.0) * grown)[:, None, None]) @ u)
    nothing, course = np.zeros(0, dtype=np.complex128), (2 * np.pi * float(measured.freq[-1])) ** 2
    forces = course * u.reshape(-1, 2)
    told = _agreement(Y, shapes)
    return left, OperatingResponse(measured.nodes, 0, nothing, shapes, *told, forces=forces, power=power, spin=spin)


def _agreement(
    Y: ComplexArray, shapes: ComplexArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """CSAC, CSF (n_lines,), DAC (n_lines, n_lines), level and phase (n_lines,) of shapes (n_lines, n_dof)."""
    a, b = Y[:, :, None], shapes[:, :, None]
    level = np.linalg.norm(shapes, axis=1) / np.maximum(np.linalg.norm(Y, axis=1), 1e-300)
    phase = np.angle(np.einsum("ki,ki->k", Y.conj(), shapes))
    return csac(a, b), csf(a, b), dac(Y.T, shapes.T), level, phase


def _per_force(measured: MeasuredRun, nodes: tuple[int, ...], moved: _Moved, sense: int) -> ComplexArray:
    """Accelerations (n_lines, n_dof, n_nodes, 2) per unit course to a unit force along e_u and e_v at every node, of a
    shaft that turns in the `sense`.

    They are averaged over the width of a line as the measured ones are, since a resonance may be narrower than that.
    """
    plane = Unbalance(nodes, measured.axis).plane
    outputs, inputs = [moved.places[d] for d in measured.dofs], [Dof(n, c + 1) for n in nodes for c in plane]
    x, weight = np.polynomial.legendre.leggauss(POINTS) if measured.width > 0 else (np.zeros(1), np.full(1, 2.0))
    total = np.zeros((measured.freq.size, len(outputs), len(inputs)), dtype=np.complex128)
    for at, share in zip(x, 0.5 * weight, strict=True):
        total += share * _accelerance(
            moved, measured.freq + 0.5 * measured.width * at, sense / measured.order, outputs, inputs
        )
    return np.asarray(total.reshape(measured.freq.size, len(outputs), -1, 2))


def _accelerance(
    moved: _Moved, freq: FloatArray, turns: float, outputs: Sequence[Dof], inputs: Sequence[Dof]
) -> ComplexArray:
    """Accelerances (n_lines, n_out, n_in) at `freq` (n_lines,) Hz, at a speed of `turns` times that."""
    if moved.G is not None:
        return turning_modal_frf(moved.modes, moved.G, freq, 2 * np.pi * turns * freq, outputs, inputs)
    seen = [Channel(d, "acceleration", "m/s^2") for d in outputs]
    return np.asarray(modal_frf(moved.modes, freq, seen, [Channel(d, "force", "N") for d in inputs]).H)


def _fitted(H: ComplexArray, Y: ComplexArray) -> tuple[float, ComplexArray]:
    """The least sum of |y - H u|^2 / (|y|^2 + |H u|^2) over the lines, and u (n_bearings,)."""
    size = np.linalg.norm(Y, axis=1)
    size = np.where(size > 0, size, 1.0)
    start = np.linalg.lstsq((H / size[:, None, None]).reshape(-1, H.shape[2]), (Y / size[:, None]).ravel(), rcond=None)
    scale = float(np.abs(start[0]).max()) or 1.0

    def residual(x: FloatArray) -> FloatArray:
        z = H @ (scale * (x[: H.shape[2]] + 1j * x[H.shape[2] :]))
        r = ((Y - z) / np.sqrt(size**2 + (np.abs(z) ** 2).sum(axis=1))[:, None]).ravel()
        return np.concatenate([r.real, r.imag])

    u = start[0] / scale
    found = least_squares(residual, np.concatenate([u.real, u.imag]))
    x = found.x[: H.shape[2]] + 1j * found.x[H.shape[2] :]
    return float(found.cost), np.asarray(scale * x)


def _listed(nodes: tuple[int, ...]) -> str:
    return f"node{'s' * (len(nodes) > 1)} {', '.join(map(str, nodes))}"
