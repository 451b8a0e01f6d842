"""Numbers as an engineer writes them: digits that mean something, prefixes, units, plus-minus.

Every function returns plain text; the page escapes it.
"""

from __future__ import annotations

import math

__all__ = ["factor_as_percent", "pretty_unit", "quantity", "ratio", "significant"]

_MINUS = "−"
_SUPERSCRIPT = str.maketrans("0123456789-n", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻ⁿ")
_LARGE = ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"))


def pretty_unit(unit: str) -> str:
    """`unit` with superscripts and dots: "N/m^3" gives "N/m³", "N*s/m" gives "N·s/m"."""
    out, i = "", 0
    text = unit.replace("**", "^").replace("*", "·")
    while i < len(text):
        if text[i] == "^":
            i += 1
            start = i
            while i < len(text) and (text[i].isdigit() or text[i] in "-n"):
                i += 1
            out += text[start:i].translate(_SUPERSCRIPT)
        else:
            out += text[i]
            i += 1
    return "" if out in ("1", "-") else out


def significant(value: float, digits: int = 3) -> str:
    """`value` with `digits` significant digits, without an exponent where that reads well.

    >>> significant(0.060249), significant(12345.6), significant(-2.5e-7)
    ('0.0602', '12300', '−2.50×10⁻⁷')
    """
    if not math.isfinite(value):
        return "not finite" if math.isnan(value) else ("∞" if value > 0 else f"{_MINUS}∞")
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if exponent < -4 or exponent > 6:
        mantissa = f"{value / 10.0**exponent:.{digits - 1}f}"
        return f"{mantissa}{_power_of_ten(exponent)}".replace("-", _MINUS)
    return _fixed(value, digits - 1 - exponent)


def ratio(value: float | None) -> str:
    """An NRMSE or another ratio near one: two significant digits, or an en dash where there is none.

    >>> ratio(0.0412), ratio(0.4), ratio(None)
    ('0.041', '0.40', '–')
    """
    if value is None or math.isnan(value):
        return "–"
    return significant(value, 2) if abs(value) < 10 else significant(value, 3)


def factor_as_percent(factor: float) -> str:
    """A factor of the deck's value as a change in percent.

    >>> factor_as_percent(1.031), factor_as_percent(0.9)
    ('+3.1 %', '−10.0 %')
    """
    change = (factor - 1.0) * 100.0
    if not math.isfinite(change):
        return "not finite"
    sign = "+" if change >= 0 else _MINUS
    return f"{sign}{abs(change):.{1 if abs(change) < 99.95 else 0}f} %"


def quantity(value: float, unit: str = "", sd: float | None = None) -> str:
    """`value` with its unit in a readable prefix, rounded to what `sd` supports (three digits without one).

    >>> quantity(5.4e4, "N/m", 2.0e3), quantity(6.3e-4, "m", 2e-5), quantity(0.81, "kg")
    ('54 ± 2 kN/m', '0.63 ± 0.02 mm', '0.810 kg')
    """
    known = sd is not None and math.isfinite(sd) and sd > 0
    if not math.isfinite(value):
        return f"{significant(value)} {pretty_unit(unit)}".strip()
    scale, name = _prefixed(value, unit)
    value = value / scale
    if not known or sd is None:
        return f"{significant(value)} {name}".strip()
    sd = sd / scale
    if abs(value) >= 1e7 and sd <= 0.5 * abs(value):
        exponent = math.floor(math.log10(abs(value)))
        value, sd = value / 10.0**exponent, sd / 10.0**exponent
        decimals = _decimals_of(sd)
        return f"({_fixed(value, decimals)} ± {_fixed(sd, decimals)}){_power_of_ten(exponent)} {name}".strip()
    if sd > 0.5 * abs(value) or abs(value) < 1e-4:  # digits of the value mean little or are many
        return f"{significant(value, 2)} ± {significant(sd, 1)} {name}".strip()
    decimals = _decimals_of(sd)
    return f"{_fixed(value, decimals)} ± {_fixed(sd, decimals)} {name}".strip()


def _power_of_ten(exponent: int) -> str:
    return f"×10{str(exponent).translate(_SUPERSCRIPT)}"


def _fixed(value: float, decimals: int) -> str:
    rounded = round(value, decimals)
    return f"{rounded:.{max(decimals, 0)}f}".replace("-", _MINUS)


def _decimals_of(sd: float) -> int:
    """Decimals that keep one digit of `sd`, or two where the first is a 1 (rounding 1.4 to 1 would lose a third)."""
    exponent = math.floor(math.log10(float(f"{sd:.0e}")))
    leading = sd / 10.0**exponent
    return -exponent + (1 if leading < 1.95 else 0)


def _prefixed(value: float, unit: str) -> tuple[float, str]:
    """Divisor and name of the unit that shows `value` best."""
    size, name = abs(value), pretty_unit(unit)
    if size == 0:
        return 1.0, name
    small = {"m": (1e-3, "mm"), "kg": (1e-3, "g"), "t": (1e-3, "kg"), "s": (1e-3, "ms"), "mm": (1e-3, "µm")}
    if name in small:
        divisor, better = small[name]
        limit = 0.01 if name == "mm" else 0.1 if name in ("kg", "s") else 1.0
        if name == "m" and size < 1e-5:
            return 1e-6, "µm"
        return (divisor, better) if size < limit else (1.0, name)
    if name.startswith(("N", "lbf", "Pa", "Hz")):
        for divisor, prefix in _LARGE:
            if size >= divisor and not name.startswith("lbf"):
                return divisor, prefix + name
        if name == "N" and size < 0.1:
            return 1e-3, "mN"
    return 1.0, name
