"""The examples in the docstrings give the answers they show."""

from __future__ import annotations

import doctest
from types import ModuleType


def test_examples_in_docstrings(public_modules: list[ModuleType]) -> None:
    failed = {}
    for module in public_modules:
        outcome = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
        if outcome.failed:
            failed[module.__name__] = f"{outcome.failed} of {outcome.attempted}"
    assert failed == {}
