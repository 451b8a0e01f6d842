"""The extension module tells its signatures; without them the stub cannot be compared with what was compiled."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from femend import _core


def compiled_functions() -> Iterator[tuple[str, Any]]:
    """Functions of `_core`, and the public methods of its classes."""
    for name, thing in vars(_core).items():
        if inspect.isclass(thing):
            for method, member in vars(thing).items():
                if not method.startswith("_") and inspect.isroutine(member):
                    # by getattr, since a static method stands in the class as a wrapper without a signature
                    yield f"{name}.{method}", getattr(thing, method)
        elif inspect.isroutine(thing):
            yield name, thing


def test_every_compiled_function_tells_its_signature() -> None:
    silent = [name for name, function in compiled_functions() if getattr(function, "__text_signature__", None) is None]
    assert silent == []


def test_every_compiled_function_has_a_docstring() -> None:
    assert [name for name, function in compiled_functions() if not (function.__doc__ or "").strip()] == []
