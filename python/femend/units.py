"""Unit systems of models and units of channels. Everything is converted once, on reading; no flag changes a unit.

A unit is a factor to SI and exponents of metre, kilogram, second and volt. Angles are pure numbers.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from femend.errors import UnitError

__all__ = [
    "QUANTITIES",
    "ROTATIONAL",
    "SYSTEMS",
    "Unit",
    "UnitSystem",
    "parse_unit",
    "quantity_factor",
    "quantity_of",
    "unit_system",
]

Dims = tuple[int, int, int, int]

# Exponents of (m, kg, s, V).
QUANTITIES: dict[str, Dims] = {
    "displacement": (1, 0, 0, 0),
    "velocity": (1, 0, -1, 0),
    "acceleration": (1, 0, -2, 0),
    "force": (1, 1, -2, 0),
    "moment": (2, 1, -2, 0),
    "rotation": (0, 0, 0, 0),
    "angular_velocity": (0, 0, -1, 0),
    "angular_acceleration": (0, 0, -2, 0),
    "strain": (0, 0, 0, 0),
    "pressure": (-1, 1, -2, 0),
    "length": (1, 0, 0, 0),
    "mass": (0, 1, 0, 0),
    "inertia": (2, 1, 0, 0),
    "time": (0, 0, 1, 0),
    "frequency": (0, 0, -1, 0),
    "stiffness": (0, 1, -2, 0),
    "rotational_stiffness": (2, 1, -2, 0),
    "damping": (0, 1, -1, 0),
    "quadratic_damping": (-1, 1, 0, 0),
    "cubic_stiffness": (-2, 1, -2, 0),
    "density": (-3, 1, 0, 0),
    "voltage": (0, 0, 0, 1),
    "tacho": (0, 0, 0, 1),
    "ratio": (0, 0, 0, 0),
}
ROTATIONAL = {
    "displacement": "rotation",
    "velocity": "angular_velocity",
    "acceleration": "angular_acceleration",
    "force": "moment",
}


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit: `factor` to SI (SI value = factor * value) and exponents `dims` of m, kg, s, V."""

    text: str
    factor: float
    dims: Dims


@dataclass(frozen=True, slots=True)
class UnitSystem:
    """A consistent set of units: `length`, `mass`, `time` as factors to SI, and how they are written."""

    name: str
    length: float
    mass: float
    time: float
    length_text: str
    force_text: str
    mass_text: str

    def factor(self, quantity: str) -> float:
        """SI value of one unit of `quantity` in this system; raises UnitError for an unknown quantity."""
        length, mass, time, _ = _dims(quantity)
        return self.length**length * self.mass**mass * self.time**time

    def text(self, quantity: str, *, rotational: bool = False) -> str:
        """How the unit of `quantity` is written in this system, such as ``mm/s^2``."""
        quantity = ROTATIONAL.get(quantity, quantity) if rotational else quantity
        _dims(quantity)
        length, force, mass = self.length_text, self.force_text, self.mass_text
        table = {
            "displacement": length,
            "length": length,
            "velocity": f"{length}/s",
            "acceleration": f"{length}/s^2",
            "force": force,
            "moment": f"{force}*{length}",
            "rotation": "rad",
            "angular_velocity": "rad/s",
            "angular_acceleration": "rad/s^2",
            "strain": "1",
            "ratio": "1",
            "pressure": f"{force}/{length}^2",
            "mass": mass,
            "inertia": f"{mass}*{length}^2",
            "time": "s",
            "frequency": "Hz",
            "stiffness": f"{force}/{length}",
            "rotational_stiffness": f"{force}*{length}/rad",
            "damping": f"{force}*s/{length}",
            "quadratic_damping": f"{force}*s^2/{length}^2",
            "cubic_stiffness": f"{force}/{length}^3",
            "density": f"{mass}/{length}^3",
            "voltage": "V",
            "tacho": "V",
        }
        return table[quantity]


