"""One run's operating shapes against the model: its peaks with the modes, all lines with the response to unbalance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from femend.analysis.frf import modal_frf
from femend.analysis.model_modes import model_modes
from femend.bench.models import modes_up_to
from femend.bench.runs import MeasuredRun
from femend.correlate import ModeComparison, compare_modes, csac, csf, dac
from femend.data import Channel, ModeSet
from femend.dof import Dof
from femend.estimate.joint import Unbalance
from femend.model import Model

__all__ = ["ComparedRun", "OperatingResponse", "compare_run"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# the model's response is superposed from modes up to this multiple of the run's highest line, as FRFs are
ABOVE = 3.0


@dataclass(frozen=True, eq=False)
class OperatingResponse:
    """What unbalance at the bearings `nodes` makes of the model, beside what was measured.

    `unbalance` (n_bearings,) are m r exp(i phase) against the tacho's angle 0, in mass times length of the model,
    turning in the `sense` (+1 about the shaft's axis by the right hand); they are not known and chosen so that the
    responses agree best (see `compare_run`). `shapes` (n_lines, n_dof) are accelerations per unit course at the run's
    lines and sensors, in the sensors' directions; `csac`, `csf` (n_lines,) compare line with line, `dac`
    (n_lines, n_lines) every measured line with every line of the model.
    """

    nodes: tuple[int, ...]
    sense: int
    unbalance: ComplexArray
    shapes: ComplexArray
    csac: FloatArray
    csf: FloatArray
    dac: FloatArray

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
    measured: MeasuredRun, model: Model, places: dict[Dof, Dof], *, zeta: float, mac_min: float = 0.5
) -> ComparedRun:
    """Compares the operating shapes of a `measured` run with the `model`, whose modes have the damping ratio `zeta`.

    `places` has the model's DOF of each sensor, `mac_min` is as in `pair_modes`. At each peak the shape, complex as it
    is, is paired with a mode. Over all lines it is compared with the response to unbalance at the bearings, whose
    sizes and phases nobody measured: in either sense of rotation those are taken under which the cross signature scale
    factor (Dascotte and Strobbe 1999), with the phase counting, is largest on average over the lines,

        sum over lines of |y - H u|^2 / (|y|^2 + |H u|^2) = least,

    so that no line counts more for being loud, nor less where the model's resonances are elsewhere. Raises what
    `model_modes` and `compare_modes` raise.
    """
    top = float(measured.freq[-1])
    modes = modes_up_to(model, top, 1, zeta)
    comparison = None
    if measured.peaks.size:
        freq = measured.peak_freq
        test = ModeSet(freq, np.zeros(freq.size), measured.shapes[measured.peaks].T, measured.dofs, "unscaled")
        comparison = compare_modes(test, modes, places=places, mac_min=mac_min)
    lacking = [n for n in measured.nodes if n not in set(model.node_ids.tolist())]
    if lacking:
        why = (
            f"recording {measured.name!r}: bearing node {lacking[0]} of [recording.rotating] is not among the "
            f"{len(model.node_ids)} nodes of the model, so that its response to unbalance is not known; the shapes at "
            "the peaks are compared with the modes alone"
        )
        return ComparedRun(measured, modes, comparison, None, why)
    every = model_modes(model, f_max=ABOVE * top, zeta=zeta)
    response = _response(measured, every, places)
    if response is None:
        why = f"recording {measured.name!r}: unbalance at {_listed(measured.nodes)} moves no sensor of the model"
        return ComparedRun(measured, modes, comparison, None, why)
    return ComparedRun(measured, modes, comparison, response)


def _response(measured: MeasuredRun, modes: ModeSet, places: dict[Dof, Dof]) -> OperatingResponse | None:
    Y = measured.shapes
    best: tuple[float, int, ComplexArray, ComplexArray] | None = None
    for sense in (1, -1):
        H = _per_unbalance(measured, modes, places, sense)
        if not np.abs(H).any():
            return None
        left, u = _fitted(H, Y)
        if best is None or left < best[0]:
            best = (left, sense, u, np.asarray(H @ u))
    assert best is not None
    _, sense, u, shapes = best
    a, b = Y[:, :, None], shapes[:, :, None]
    return OperatingResponse(measured.nodes, sense, u, shapes, csac(a, b), csf(a, b), dac(Y.T, shapes.T))


def _per_unbalance(measured: MeasuredRun, modes: ModeSet, places: dict[Dof, Dof], sense: int) -> ComplexArray:
    """Accelerations (n_lines, n_dof, n_bearings) per unit course to a unit unbalance at phase 0 of every bearing."""
    plane = Unbalance(measured.nodes, measured.axis, sense).plane
    outputs = [Channel(places[d], "acceleration", "m/s^2") for d in measured.dofs]
    inputs = [Channel(Dof(n, c + 1), "force", "N") for n in measured.nodes for c in plane]
    H = modal_frf(modes, measured.freq, outputs, inputs).H.reshape(measured.freq.size, len(outputs), -1, 2)
    # the sine course is -i times the cosine course at positive frequencies
    return np.asarray(H[..., 0] - 1j * sense * H[..., 1])


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
