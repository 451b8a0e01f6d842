"""What frequencies of identified modes say of a model: how far they are off, and how far they scatter themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any

from femend.numerals import plain
from femend.report.entries import number, rows

__all__ = ["FrequencyErrors", "frequency_errors"]

# a mode with a smaller MAC has no counterpart in the model: it came twice, or belongs to something else
PAIRED = 0.7
# relative deviation of a frequency that no model explains
FORM = 0.002
# errors of so many deviations, scatter and form together, are the model's
BEYOND = 3.0
# errors of a frequency that no mesh or idealisation makes
FAR = 0.05


@dataclass(frozen=True)
class FrequencyErrors:
    """Modes that were identified, those of them with a counterpart in the model, the median of the errors of their
    frequencies and of their own scatter (relative; nan where that is not known), the largest error with its frequency
    (Hz), and whether the errors are beyond scatter and form."""

    identified: int
    paired: int
    typical: float
    scatter: float
    largest: float
    at: float
    beyond: bool

    @property
    def text(self) -> str:
        """The figures in words, as a sentence about the model's frequencies."""
        unpaired = self.identified - self.paired
        if not self.paired:
            return f"none of the {self.identified} identified modes has a counterpart (MAC above {PAIRED:g}) in it"
        without = f" ({unpaired} more without a counterpart)" if unpaired else ""
        own = f", their own scatter is {plain(100 * self.scatter, 2)} %" if math.isfinite(self.scatter) else ""
        largest = plain(100 * self.largest, 2, signed=True).replace("-", "−")
        return (
            f"its frequencies are {plain(100 * self.typical, 2)} % off (median of {self.paired} identified "
            f"mode{'s' * (self.paired != 1)}{without}; most {largest} % at {plain(self.at)} Hz){own}"
        )

    @property
    def unlike(self) -> bool:
        """Whether the model has hardly anything of the modes: less than half of them, or far from them."""
        return 2 * self.paired < self.identified or self.typical > FAR


def frequency_errors(result: Mapping[str, Any]) -> FrequencyErrors | None:
    """The errors after the last stage of `result` (result.json) that compared modes; None where none did."""
    stages = [s for s in rows(result.get("stages")) if rows(s.get("modes"))]
    if not stages:
        return None
    modes = rows(stages[-1].get("modes"))
    told = [[number(m.get(k)) for k in ("freq", "model_freq", "mac", "freq_sd")] for m in modes]
    known = [(f, m, sd or math.nan) for f, m, mac, sd in told if f and m and mac is not None and mac > PAIRED]
    if not known:
        return FrequencyErrors(len(modes), 0, math.nan, math.nan, math.nan, math.nan, True)
    errors = [m / f - 1 for f, m, _ in known]
    scatter = [sd / f for f, _, sd in known]
    z = [abs(e) / math.hypot(s if math.isfinite(s) else 0.0, FORM) for e, s in zip(errors, scatter, strict=True)]
    worst = max(range(len(errors)), key=lambda i: abs(errors[i]))
    finite = [s for s in scatter if math.isfinite(s)]
    return FrequencyErrors(
        len(modes), len(known), median(map(abs, errors)), median(finite) if finite else math.nan, errors[worst],
        known[worst][0], median(z) > BEYOND,
    )  # fmt: skip