_INCH, _LBF = 0.0254, 4.4482216152605
SYSTEMS: dict[str, UnitSystem] = {
    "SI": UnitSystem("SI", 1.0, 1.0, 1.0, "m", "N", "kg"),
    "mm-t-s": UnitSystem("mm-t-s", 1e-3, 1e3, 1.0, "mm", "N", "t"),
    "in-lbf-s": UnitSystem("in-lbf-s", _INCH, _LBF / _INCH, 1.0, "in", "lbf", "lbf*s^2/in"),
}


def unit_system(name: str) -> UnitSystem:
    """The unit system "SI", "mm-t-s" or "in-lbf-s"; raises UnitError for another name."""
    try:
        return SYSTEMS[name]
    except KeyError:
        raise UnitError(f"units {name!r} are unknown; use one of {', '.join(SYSTEMS)}") from None


def _dims(quantity: str) -> Dims:
    try:
        return QUANTITIES[quantity]
    except KeyError:
        raise UnitError(f"quantity {quantity!r} is unknown; known are {', '.join(QUANTITIES)}") from None


_G = 9.80665
_BASE: dict[str, tuple[float, Dims]] = {
    "m": (1.0, (1, 0, 0, 0)),
    "in": (_INCH, (1, 0, 0, 0)),
    "inch": (_INCH, (1, 0, 0, 0)),
    "ft": (0.3048, (1, 0, 0, 0)),
    "mil": (_INCH / 1000, (1, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "sec": (1.0, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "g": (_G, (1, 0, -2, 0)),
    "gn": (_G, (1, 0, -2, 0)),
    "kg": (1.0, (0, 1, 0, 0)),
    "t": (1e3, (0, 1, 0, 0)),
    "lbm": (0.45359237, (0, 1, 0, 0)),
    "slug": (_LBF / 0.3048, (0, 1, 0, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "Nm": (1.0, (2, 1, -2, 0)),
    "kgf": (_G, (1, 1, -2, 0)),
    "lbf": (_LBF, (1, 1, -2, 0)),
    "lb": (_LBF, (1, 1, -2, 0)),
    "kip": (1000 * _LBF, (1, 1, -2, 0)),
    "Pa": (1.0, (-1, 1, -2, 0)),
    "psi": (_LBF / _INCH**2, (-1, 1, -2, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "rad": (1.0, (0, 0, 0, 0)),
    "deg": (math.pi / 180, (0, 0, 0, 0)),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 0)),
    "V": (1.0, (0, 0, 0, 1)),
    "1": (1.0, (0, 0, 0, 0)),
    "strain": (1.0, (0, 0, 0, 0)),
    "%": (0.01, (0, 0, 0, 0)),
}
_PREFIX = {"k": 1e3, "M": 1e6, "G": 1e9, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9}
_PREFIXED = ("m", "s", "g", "N", "Pa", "V", "Hz", "rad", "strain")
_TRANSLATE = str.maketrans({"²": "^2", "³": "^3", "¹": "^1", "⁻": "^-", "°": "deg"})


def _base(symbol: str, text: str) -> tuple[float, Dims]:
    for name in (symbol, symbol if symbol.isupper() and len(symbol) > 1 else ""):
        if name in _BASE:
            return _BASE[name]
    if symbol[0] in _PREFIX and symbol[1:] in _PREFIXED:
        factor, dims = _BASE[symbol[1:]]
        return _PREFIX[symbol[0]] * factor, dims
    if symbol in ("ue", "uE", "µe", "με"):
        return 1e-6, (0, 0, 0, 0)
    lower = {k.lower(): k for k in _BASE if len(k) > 1 or k in "NVG"}
    if symbol.lower() in lower and symbol.lower() not in ("mm",):
        return _BASE[lower[symbol.lower()]]
    raise UnitError(f"unit {text!r}: {symbol!r} is unknown; write it with {', '.join(sorted(set(_BASE) - {'1', '%'}))}")


class _Parser:
    """Recursive descent over ``factor (('*'|'/'|' ') factor)*`` with powers and parentheses."""

    def __init__(self, text: str) -> None:
        self.text = text
        cleaned = text.strip().translate(_TRANSLATE).replace("^-^", "^-")
        self.tokens = re.findall(r"[A-Za-zµμε%]+|\^|\*\*|[*·.×/()]|[+-]?\d+", cleaned)
        if "".join(self.tokens) != re.sub(r"\s+", "", cleaned) or not self.tokens:
            raise UnitError(f"unit {text!r} cannot be read; write it like 'm/s^2', 'g', 'mm', 'lbf' or 'N'")
        self.at = 0

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def product(self) -> tuple[float, Dims]:
        factor, dims = self.power()
        while self.peek() and self.peek() != ")":
            sign = 1
            if self.peek() in ("*", "·", ".", "×", "/"):
                sign = -1 if self.peek() == "/" else 1
                self.at += 1
            f, d = self.power()
            factor *= f**sign
            dims = (dims[0] + sign * d[0], dims[1] + sign * d[1], dims[2] + sign * d[2], dims[3] + sign * d[3])
        return factor, dims

    def power(self) -> tuple[float, Dims]:
        token = self.peek()
        self.at += 1
        if token == "(":
            factor, dims = self.product()
            if self.peek() != ")":
                raise UnitError(f"unit {self.text!r}: a parenthesis is not closed")
            self.at += 1
        elif token and (token == "1" or token[0].isalpha() or token == "%"):
            factor, dims = _base(token, self.text)
        else:
            raise UnitError(f"unit {self.text!r} cannot be read at {token!r}; write it like 'm/s^2'")
        n = self.exponent()
        return factor**n, (dims[0] * n, dims[1] * n, dims[2] * n, dims[3] * n)

    def exponent(self) -> int:
        if self.peek() in ("^", "**"):
            self.at += 1
            if not re.fullmatch(r"[+-]?\d+", self.peek()):
                raise UnitError(f"unit {self.text!r}: the exponent {self.peek()!r} is not an integer")
        elif not re.fullmatch(r"[+-]?[2-9]", self.peek()):  # m/s2 stands for m/s^2
            return 1
        self.at += 1
        return int(self.tokens[self.at - 1])


def parse_unit(text: str) -> Unit:
    """The unit written as `text`, such as ``m/s^2``, ``g``, ``um``, ``lbf``, ``(m/s2)/N``; ``g`` is gravity.

    Raises UnitError for text that is not a unit.

    >>> parse_unit("mm/s^2").factor
    0.001
    """
    parser = _Parser(text)
    factor, dims = parser.product()
    if parser.at != len(parser.tokens):
        raise UnitError(f"unit {text!r} cannot be read at {parser.peek()!r}; write it like 'm/s^2'")
    return Unit(text, factor, dims)


def quantity_factor(quantity: str, unit: str, *, rotational: bool = False) -> float:
    """Factor from `unit` to SI for a channel of `quantity`; rotational channels take rad and N m instead of m and N.

    Raises UnitError where the unit does not measure the quantity. A tacho takes any unit, with factor 1.
    """
    if quantity == "tacho":
        return 1.0
    expected = _dims(ROTATIONAL.get(quantity, quantity) if rotational else quantity)
    parsed = parse_unit(unit)
    if parsed.dims != expected:
        si = SYSTEMS["SI"].text(quantity, rotational=rotational)
        raise UnitError(f"unit {unit!r} does not measure {quantity}; use a unit such as {si!r}")
    return parsed.factor


def quantity_of(unit: str) -> str | None:
    """The channel quantity a unit measures: displacement, velocity, acceleration, force; None where it is another."""
    try:
        dims = parse_unit(unit).dims
    except UnitError:
        return None
    for quantity in ("displacement", "velocity", "acceleration", "force", "pressure", "voltage"):
        if QUANTITIES[quantity] == dims:
            return quantity
    return None
