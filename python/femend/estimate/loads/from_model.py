"""Unit responses of a model: to forces, to motion of its supports, to pressures on a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel
from femend.dof import Dof, parse_direction
from femend.errors import LoadError, ModelError
from femend.estimate.loads.unit_responses import UnitResponses
from femend.model import Model, Pairing, reduce_model
from femend.model.model import model_of
from femend.model.surfaces.pressure import PressurePatterns
from femend.model.terms.configured import ConfiguredModel
from femend.model.terms.supports import held_rows
from femend.units import unit_system

__all__ = ["ModelSide", "configured_responses", "model_side"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# s^k from a displacement to what a sensor measures
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}
# lines that are solved at once
AT_ONCE = 512


@dataclass(frozen=True, eq=False)
class ModelSide:
    """A model with its damping and the sensors that look at it; it says what a unit of a load does at them.

    `rows` (n_out,) are rows of the g-set and `signs` (n_out,) directions of the sensors `channels`; `zeta` a damping
    ratio of all modes, or one for each of the lowest (the last for all above), on top of the deck's dashpots; `factors`
    those of the parameters; `f_max` Hz the end of the band.
    """

    model: Model
    channels: tuple[Channel, ...]
    rows: NDArray[np.int64]
    signs: FloatArray
    zeta: FloatArray
    factors: Mapping[str, float]
    f_max: float

    def forces(self, freq: FloatArray, dofs: Sequence[Dof | str]) -> UnitResponses:
        """To unit forces (moments) at `dofs` of the model, on lines `freq` (n_freq,) in Hz."""
        at = [Dof.parse(d) if isinstance(d, str) else d for d in dofs]
        pattern = np.zeros((self.model.fe.n_g, len(at)))
        for j, dof in enumerate(at):
            pattern[self.model.row(dof), j] = dof.sign
        own = unit_system(self.model.units)
        units = tuple(own.text("force", rotational=d.component > 3) for d in at)
        return self.patterns(freq, pattern, tuple(str(d) for d in at), units)

    def pressures(self, freq: FloatArray, given: PressurePatterns) -> UnitResponses:
        """To one unit of each pressure of `given`, on lines `freq` (n_freq,) in Hz."""
        return self.patterns(
            freq, given.loads(), given.names, (unit_system(self.model.units).text("pressure"),) * len(given.names)
        )

    def patterns(
        self, freq: FloatArray, loads: FloatArray, names: tuple[str, ...], units: tuple[str, ...]
    ) -> UnitResponses:
        """To forces `loads` (n_g, m) called `names` in `units`, on lines `freq` (n_freq,) in Hz."""
        T = self.model.transformation()
        pattern = np.asarray(T.T @ loads)
        basis = reduce_model(self.model, self.f_max, self._targets(), pattern)
        V_a = np.asarray(basis.V_a)
        K, M, C = self._matrices(V_a)
        X = _solved(K, M, C, freq, np.asarray(V_a.T @ pattern)[None])
        out = basis.rows(self.rows, self.signs)
        return self._responses(freq, out @ X, names, units)

    def base(
        self, freq: FloatArray, directions: Sequence[str] = ("X", "Y", "Z"), nodes: Sequence[int] | None = None
    ) -> UnitResponses:
        """To unit accelerations of the supports along `directions` (X, Y, Z, and RX, RY, RZ about their centre), on
        lines `freq` (n_freq,) in Hz.

        All held DOFs move together as one body, or those at `nodes` alone. The structure's motion is the static one
        that the supports force on it, and modes of the held structure beside it, which the inertia of the static motion
        drives (Clough and Penzien, Dynamics of Structures, 3rd ed., section 26-2: pseudostatic and dynamic parts);
        modal damping acts on the modes, dashpots of the deck on the whole motion. Raises ModelError where nothing is
        held, where the moving supports are not a part of what is, and for masses that are not in the deck.
        """
        free = model_of(self.model.deck, units=self.model.units, parameters=self.model.parameters, spc=0)
        _same_mass(free, self.model)
        held = held_rows(free, self.model)
        loose = np.setdiff1d(np.arange(free.fe.n_a), held)
        moved = _rigid(free, held, directions, nodes)
        K, M, C = _assembled(free, self.factors)
        from scipy.sparse.linalg import splu

        static = np.zeros((free.fe.n_a, len(directions)))
        static[held] = moved
        static[loose] = -splu(K[loose][:, loose].tocsc()).solve(np.asarray(K[loose][:, held] @ moved))
        inertia, drag = np.asarray(M @ static)[loose], np.asarray(C @ static)[loose]
        basis = reduce_model(self.model, self.f_max, self._targets(), inertia)
        V = np.zeros((free.fe.n_a, basis.r))
        V_a = np.asarray(basis.V_a)
        V[loose] = V_a
        Kq, Mq, Cq = self._matrices(V_a)
        s = (2j * np.pi * freq)[:, None, None]
        drive = -((V_a.T @ inertia)[None] * s**2 + s * (V_a.T @ drag)[None])
        q = _solved(Kq, Mq, Cq, freq, drive)
        T = free.transformation()[self.rows]
        out, own = np.asarray(T @ V) * self.signs[:, None], np.asarray(T @ static) * self.signs[:, None]
        # per displacement of the base is per acceleration of the base, for a response of the same kind
        names = tuple(f"base {d}" for d in directions)
        own_units = unit_system(self.model.units)
        units = tuple(own_units.text("acceleration", rotational=parse_direction(d)[0] > 3) for d in directions)
        return self._responses(freq, (out @ q + own[None]) / np.where(s == 0, 1.0, s**2), names, units)

    def _targets(self) -> list[int]:
        """Rows of sensors that move: those on supports need no response of their own."""
        T = self.model.transformation()[self.rows]
        moving = np.diff(T.tocsr().indptr) > 0
        return [int(r) for r in self.rows[moving]]

    def _matrices(self, V_a: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        from scipy.linalg import eigh

        K, M, C = (np.asarray(A) for A in self.model.fe.project(self.model.factors(self.factors), V_a)[0][:3])
        lam, phi = eigh(K, M)
        omega = np.sqrt(np.maximum(lam, 0.0))
        zeta = np.concatenate([self.zeta, np.full(max(0, len(lam) - len(self.zeta)), self.zeta[-1])])[: len(lam)]
        own = M @ phi
        return K, M, C + (own * (2 * zeta * omega)) @ own.T

    def _responses(
        self, freq: FloatArray, H: ComplexArray, names: tuple[str, ...], units: tuple[str, ...]
    ) -> UnitResponses:
        """From receptances (n_freq, n_out, m) to what the sensors measure, in the model's units."""
        s = 2j * np.pi * freq
        factor = np.stack([s ** POWER[c.quantity] for c in self.channels], axis=1)
        own = unit_system(self.model.units)
        turned = [c.dof is not None and c.dof.component > 3 for c in self.channels]
        outputs = tuple(
            Channel(c.dof, c.quantity, own.text(c.quantity, rotational=t), c.name, c.label)
            for c, t in zip(self.channels, turned, strict=True)
        )
        return UnitResponses(freq, H * factor[:, :, None], outputs, names, units)


