"""What is said of a value of the wrong type in a study file."""

from __future__ import annotations

import re
from typing import Any

__all__ = ["wrong_type"]

# what the contract's types are called in a study file, and how they are written there
_WRITTEN = {
    "float": ("a number", "0.1, without quotes"),
    "int": ("a whole number", "3, without quotes"),
    "str": ("text", '"text", in quotes'),
    "bool": ("true or false", "true, without quotes"),
    "array": ("a list", "[1, 2], in brackets"),
    "object": ("a table", '{ name = "value" }, in braces'),
}


def _found_at(data: Any, path: str) -> Any:
    """The value at a path such as ``parameter[0].prior_sd`` in what a study file holds."""
    for key, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path):
        data = data[int(index)] if index else data[key]
    return data


def wrong_type(text: str, data: Any, path: str) -> str:
    """The message for a value that is not of the contract's type, from msgspec's words for it; those themselves where
    they say something else.

    >>> wrong_type("Expected `float | null`, got `str`", {"ratio": "2 %"}, "ratio")
    "'2 %' is not a number; write it as 0.02, without quotes"
    >>> wrong_type("Object missing required field `file`", {}, "")
    "the key 'file' is missing; add it"
    """
    missing = re.fullmatch(r"Object missing required field `(.*)`", text)
    if missing:
        what = 'format = "femend-study/1"' if missing[1] == "format" else "it"
        return f"the key {missing[1]!r} is missing; add {what}"
    match = re.fullmatch(r"Expected `(.*?)`, got `.*`", text)
    kinds = [k for k in match[1].split(" | ") if k in _WRITTEN] if match else []
    if not kinds:
        return text
    names, ways = zip(*(_WRITTEN[k] for k in kinds), strict=True)
    value = _found_at(data, path)
    shown = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    meant = _number_in(value, kinds[0])
    return f"{shown} is not {' or '.join(names)}; write it as {meant or ' or '.join(ways)}"


def _number_in(value: Any, kind: str) -> str | None:
    """How the number of a `kind` is written that a text `value` holds, one in per cent as a share, a decimal comma as a
    point; None where it holds none."""
    pattern = {"int": r"\s*([+-]?\d+)()\s*", "float": r"\s*([+-]?\d+(?:[.,]\d+)?)\s*(%?)\s*"}.get(kind)
    match = re.fullmatch(pattern, value) if pattern is not None and isinstance(value, str) else None
    if match is None:
        return None
    number = match[1].replace(",", ".")
    return f"{float(number) / 100:g}, without quotes" if match[2] else f"{number}, without quotes"
