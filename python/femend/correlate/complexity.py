"""How far a complex mode shape is from a real one: collinearity, phase deviation, complexity factors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import fraction, modulus2, ratio, scaled, shapes, square
from femend.errors import CorrelationError

__all__ = ["mcf", "mcf_area", "mean_phase", "mpc", "mpd"]


def mpc(psi: ArrayLike) -> NDArray[np.float64]:
    """Modal phase collinearity of shapes `psi` (..., n_dof, n_modes): (..., n_modes), 1 real, 0 a travelling wave.

    MPC = ((Sxx - Syy)^2 + 4 Sxy^2) / (Sxx + Syy)^2 with Sxx, Syy, Sxy the sums of squares and products of real and
    imaginary parts (Pappa, Elliott and Schenk, J. Guid. Control Dyn. 16, 1993, 852-858), which is
    |psi^T psi|^2 / (psi^H psi)^2, the MAC of a shape with its conjugate (Vacher et al., ISMA 2010). The mean is not
    taken off. NaN for a zero shape. Raises CorrelationError for values that are not finite.

    >>> mpc([[1.0, 1.0], [1.0, 1j]]).round(12).tolist()
    [1.0, 0.0]
    """
    x = scaled(shapes(psi, "the set of shapes"), -2)
    return fraction(modulus2(np.sum(x * x, axis=-2)), square(x, -2) ** 2)


def mcf(psi: ArrayLike) -> NDArray[np.float64]:
    """Modal complexity factor of `psi` (..., n_dof, n_modes): (..., n_modes), 0 for a real shape, 1 - MPC.

    The factor that identification packages call MCF, with `mpc` as above; `mcf_area` is that of the polygon. NaN for
    a zero shape. Raises CorrelationError for values that are not finite.

    >>> mcf([1.0, 1j]).round(12).tolist()
    [1.0]
    """
    return 1.0 - mpc(psi)


def mcf_area(psi: ArrayLike) -> NDArray[np.float64]:
    """Modal complexity factor by area of `psi` (n_dof, n_modes): (n_modes,), 0 for a real shape, at most 1.

    Area of the convex polygon around the components in the complex plane, over the area of the circle with the
    largest component as radius (MCF2 of Imregun and Ewins, IMAC XIII, 1995; Ewins 2000, section 2.8). NaN for a zero
    shape. Raises CorrelationError for values that are not finite or a batch.

    >>> (mcf_area([1.0, 1j, -1.0, -1j]) * np.pi).round(12).tolist()
    [2.0]
    """
    x = shapes(psi, "the set of shapes")
    if x.ndim != 2:
        raise CorrelationError(f"shapes of shape {x.shape}: the polygon is that of one set of shapes (n_dof, n_modes)")
    peak = np.max(np.abs(x), axis=0)
    unit = np.divide(x, peak, out=np.zeros_like(x), where=peak > 0)
    area = np.array([_hull_area(column) for column in unit.T]) / np.pi
    return np.where(peak > 0, np.clip(area, 0.0, 1.0), np.nan)


def mean_phase(psi: ArrayLike) -> NDArray[np.float64]:
    """Angle in degrees, in (-90, 90], of the line that fits the components of `psi` (..., n_dof, n_modes) best.

    The line through the origin with the least sum of squared distances, which is the right singular vector of
    [Re psi, Im psi] (Reynders, Houbrechts and De Roeck, Mech. Syst. Signal Process. 29, 2012, 228-250, section 3.2);
    turning a shape back by it makes it as real as can be. NaN for a zero shape or one without a line (a circle).
    Raises CorrelationError for values that are not finite.

    >>> mean_phase([1 + 1j, -2 - 2j]).round(12).tolist()
    [45.0]
    """
    x = scaled(shapes(psi, "the set of shapes"), -2)
    # psi^T psi turns by twice the angle of the line, and the line of the largest sum of squares makes it real.
    twice = np.asarray(np.sum(x * x, axis=-2), dtype=np.complex128)
    angle = np.degrees(np.angle(twice)) / 2
    return np.where(np.abs(twice) > 1e-14 * square(x, -2), np.where(angle <= -90.0, 90.0, angle), np.nan)


def mpd(psi: ArrayLike) -> NDArray[np.float64]:
    """Mean phase deviation of `psi` (..., n_dof, n_modes) in degrees: (..., n_modes), 0 for a real shape.

    MPD = sum_o |psi_o| delta_o / sum_o |psi_o|, with delta_o in [0, 90] the angle between the component and the line
    of the mean phase (Reynders et al. 2012, section 3.2). NaN for a zero shape or one without a mean phase. Raises
    CorrelationError for values that are not finite.

    >>> mpd([np.exp(0.1j), np.exp(-0.1j)]).round(6).tolist(), round(float(np.degrees(0.1)), 6)
    ([5.729578], 5.729578)
    """
    x = np.asarray(scaled(shapes(psi, "the set of shapes"), -2), dtype=np.complex128)
    turned = x * np.exp(-1j * np.radians(mean_phase(x)))[..., None, :]
    size = np.abs(x)
    delta = np.degrees(np.arctan2(np.abs(turned.imag), np.abs(turned.real)))
    return ratio(np.sum(size * delta, axis=-2), np.sum(size, axis=-2))


def _hull_area(points: NDArray[Any]) -> float:
    """Area of the convex hull of complex numbers, 0 where they lie on a line."""
    import scipy.spatial

    xy = np.column_stack([points.real, points.imag])
    try:
        return float(scipy.spatial.ConvexHull(xy).volume)  # in the plane the "volume" is the area
    except (scipy.spatial.QhullError, ValueError):
        return 0.0
