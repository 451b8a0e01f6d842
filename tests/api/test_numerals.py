"""Sentences write their numbers without exponents where an engineer would."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from femend.numerals import plain

# up to four digits: from 10000 on, an exponent is what comes out
_SHORT = re.compile(r"\{[^{}]+:[+]?\.[1-4]g\}")
# rounding on the way to a number is no text
_ROUNDING = re.compile(r"float\(f(['\"])\{[^{}]+\}\1\)")


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0, 3, "0"),
        (1e-5, 3, "1e-05"),
        (0.00025, 3, "0.00025"),
        (99.96, 3, "100"),
        (999.4, 3, "999"),
        (999.5, 3, "1000"),
        (1006.0, 3, "1010"),
        (43127.0, 2, "43000"),
        (-1500.0, 3, "-1500"),
        (9_999_499.0, 4, "9999000"),
        (9_999_500.0, 4, "1e+07"),
        (7e16, 3, "7e+16"),
        (float("inf"), 3, "inf"),
        (float("nan"), 3, "nan"),
    ],
)
def test_numbers_of_everyday_size_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert plain(value, digits) == text


def test_numbers_in_sentences_go_through_it(package_root: Path) -> None:
    found = {}
    for path in sorted(package_root.rglob("*.py")):
        name = path.relative_to(package_root).as_posix()
        short = _SHORT.findall(_ROUNDING.sub("", path.read_text(encoding="utf-8")))
        if short:
            found[name] = short
    assert found == {}


def test_lists_that_are_cut_off_are_made_in_one_place(package_root: Path) -> None:
    """`listed` says how many there are more."""
    cut = re.compile(r"\band \{[^{}]*(?:len\(|more)[^{}]*\} more\b")
    own = [p.name for p in package_root.rglob("*.py") if cut.search(p.read_text(encoding="utf-8"))]
    assert sorted(own) == ["numerals.py", "tacho.py"]  # notes of a tacho are a sequence and no sentence
