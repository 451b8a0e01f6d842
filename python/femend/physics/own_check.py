"""Checks of a law of one's own when it is registered: its values, its derivatives, which parameters scale its force."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import LawParameterError
from femend.numerals import plain

__all__ = ["check", "scaling", "states_along"]

Array = NDArray[np.float64]
Outputs = Callable[..., list[Any]]

POINTS = 40
# relative steps of the two differences; where they disagree by SMOOTH there is a kink and nothing to check
STEPS, SMOOTH = (1e-5, 2e-6), 1e-3
# a derivative may differ from the difference by this share of the largest one: truncation 1e-10, rounding 1e-11
TOLERANCE = 1e-4


def states_along(outputs: Outputs, n_z: int, typical: Array, amplitude: float, speed: float) -> Array:
    """Ordinary sizes (n_z,) of the internal variables: the largest ones along a sine of `amplitude` and `speed`.

    `outputs` gives force and rates at (d, v, z.., p..), `typical` (n_p,) are the parameters' ordinary sizes.
    """
    z, largest = np.zeros(n_z), np.full(n_z, 1e-12)
    n, period = 400, 2 * np.pi * amplitude / speed
    for i in range(n if n_z else 0):
        phase = 4 * np.pi * i / n
        rates = outputs(amplitude * np.sin(phase), speed * np.cos(phase), *z, *typical)[1:]
        z = z + np.array([float(r) for r in rates]) * 2 * period / n
        largest = np.maximum(largest, np.where(np.isfinite(z), np.abs(z), 0.0))
        z = np.where(np.isfinite(z), z, 0.0)
    return largest


def _points(labels: Sequence[str], scales: Array, n_p: int, typical: Array) -> Array:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.0, 1.0, (POINTS, len(labels))) * scales
    # a fraction stays below one and a number above one above it
    points[:, len(labels) - n_p :] = typical * rng.uniform(0.8, 1.0, (POINTS, n_p))
    above = typical > 1
    points[:, len(labels) - n_p :][:, above] = 1 + (typical[above] - 1) * rng.uniform(0.8, 1.2, (POINTS, above.sum()))
    return points


def check(
    name: str,
    core_name: str,
    outputs: Outputs,
    labels: Sequence[str],
    scales: Array,
    typical: Array,
    slopes: Callable[[list[float]], list[float]] | None = None,
) -> None:
    """Compares what the core evaluates with the function, and derivatives with differences of the function.

    `core_name` is the law's name in the core. `labels` name the inputs d, v, z.., p.. of `outputs`, `scales` (n,) are
    their ordinary sizes, `typical` (n_p,) those of the parameters; `slopes` are derivatives that came with the law.
    Raises LawParameterError.
    """
    n, points = len(labels), _points(labels, scales, len(typical), typical)
    exact = np.array([[float(x) for x in outputs(*point)] for point in points])
    if not np.isfinite(exact).all():
        point = points[~np.isfinite(exact).all(axis=1)][0]
        where = ", ".join(f"{label} = {plain(x, 3)}" for label, x in zip(labels, point, strict=True))
        raise LawParameterError(f"law {name} is not finite at {where}", law=name)
    size = np.abs(exact).max(axis=0)
    if size[0] == 0:
        raise LawParameterError(
            f"law {name} gives no force for |d| up to {scales[0]:g} m and |v| up to {scales[1]:g} m/s; give the "
            "amplitude and speed at which it acts",
            law=name,
        )
    core = np.array([_core.law_slopes(core_name, point) for point in points]).reshape(POINTS, -1, 1 + n)
    off = np.abs(core[:, :, 0] - exact) > 1e-9 * size
    if off.any():
        raise LawParameterError(
            f"law {name}: its recorded formula gives {core[:, :, 0][off][0]:.6g} where the function gives "
            f"{exact[off][0]:.6g}; it has to depend on its arguments alone",
            law=name,
        )
    differences = [_differences(outputs, points, scales, step) for step in STEPS]
    largest = np.abs(differences[0]).max(axis=0) + 1e-9 * size[:, None] / scales
    smooth = np.abs(differences[0] - differences[1]) < SMOOTH * largest
    _compare(name, labels, points, core[:, :, 1:], differences[0], smooth, largest)
    if slopes is not None:
        given = np.array([slopes(list(point)) for point in points])[:, None, :]
        _compare(name, labels, points, given, differences[0][:, :1], smooth[:, :1], largest[:1])


def _differences(outputs: Outputs, points: Array, scales: Array, step: float) -> Array:
    """Central differences (points, outputs, inputs)."""
    out = []
    for point in points:
        columns = []
        for j, scale in enumerate(scales):
            shift = np.zeros(len(point))
            shift[j] = step * scale
            above, below = outputs(*(point + shift)), outputs(*(point - shift))
            columns.append([(float(a) - float(b)) / (2 * step * scale) for a, b in zip(above, below, strict=True)])
        out.append(np.array(columns).T)
    return np.array(out)


def _compare(
    name: str, labels: Sequence[str], points: Array, found: Array, differences: Array, smooth: Any, largest: Array
) -> None:
    wrong = smooth & (np.abs(found - differences) > TOLERANCE * largest)
    if not wrong.any():
        return
    i, k, j = np.argwhere(wrong)[0]
    where = ", ".join(f"{label} = {plain(x, 3)}" for label, x in zip(labels, points[i], strict=True))
    what = "force" if k == 0 else f"rate {k}"
    raise LawParameterError(
        f"law {name}: the derivative of its {what} over {labels[j]} is {found[i, k, j]:.6g} at {where}, "
        f"the difference of the function is {differences[i, k, j]:.6g}; correct `derivatives` or leave them out",
        law=name,
        parameter=labels[j],
    )


def scaling(
    name: str, outputs: Outputs, labels: Sequence[str], scales: Array, forces: Sequence[bool]
) -> tuple[tuple[str, ...], bool]:
    """The parameters that multiply the force, and whether they do so only together.

    Among the parameters whose unit holds a force (`forces`, one for each) those are kept that double the force when
    they are doubled together. `labels` and `scales` (n,) as in `check`. Raises LawParameterError where there are none.
    """
    n, n_p = len(labels), len(forces)
    typical = scales[n - n_p :]
    points = _points(labels, scales, n_p, typical)
    places = [n - n_p + j for j, has in enumerate(forces) if has]

    def force(point: Array, keep: Sequence[int], factor: float) -> float:
        moved = point.copy()
        moved[[j for j in places if j not in keep]] = 0.0
        moved[list(keep)] *= factor
        with np.errstate(divide="ignore", invalid="ignore"):
            try:
                return float(outputs(*moved)[0])
            except ZeroDivisionError:
                return float("nan")

    whole = np.array([force(p, places, 1.0) for p in points])
    if not places or not np.allclose([force(p, places, 2.0) for p in points], 2 * whole, rtol=1e-9):
        named = ", ".join(labels[j] for j in places) or "none"
        raise LawParameterError(
            f"law {name}: its force does not double with the parameters whose unit holds a force ({named}); give a "
            "parameter that multiplies the force the unit of a force over something",
            law=name,
        )
    parts = sum(np.array([force(p, [j], 1.0) for p in points]) for j in places)
    together = len(places) > 1 and not np.allclose(parts, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())
    return tuple(labels[j] for j in places), together