def model_side(
    model: Model,
    channels: Sequence[Channel],
    pairing: Pairing,
    *,
    f_max: float,
    zeta: float | FloatArray = 0.01,
    factors: Mapping[str, float] | None = None,
) -> ModelSide:
    """The `model` as the sensors `channels` see it through their `pairing`, up to `f_max` Hz.

    `zeta` is a damping ratio or one for each of the lowest modes (n,), `factors` those of the model's parameters.
    Raises LoadError for a channel without a DOF or one that measures no motion.
    """
    rows, signs = [], []
    for channel in channels:
        if channel.dof is None or channel.quantity not in POWER:
            raise LoadError(
                f"channel {channel.text} has no DOF or measures no motion; leave it out", channel=channel.text
            )
        pair = pairing[channel.dof]
        rows.append(model.row(pair.dof))
        signs.append(float(pair.dof.sign))
    ratio = np.atleast_1d(np.asarray(zeta, dtype=np.float64))
    at = np.array(rows, dtype=np.int64)
    return ModelSide(model, tuple(channels), at, np.array(signs), ratio, dict(factors or {}), f_max)


def configured_responses(
    model: ConfiguredModel,
    p: FloatArray,
    freq: FloatArray,
    channels: Sequence[Channel],
    out: FloatArray,
    loads: FloatArray,
    names: Sequence[str],
    units: Sequence[str],
) -> UnitResponses:
    """Unit responses of a configuration at its unknowns `p` (n,), with the terms that a staged study has found, on
    lines `freq` (K,) in Hz.

    `out` (n_out, r) are rows of its basis at accelerometers `channels`, with their signs; `loads` (m, r) the forces on
    the basis (rows at DOFs, or sums of them), called `names` (m,) in `units` (m,). Raises LoadError for a channel that
    is no accelerometer and for sizes that do not fit.
    """
    wrong = [c.text for c in channels if c.quantity != "acceleration"]
    if wrong:
        raise LoadError(
            f"channel {wrong[0]} measures no acceleration; use `to_quantity`, or leave it out", channel=wrong[0]
        )
    K, M, C = model.matrices(p)
    X = _solved(K, M, C, freq, loads.T[None].astype(np.complex128))
    H = (2j * np.pi * freq)[:, None, None] ** 2 * (out @ X)
    return UnitResponses(freq, H, tuple(channels), tuple(names), tuple(units))


