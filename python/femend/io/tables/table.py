"""Columns of a file, whatever its format."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["STEP_NAMES", "Table", "step_from"]

_REAL, _IMAGINARY = r"(?:real|re)(?![a-z])", r"(?:imaginary|imag|im)(?![a-z])"
_MAGNITUDE, _PHASE = r"(?:magnitude|mag|amplitude|amp|abs)(?![a-z])", r"(?:phase|arg|angle)(?![a-z])"
_UNIT = r"\s*(?:[\[(](?P<unit>[^\])]*)[\])])?"
# Scalars that state the sampling: a step in s, or a rate in Hz.
STEP_NAMES = {
    "dt": 1,
    "delta_t": 1,
    "wf_increment": 1,
    "timestep": 1,
    "fs": -1,
    "samplerate": -1,
    "sample_rate": -1,
    "sampling_rate": -1,
    "samplingrate": -1,
    "sampling_frequency": -1,
}


def step_from(name: str, value: Any) -> float | None:
    """The time step in s that a scalar `value` called `name` states (dt, fs, sample_rate, ...); None for others."""
    sign = STEP_NAMES.get(name.rsplit("/", 1)[-1].rsplit(".", 1)[-1].strip().lower().replace(" ", "_"))
    if sign is None:
        return None
    try:
        number = float(np.asarray(value).ravel()[0])
    except (TypeError, ValueError, IndexError):
        return None
    return float(number**sign) if np.isfinite(number) and number > 0 else None


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of the file `file`: `names` and `columns` (real or complex, each (n,)), and the step `dt` in s if stated.

    Columns may differ in length; those that are used together must not. `notes` say what was passed over.
    """

    file: str
    names: tuple[str, ...]
    columns: tuple[NDArray[Any], ...]
    dt: float | None = None
    notes: tuple[str, ...] = ()

    def with_pairs(self) -> Table:
        """The table with a complex column after the others for each pair x_re/x_im and x_mag/x_phase.

        The phase is in degrees unless its name says rad; a magnitude in dB is 20 log10.
        """
        names, columns = list(self.names), list(self.columns)
        for first, second, polar in ((_REAL, _IMAGINARY, False), (_MAGNITUDE, _PHASE, True)):
            parts = _parts(self.names, first), _parts(self.names, second)
            for base, (i, unit) in parts[0].items():
                if base not in parts[1] or base in names:
                    continue
                k, phase_unit = parts[1][base]
                a, b = self.columns[i], self.columns[k]
                if a.shape != b.shape or np.iscomplexobj(a) or np.iscomplexobj(b):
                    continue
                if polar:
                    size = 10.0 ** (a / 20) if unit.lower() == "db" else a
                    column = size * np.exp(1j * (b if phase_unit.lower() == "rad" else np.deg2rad(b)))
                else:
                    column = a + 1j * b
                names.append(base)
                columns.append(column)
        return Table(self.file, tuple(names), tuple(columns), self.dt, self.notes)


def _parts(names: tuple[str, ...], part: str) -> dict[str, tuple[int, str]]:
    """Base name -> (column, unit) of the columns that are called `part` of something."""
    found: dict[str, tuple[int, str]] = {}
    for i, name in enumerate(names):
        for form in (
            rf"(?P<base>.*?)[\s_.\-:]+\(?{part}\)?{_UNIT}",
            rf"{part}[\s_.\-:]*\(?(?P<base>[^()]+?)\)?{_UNIT}",
        ):
            match = re.fullmatch(form, name.strip(), re.IGNORECASE)
            if match is not None and match["base"].strip():
                found.setdefault(match["base"].strip(), (i, match["unit"] or ""))
                break
    return found
