"""FRFs of a model from its modes, as `FRF`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.data.channel import Channel
from femend.data.frf import FRF
from femend.data.mode_set import ModeSet
from femend.dof import Dof

__all__ = ["modal_frf", "shapes_at"]

_PER_FORCE = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}


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
    if modes.scaling != "mass" or np.iscomplexobj(modes.phi):
        raise ValueError(
            f"modes are scaled {modes.scaling!r} and {modes.phi.dtype}; superposition needs real mass-normalised ones"
        )
    for channel in (*outputs, *inputs):
        if channel.dof is None:
            raise ValueError(f"channel {channel.text} has no DOF; FRFs are between DOFs")
    lines = np.asarray(freq, dtype=np.float64)
    H = _core.frf_modal(
        2 * np.pi * modes.freq,
        np.ascontiguousarray(modes.zeta),
        shapes_at(modes, [c.dof for c in outputs if c.dof is not None]),
        shapes_at(modes, [c.dof for c in inputs if c.dof is not None]),
        (2j * np.pi * lines).astype(np.complex128),
        kind,
        residual,
    )
    return FRF(name, lines, H, tuple(outputs), tuple(inputs), kind, unit or _PER_FORCE[kind])