def _assembled(model: Model, factors: Mapping[str, float]) -> tuple[Any, ...]:
    from scipy.sparse import csc_array

    indptr, indices, K, M, C, _ = model.fe.assemble(model.factors(factors))
    shape = (model.fe.n_a, model.fe.n_a)
    return tuple(csc_array((A, indices, indptr), shape=shape) for A in (K, M, C))


def _solved(K: FloatArray, M: FloatArray, C: FloatArray, freq: FloatArray, F: ComplexArray) -> ComplexArray:
    """(K + s C + s^2 M)^-1 F (n_freq, r, m) for F (1 or n_freq, r, m)."""
    found = []
    for begin in range(0, len(freq), AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        s = (2j * np.pi * freq[part])[:, None, None]
        load = F if len(F) == 1 else F[part]
        found.append(np.linalg.solve(K + s * C + s**2 * M, np.broadcast_to(load, (len(s), *load.shape[1:]))))
    return np.asarray(np.concatenate(found), dtype=np.complex128)


def _same_mass(free: Model, held: Model) -> None:
    """The deck is read once more without supports: masses that were added to the model would be missing there."""
    there, own = free.total_mass, held.total_mass
    if abs(there - own) > 1e-6 * own:
        raise ModelError(
            f"the model weighs {own:.6g}, its deck {there:.6g}: it has masses on top of the deck; write them "
            "into the deck (CONM2) to let its supports move"
        )


def _rigid(free: Model, held: NDArray[np.int64], directions: Sequence[str], nodes: Sequence[int] | None) -> FloatArray:
    """Displacements (n_held, m) of the held DOFs for unit motions of the supports at `nodes` as one body."""
    at_node = np.asarray(free.fe.dof_nodes)[held]
    component = np.asarray(free.fe.dof_components)[held]
    moving = np.ones(len(held), dtype=bool) if nodes is None else np.isin(at_node, np.asarray(nodes))
    moving &= ~np.isin(at_node, free.fe.scalar_points)  # a mode of a superelement that is held moves with nothing
    if not moving.any():
        raise ModelError(
            "the model holds no DOF" if nodes is None else f"none of the nodes {list(nodes)[:8]} is held by the model"
        )
    index = {int(n): i for i, n in enumerate(free.node_ids)}
    x = free.xyz[[index[int(n)] for n in at_node]]
    centre = free.xyz[[index[int(n)] for n in sorted({int(n) for n in at_node[moving]})]].mean(axis=0)
    frames = free.frames[[index[int(n)] for n in at_node]]
    found = np.zeros((len(held), len(directions)))
    for j, text in enumerate(directions):
        number, sign = parse_direction(text)
        e = sign * np.eye(3)[(number - 1) % 3]
        turn = e if number > 3 else np.zeros(3)
        shift = np.cross(turn, x - centre) if number > 3 else np.broadcast_to(e, x.shape)
        vector = np.where((component <= 3)[:, None], shift, turn)
        axis = frames[np.arange(len(held)), (component - 1) % 3]
        found[:, j] = np.where(moving, (axis * vector).sum(axis=1), 0.0)
    return found
