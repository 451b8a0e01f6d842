"""Times that were rounded as they were printed: what their last digit is worth, and the even step they come from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["even_grid", "printed_unit"]

FloatArray = NDArray[np.float64]

# values by which digits are counted
LOOKED_AT = 5000
# share of a last digit by which a time may be off: half of it is rounding, the rest is for the step of the grid
OFF = 0.55
# share of the step up to which a last digit still tells that times are even
TELLS = 0.5


def printed_unit(values: FloatArray) -> FloatArray:
    """What the last digit of every one of the numbers `values` (n,) is worth, (n,), as they were printed in a text:
    with as many decimals, or as many digits, as the one that has most of them.

    >>> printed_unit(np.array([0.0, 0.0125, 10.25, 100.1]))
    array([0.0001, 0.0001, 0.01  , 0.1   ])
    """
    # the shortest text of a number that was read is what was printed, but for zeros at its end
    every = values[np.isfinite(values)]
    # at random: every tenth of 0.001, 0.002, ... has a digit less
    some = np.random.default_rng(0).permutation(every)[:LOOKED_AT]
    digits, decimals = 1, 0
    for value in some:
        text, _, power = repr(abs(float(value))).partition("e")
        whole, _, part = text.partition(".")
        part = part.rstrip("0")
        decimals = max(decimals, len(part) - int(power or 0))
        figures = (whole + part).lstrip("0")
        digits = max(digits, len(figures if part else figures.rstrip("0")))
    size = np.floor(np.log10(np.where(values != 0, np.abs(np.nan_to_num(values)), 1.0) + (values == 0)))
    by_digits = np.where(values != 0, 10.0 ** (size - digits + 1), 0.0)
    return np.asarray(np.maximum(by_digits, 10.0**-decimals), dtype=np.float64)


def even_grid(values: FloatArray, unit: FloatArray) -> tuple[float, float] | None:
    """Start and step of the even times that `values` (n,), whose last digits are worth `unit` (n,), were rounded from;
    None where there are none, or where digits are too coarse to tell.

    The step is that of the line of least squares, each time weighted by its digits. A rate that is a whole number but
    for the rounding is taken as that.
    """
    n = np.arange(values.size, dtype=np.float64)
    A = np.column_stack([np.ones_like(n), n]) / unit[:, None]
    (_, step), *_ = np.linalg.lstsq(A, values / unit, rcond=None)
    if step <= 0 or unit.max() > TELLS * step:
        return None
    rate = round(1.0 / step)
    if rate > 0 and abs(1.0 / rate - step) * values.size < unit.max():
        step = 1.0 / rate
    rest = values - step * n
    low, high = float((rest - OFF * unit).max()), float((rest + OFF * unit).min())
    return (0.5 * (low + high), float(step)) if low <= high else None
