"""Names that are announced exist, and public functions say what they take and what they raise."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import femend


def announced(modules: list[ModuleType]) -> Iterator[tuple[str, Any]]:
    """Each class and function in an `__all__`, once, by the name under which it is defined."""
    seen: set[int] = set()
    for module in modules:
        for name in getattr(module, "__all__", ()):
            thing = getattr(module, name)
            if (inspect.isclass(thing) or inspect.isroutine(thing)) and id(thing) not in seen:
                seen.add(id(thing))
                yield f"{thing.__module__}.{thing.__qualname__}", thing


def public_functions(modules: list[ModuleType]) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Announced functions, and the public methods that announced classes define themselves."""
    for label, thing in announced(modules):
        if not inspect.isclass(thing):
            yield label, thing
            continue
        for name, member in vars(thing).items():
            function = inspect.unwrap(member.__func__) if isinstance(member, (classmethod, staticmethod)) else member
            if not name.startswith("_") and inspect.isfunction(function):
                yield f"{label}.{name}", function


def parameters_not_named(function: Callable[..., Any]) -> list[str]:
    """Parameters that the docstring does not mention by name."""
    doc = function.__doc__ or ""
    names = [name for name in inspect.signature(function).parameters if name not in {"self", "cls"}]
    return [name for name in names if not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", doc)]


def exceptions_not_named(function: Callable[..., Any]) -> list[str]:
    """Exceptions raised in the function's own body that the docstring does not mention."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    raised = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node.exc is not None:
            target = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            name = target.attr if isinstance(target, ast.Attribute) else getattr(target, "id", "")
            if name.endswith(("Error", "Exception")):
                raised.add(name)
    return sorted(name for name in raised if name not in (function.__doc__ or ""))


def arrays_not_named(label: str, function: Callable[..., Any]) -> list[str]:
    """Array parameters that the docstring does not mention; the page's drawing code is left to its own words."""
    if label.startswith("femend.report."):
        return []
    arrays = {name for name, one in inspect.signature(function).parameters.items() if "Array" in str(one.annotation)}
    return [name for name in parameters_not_named(function) if name in arrays]


def test_every_announced_name_exists(public_modules: list[ModuleType]) -> None:
    missing = [
        f"{module.__name__}.{name}"
        for module in public_modules
        for name in getattr(module, "__all__", ())
        if not hasattr(module, name)
    ]
    assert missing == []


def test_every_module_says_what_it_is(public_modules: list[ModuleType]) -> None:
    assert [module.__name__ for module in public_modules if not (module.__doc__ or "").strip()] == []


def test_everything_announced_has_a_docstring(public_modules: list[ModuleType]) -> None:
    things = [*announced(public_modules), *public_functions(public_modules)]
    assert sorted({label for label, thing in things if not (thing.__doc__ or "").strip()}) == []


def test_front_door_functions_name_their_parameters() -> None:
    wrong = {label: parameters_not_named(function) for label, function in public_functions([femend])}
    assert {label: names for label, names in wrong.items() if names} == {}


def test_public_functions_name_their_arrays(public_modules: list[ModuleType]) -> None:
    wrong = {label: arrays_not_named(label, function) for label, function in public_functions(public_modules)}
    assert {label: names for label, names in wrong.items() if names} == {}


def test_no_announced_name_hides_a_package(public_modules: list[ModuleType]) -> None:
    # Importing femend.x sets the attribute x of femend: a function of that name would work until then, and not after.
    packages = {module.__name__.split(".")[1] for module in public_modules if "." in module.__name__}
    assert packages.isdisjoint(femend.__all__)


def test_public_functions_name_what_they_raise(public_modules: list[ModuleType]) -> None:
    wrong = {label: exceptions_not_named(function) for label, function in public_functions(public_modules)}
    assert {label: names for label, names in wrong.items() if names} == {}


def test_the_checks_see_what_is_missing() -> None:
    def careless(freq: float, n_modes: int) -> None:
        """Uses `freq`."""
        raise femend.errors.UnitError(f"{n_modes}")

    def drawn(x: NDArray[np.float64], width: int) -> None:
        """Draws."""

    assert parameters_not_named(careless) == ["n_modes"]
    assert arrays_not_named("femend.data.drawn", drawn) == ["x"]
    assert exceptions_not_named(careless) == ["UnitError"]
