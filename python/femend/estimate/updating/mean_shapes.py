"""Operating shapes of repeated recordings: their mean, and how far they scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import ODS
from femend.errors import UpdatingError

__all__ = ["mean_shapes"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def mean_shapes(repeated: Sequence[ODS]) -> ODS:
    """The mean of `repeated` shapes on the same lines at the same channels, with the deviation of the mean as `sigma`
    (n_ch, n_freq).

    Shapes of an order have their phase from the tacho and are averaged as they stand. Of others every recording has a
    level and a phase of its own on every line: they are brought together by the complex factors of least squares (the
    first singular pair of the recordings of a line), and the mean has their root mean square level and the first one's
    phase. Raises UpdatingError for fewer than two, other lines or other channels.

    >>> from femend.data import Channel
    >>> from femend.dof import Dof
    >>> two = tuple(Channel(Dof(n, 3), "acceleration", "m/s^2") for n in (1, 2))
    >>> runs = [ODS("run", np.array([9.0]), np.array([[1.0], [x]]), two, "order", speed=[9.0], order=1.0)
    ...         for x in (0.4, 0.6)]
    >>> mean_shapes(runs).sigma.ravel().round(3).tolist()
    [0.0, 0.1]
    """
    first = repeated[0] if repeated else None
    if first is None or len(repeated) < 2:
        raise UpdatingError(f"scatter takes two recordings or more, there are {len(repeated)}; give deviations instead")
    for other in repeated[1:]:
        if not np.array_equal(other.freq, first.freq):
            raise UpdatingError(
                f"operating shapes {other.name!r} stand on {other.n_freq} lines, others than the {first.n_freq} of "
                f"{first.name!r}; take all on the same ones"
            )
        if [(c.dof, c.quantity) for c in other.channels] != [(c.dof, c.quantity) for c in first.channels]:
            raise UpdatingError(
                f"operating shapes {other.name!r} have other channels than {first.name!r}, or in another order; "
                "`select` the same"
            )
    X = np.array([o.shapes for o in repeated])
    if all(o.kind == "order" for o in repeated):
        mean = X.mean(axis=0)
        variance = (np.abs(X - mean) ** 2).sum(axis=0) / (len(X) - 1) / len(X)
    else:
        mean, variance = _aligned(X)
    return replace(first, shapes=mean, sigma=np.sqrt(variance), coherence=None)


def _aligned(X: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Mean and its variance (n_ch, n_freq) of shapes `X` (n, n_ch, n_freq), each times a factor of its own a line."""
    n, n_ch, _ = X.shape
    U, s, Vh = np.linalg.svd(X.transpose(2, 1, 0), full_matrices=False)
    shape, factor = U[:, :, 0], s[:, :1] * Vh[:, 0]  # (n_freq, n_ch), (n_freq, n)
    left = X.transpose(2, 1, 0) - shape[:, :, None] * factor[:, None, :]
    # the line's shape and its factors take up what (n - 1) (n_ch - 1) of n n_ch values leave
    freedom = (n - 1) * max(n_ch - 1, 1) / n_ch
    power = np.maximum((np.abs(factor) ** 2).sum(axis=1, keepdims=True), np.finfo(float).tiny)
    level = np.sqrt(power / n) * np.exp(1j * np.angle(factor[:, :1]))
    variance = (np.abs(left) ** 2).sum(axis=2) / freedom / power * np.abs(level) ** 2
    return np.asarray((shape * level).T), np.asarray(variance.T)
