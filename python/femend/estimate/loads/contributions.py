"""Which load makes which part of a response: path contributions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel
from femend.data.bands import within_band
from femend.errors import LoadError
from femend.estimate.loads.identify import Loads
from femend.estimate.loads.unit_responses import UnitResponses, lines_of

__all__ = ["Contributions", "contributions"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Contributions:
    """`parts` (n_freq, n_targets, n_loads) of the responses at `targets`, with deviations `sd` of the same shape.

    `total` (n_freq, n_targets) is their sum, `total_sd` its deviation (parts that can be exchanged for one another are
    each uncertain, and their sum is not).
    """

    freq: FloatArray
    parts: ComplexArray
    sd: FloatArray
    total: ComplexArray
    total_sd: FloatArray
    targets: tuple[Channel, ...]
    names: tuple[str, ...]

    def shares(self) -> FloatArray:
        """Part of each load along the total, Re(part conj(total)) / |total|^2; they sum to 1 and may be negative."""
        power = np.maximum(np.abs(self.total) ** 2, 1e-300)
        return np.asarray((self.parts * self.total.conj()[:, :, None]).real / power[:, :, None])

    def ranked(self, target: int = 0, band: tuple[float, float] | None = None) -> list[tuple[str, float]]:
        """Loads by falling root-mean-square part at one `target` (position) over a `band` in Hz, as shares of the
        total's root mean square."""
        inside = np.ones(len(self.freq), dtype=bool) if band is None else within_band(self.freq, band)
        whole = float(np.sqrt((np.abs(self.total[inside, target]) ** 2).sum()))
        size = np.sqrt((np.abs(self.parts[inside, target]) ** 2).sum(axis=0)) / max(whole, 1e-300)
        return [(self.names[i], float(size[i])) for i in np.argsort(-size)]


def contributions(loads: Loads, paths: UnitResponses) -> Contributions:
    """What each of the `loads` does at the outputs of `paths`, the unit responses from the same loads to the targets.

    y_t = sum_j H_tj f_j (van der Seijs, de Klerk and Rixen, MSSP 68-69 (2016) 217-244, section 3.1). Deviations from
    the loads' covariance and those of `paths`, to first order. Raises LoadError where a load has no path or the lines
    do not match.

    >>> here = (Channel(None, "acceleration", "m/s^2"),)
    >>> f = Loads(np.array([5.0]), np.array([[2.0 + 0j, 1.0]]), np.zeros((1, 2, 2)) + 0j, ("a", "b"), ("N", "N"),
    ...     np.ones((1, 2)), np.ones(1), np.zeros(1), np.zeros(1), np.ones(1), ("reliable",), "none", "gcv")
    >>> made = contributions(f, UnitResponses(np.array([5.0]), np.array([[[1.0, 2.0]]]), here, ("a", "b"), ("N", "N")))
    >>> made.shares()[0, 0].tolist()
    [0.5, 0.5]
    """
    missing = [name for name in loads.names if name not in paths.names]
    if missing:
        raise LoadError(
            f"no path leads from load {missing[0]!r} to the targets; there are paths from {', '.join(paths.names[:8])}"
        )
    lines = lines_of(paths.freq, loads.freq)
    here = paths.select([paths.names.index(name) for name in loads.names])
    H = here.H[lines]
    parts = H * loads.values[:, None, :]
    own = np.einsum("kii->ki", loads.covariance).real[:, None, :] * np.abs(H) ** 2
    total = np.einsum("ktn,knm,ktm->kt", H, loads.covariance, H.conj()).real
    if here.sd is not None:
        more = here.sd[lines] ** 2 * np.abs(loads.values[:, None, :]) ** 2
        own, total = own + more, total + more.sum(axis=2)
    own, total = np.sqrt(np.maximum(own, 0.0)), np.sqrt(np.maximum(total, 0.0))
    return Contributions(loads.freq, parts, own, parts.sum(axis=2), total, here.outputs, loads.names)
