"""The sense in which a mode turns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.conservative import COINCIDE, groups
from femend.analysis.turning import TurningSystem
from femend.model.terms.spinning import SpinningPart

__all__ = ["WhirlMeter"]


class WhirlMeter:
    """Tells the whirl of shapes at the rows of a `system`, from -1 (backward) over 0 (planar) to 1 (forward).

    Over the nodes of each part, with the weights of the mass matrix's diagonal and the components u, v across the axis,
    right-handed with it: sum of -2 Im(conj(u) v) / sum of (|u|^2 + |v|^2), translations and tilts alike; forward is the
    sense in which the part turns. With W = 0 forward is that of positive speed.
    """

    def __init__(self, system: TurningSystem) -> None:
        self.model = system.model
        nodes = np.array([d.node for d in system.dofs])
        if self.model is not None:
            ids = self.model.node_ids
            self._frames = self.model.frames
            self._T: Any = self.model.transformation()
        else:
            ids = np.unique(nodes)
            self._frames = np.broadcast_to(np.eye(3), (ids.size, 3, 3))
            self._T = None
        order = np.argsort(ids)
        self._rows = 6 * order[np.searchsorted(ids[order], nodes)] + np.array([d.component - 1 for d in system.dofs])
        self._n = ids.size
        mass = np.zeros(6 * ids.size)
        mass[self._rows] = np.abs(system.M.diagonal())
        self._mass = mass.reshape(-1, 2, 3).mean(axis=2)
        self._parts = [(part, self._nodes_of(part, ids)) for part in system.parts if part.ratio != 0]

    def _nodes_of(self, part: SpinningPart, ids: NDArray[Any]) -> NDArray[np.int64]:
        """Positions of the nodes of a part."""
        if part.elements is None or self.model is None:
            return np.arange(ids.size)
        wanted = set(part.elements)
        own = {n for eid, _, nodes in self.model.fe.elements() if eid in wanted for n in nodes}
        return np.flatnonzero(np.isin(ids, sorted(own)))

    def of(self, psi: NDArray[np.complex128], poles: NDArray[np.complex128] | None = None) -> NDArray[np.float64]:
        """Whirl (m,) of shapes `psi` (n, m); NaN where no part turns or none of it moves across its axis.

        Shapes of `poles` (m,) that coincide (both planes of a rotor that nothing tells apart) mix at will: where the
        poles are given, these whirl as their combinations that do so most, backward ones first.
        """
        if self._T is not None:
            g = np.asarray(self._T @ psi)
        else:
            g = np.zeros((6 * self._n, psi.shape[1]), dtype=complex)
            g[self._rows] = psi
        # (node, translation or tilt, component, mode), basic system
        local = g.reshape(self._n, 2, 3, -1)
        basic = np.einsum("nij,nkim->nkjm", self._frames, local)
        turned, whole = self._forms(basic)
        known = whole > 1e-9 * np.max(whole, initial=0.0)
        out = np.where(known, turned / np.where(known, whole, 1.0), np.nan)
        for group in [] if poles is None else groups(poles, COINCIDE):
            if group.size > 1 and known[group].all() and poles is not None and poles[group].all():
                out[group] = self._most(basic[..., group])
        return out

    def _forms(self, basic: NDArray[np.complex128]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The two sums (m,) whose ratio is the whirl of shapes (node, 2, 3, m)."""
        turned, whole = np.zeros(basic.shape[-1]), np.zeros(basic.shape[-1])
        for part, nodes in self._parts:
            e1, e2 = _across(np.asarray(part.axis, dtype=np.float64))
            u = np.einsum("j,nkjm->nkm", e1, basic[nodes])
            v = np.einsum("j,nkjm->nkm", e2, basic[nodes])
            weight = self._mass[nodes][:, :, None]
            turned += np.sign(part.ratio) * np.sum(weight * -2.0 * np.imag(np.conj(u) * v), axis=(0, 1))
            whole += np.sum(weight * (np.abs(u) ** 2 + np.abs(v) ** 2), axis=(0, 1))
        return turned, whole

    def _most(self, basic: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Whirl (m,), rising, of the combinations of shapes (node, 2, 3, m) for which it is stationary."""
        from scipy.linalg import eigh

        m = basic.shape[-1]
        turned, whole = np.zeros((m, m), dtype=complex), np.zeros((m, m), dtype=complex)
        # Hermitian forms from their values on sums: h(x + c y) has Re(c h_xy) in it
        own = np.array(self._forms(basic))
        for i in range(m):
            turned[i, i], whole[i, i] = own[:, i]
            for j in range(i + 1, m):
                both = np.stack([basic[..., i] + c * basic[..., j] for c in (1.0, 1.0j)], axis=-1)
                values = 0.5 * (np.array(self._forms(both)) - own[:, [i]] - own[:, [j]])
                for form, (re, im) in zip((turned, whole), values, strict=True):
                    form[i, j], form[j, i] = re - 1j * im, re + 1j * im
        try:
            return np.asarray(eigh(turned, whole, eigvals_only=True))
        except np.linalg.LinAlgError:
            return np.asarray(own[0] / own[1])


def _across(axis: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two unit vectors across `axis`, right-handed with it."""
    a = axis / np.linalg.norm(axis)
    first = np.eye(3)[int(np.argmin(np.abs(a)))]
    e1 = first - a * (a @ first)
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(a, e1)
