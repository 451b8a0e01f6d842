"""What to do about a study file that is not valid TOML: the line, and the mistakes that are made most."""

from __future__ import annotations

import re
from pathlib import Path

__all__ = ["toml_hint"]

_LINE = re.compile(r"\(at line (\d+), column \d+\)")
# a number that begins or ends with its point, not inside quotes
_BARE_POINT = re.compile(r"^[^\"'#]*?(?<![\d.])(?:\d+\.(?![\d.])|\.\d)")


def toml_hint(said: str, file: Path) -> str:
    """The line of `file` that the parser's message `said` names, and what mends it where that is plain."""
    at = _LINE.search(said)
    if at is None:
        return ""
    lines = file.read_bytes().decode("utf-8-sig").splitlines()
    text = lines[int(at[1]) - 1].strip() if int(at[1]) <= len(lines) else ""
    value = text.partition("=")[2].strip()
    if "\\" in value:
        hint = "; write paths with / or in single quotes"
    elif re.match(r"[A-Za-z_]", value):
        hint = "; text stands in quotes"
    elif _BARE_POINT.search(value):
        hint = "; a decimal point stands between digits: 5.0, not 5. or .5"
    elif re.match(r"[\d.+-]*\d,\d", value):
        hint = "; decimals have a point"
    elif re.match(r"[\d.+-]+\s*%", value):
        hint = "; shares are numbers, 1 % is 0.01"
    else:
        hint = ""
    return f": {text[:80]!r}{hint}" if text else ""
