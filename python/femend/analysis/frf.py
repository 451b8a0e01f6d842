"""FRFs of a model from its modes, as `FRF`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.analysis.ends import PER_FORCE, dofs_of
from femend.data.channel import Channel
from femend.data.frf import FRF
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import UnitError
from femend.units import parse_unit

__all__ = ["FrfScores", "modal_frf", "modal_frf_scores", "shapes_at"]


def shapes_at(modes: ModeSet, dofs: Sequence[Dof]) -> NDArray[np.float64]:
    """Rows of `phi` at `dofs` in their signed directions, (len(dofs), n_modes).

    Raises ValueError naming a DOF that the modes do not have.

    >>> modes = ModeSet([1.0], [0.01], [[2.0]], (Dof(7, 3),))
    >>> shapes_at(modes, [Dof(7, 3, -1)]).tolist()
    [[-2.0]]
    """
    row = {(dof.node, dof.component): (i, dof.sign) for i, dof in enumerate(modes.dofs)}
    missing = [str(dof) for dof in dofs if (dof.node, dof.component) not in row]
    if missing:
        raise ValueError(f"the modes have no DOF {', '.join(missing[:8])}; pair the sensor with a DOF of the model")
    found = [row[dof.node, dof.component] for dof in dofs]
    signs = np.array([sign * dof.sign for (_, sign), dof in zip(found, dofs, strict=True)], dtype=np.float64)
    return np.ascontiguousarray(np.real(modes.phi)[[i for i, _ in found]] * signs[:, None], dtype=np.float64)


def modal_frf(
    modes: ModeSet,
    freq: ArrayLike,
    outputs: Sequence[Channel],
    inputs: Sequence[Channel],
    *,
    kind: str = "accelerance",
    residual: NDArray[np.float64] | NDArray[np.complex128] | None = None,
    unit: str | None = None,
    name: str = "model",
) -> FRF:
    """FRFs (n_freq, n_out, n_in) at `freq` (n_freq,) in Hz by superposition of mass-normalised real modes.

    `kind` is receptance, mobility or accelerance; `residual` (n_out, n_in) the static receptance of the modes left out
    (rows of `_core.residual_vectors` in the sensors' directions); `unit` the unit of H, SI if not given. H is in the
    signed directions of the channels. Raises ValueError for complex or otherwise scaled modes, for a channel without a
    DOF of the model, an unknown kind, or a line on the pole of an undamped mode.

    H = sum phi_out phi_in / (omega^2 - w^2 + 2 i zeta omega w) (Ewins 2000, chapter 2), time convention exp(+iwt).

    >>> modes = ModeSet([1.0], [0.5], [[1.0]], (Dof(1, 3),))
    >>> place = [Channel(Dof(1, 3), "acceleration", "m/s^2")]
    >>> H = modal_frf(modes, [1.0], place, place, kind="receptance").H
    >>> complex(H[0, 0, 0] * (2 * np.pi) ** 2).imag
    -1.0
    """
    lines = np.asarray(freq, dtype=np.float64)
    s = (2j * np.pi * lines).astype(np.complex128)
    H = _core.frf_modal(*_superposed(modes, outputs, inputs), s, kind, residual)
    return FRF(name, lines, H, tuple(outputs), tuple(inputs), kind, unit or PER_FORCE[kind])


@dataclass(frozen=True, slots=True, eq=False)
class FrfScores:
    """Agreement of a model's FRFs with measured ones: `frac`, `faac` (n_out, n_in) of each pair, `csac`, `csf`
    (n_freq,) of each line, as `femend.correlate` has them; `misfit` is the sum of |H - H_measured|^2 over all, in the
    square of the model's unit. NaN where an FRF is zero."""

    frac: NDArray[np.float64]
    faac: NDArray[np.float64]
    csac: NDArray[np.float64]
    csf: NDArray[np.float64]
    misfit: float


def modal_frf_scores(
    modes: ModeSet,
    measured: FRF,
    *,
    residual: NDArray[np.float64] | NDArray[np.complex128] | None = None,
    unit: str | None = None,
) -> FrfScores:
    """How far FRFs by superposition of `modes` agree with `measured`, without the model's ever being stored.

    The model's are what `modal_frf` gives at the lines, channels and kind of `measured`, with the static `residual`
    (n_out, n_in) of the modes left out, in `unit` (SI if not given), into which the measured ones are converted. They
    are reduced to sums while they are computed: for loops over samples of parameters, where storing and reading them
    again costs more than computing. FRAC, FAAC, CSAC and CSF are those of `femend.correlate`; where DOFs or lines of
    both have to be matched first, `compare_frfs` does that. Raises what `modal_frf` raises, and UnitError for units
    that do not convert.

    >>> modes = ModeSet([1.0], [0.5], [[1.0]], (Dof(1, 3),))
    >>> place = [Channel(Dof(1, 3), "acceleration", "m/s^2")]
    >>> scores = modal_frf_scores(modes, modal_frf(modes, [0.5, 1.0], place, place))
    >>> scores.csac.round(9).tolist(), scores.misfit < 1e-20
    ([1.0, 1.0], True)
    """
    own, given = parse_unit(unit or PER_FORCE[measured.kind]), parse_unit(measured.unit)
    if own.dims != given.dims:
        raise UnitError(
            f"{measured.name!r} is in {measured.unit!r} and the model's FRFs are in {own.text!r}, which measure "
            "different things"
        )
    s = (2j * np.pi * measured.freq).astype(np.complex128)
    H = np.ascontiguousarray(measured.H * (given.factor / own.factor))
    ends = _superposed(modes, measured.outputs, measured.inputs)
    return FrfScores(**_core.frf_modal_scores(*ends, s, H, measured.kind, residual))


def _superposed(
    modes: ModeSet, outputs: Sequence[Channel], inputs: Sequence[Channel]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """omega, zeta and the shapes at both ends, or ValueError."""
    if modes.scaling != "mass" or np.iscomplexobj(modes.phi):
        raise ValueError(
            f"modes are scaled {modes.scaling!r} and {modes.phi.dtype}; superposition needs real mass-normalised ones"
        )
    at_outputs, at_inputs = (shapes_at(modes, dofs) for dofs in [dofs_of(outputs), dofs_of(inputs)])
    return 2 * np.pi * modes.freq, np.ascontiguousarray(modes.zeta), at_outputs, at_inputs
