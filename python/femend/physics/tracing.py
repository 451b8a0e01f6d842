"""Recording a formula: a Python function is called once with stand-ins, and what it does with them is written down.

The core evaluates the record with exact derivatives and without the interpreter. A function that branches on its
arguments (`if d > 0`) cannot be recorded; `numpy.where` can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

__all__ = ["NotRecordable", "record"]

Operation = tuple[str, list[int], float]


class NotRecordable(TypeError):
    """A function that does something that the record has no operation for."""


class _Traced:
    """A number that is not known yet; what is done with it is appended to `ops`."""

    __slots__ = ("at", "ops")
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, ops: list[Operation], at: int) -> None:
        self.ops = ops
        self.at = at

    def _lift(self, x: Any) -> _Traced:
        if isinstance(x, _Traced):
            return x
        if isinstance(x, (bool, int, float, np.number, np.bool_)) or (isinstance(x, np.ndarray) and x.ndim == 0):
            return _append(self.ops, "constant", [], float(x))
        raise NotRecordable(f"a value of type {type(x).__name__} stands in the formula; use plain numbers")

    def _do(self, name: str, *others: Any, value: float = 0.0) -> _Traced:
        return _append(self.ops, name, [self.at, *(self._lift(o).at for o in others)], value)

    def __add__(self, x: Any) -> _Traced:
        return self._do("add", x)

    __radd__ = __add__

    def __sub__(self, x: Any) -> _Traced:
        return self._do("subtract", x)

    def __rsub__(self, x: Any) -> _Traced:
        return self._lift(x) - self

    def __mul__(self, x: Any) -> _Traced:
        return self._do("multiply", x)

    __rmul__ = __mul__

    def __truediv__(self, x: Any) -> _Traced:
        return self._do("divide", x)

    def __rtruediv__(self, x: Any) -> _Traced:
        return self._lift(x) / self

    def __pow__(self, x: Any) -> _Traced:
        if not isinstance(x, _Traced) and float(x).is_integer() and abs(float(x)) <= 32:
            return self._do("power_integer", value=float(x))
        return self._do("power", x)

    def __rpow__(self, x: Any) -> _Traced:
        return self._lift(x) ** self

    def __neg__(self) -> _Traced:
        return self._do("negative")

    def __pos__(self) -> _Traced:
        return self

    def __abs__(self) -> _Traced:
        return self._do("absolute")

    def __lt__(self, x: Any) -> _Traced:
        return self._do("less", x)

    def __le__(self, x: Any) -> _Traced:
        return self._do("less_equal", x)

    def __gt__(self, x: Any) -> _Traced:
        return self._lift(x) < self

    def __ge__(self, x: Any) -> _Traced:
        return self._lift(x) <= self

    def __and__(self, x: Any) -> _Traced:
        return self * x

    __rand__ = __and__

    def __or__(self, x: Any) -> _Traced:
        return self._do("maximum", x)

    __ror__ = __or__

    def __invert__(self) -> _Traced:
        return 1.0 - self

    def __eq__(self, x: object) -> bool:
        raise NotRecordable("two values are compared with ==")

    def __bool__(self) -> bool:
        raise NotRecordable(
            "the function branches on its arguments (if, and, or, min, max); numpy.where can be recorded"
        )

    def __float__(self) -> float:
        raise NotRecordable("a function of the math module is called; those of numpy can be recorded")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> _Traced:
        name = ufunc.__name__
        if method != "__call__" or options:
            raise NotRecordable(f"numpy.{name}.{method} cannot be recorded")
        arguments = [self._lift(x) if not isinstance(x, _Traced) else x for x in inputs]
        if name in ("power", "float_power") and not isinstance(inputs[1], _Traced):
            return arguments[0] ** inputs[1]
        if name in _PLAIN:
            return arguments[0]._do(_PLAIN[name], *arguments[1:])
        if name in _COMPOSED:
            return _COMPOSED[name](*arguments)
        raise NotRecordable(f"numpy.{name} cannot be recorded")

    def __array_function__(self, function: Any, types: Any, inputs: Sequence[Any], options: dict[str, Any]) -> _Traced:
        if function is np.where and len(inputs) == 3 and not options:
            condition, yes, no = (self._lift(x) for x in inputs)
            return condition._do("where", yes, no)
        if function is np.clip and len(inputs) == 3 and not options:
            x, low, high = (self._lift(x) for x in inputs)
            return x._do("maximum", low)._do("minimum", high)
        raise NotRecordable(f"numpy.{function.__name__} cannot be recorded")


_PLAIN = {
    "add": "add", "subtract": "subtract", "multiply": "multiply", "divide": "divide", "true_divide": "divide",
    "power": "power", "float_power": "power", "negative": "negative", "absolute": "absolute", "fabs": "absolute",
    "sign": "sign", "exp": "exp", "log": "log", "sqrt": "sqrt", "sin": "sin", "cos": "cos", "tanh": "tanh",
    "arctan": "arctan", "minimum": "minimum", "maximum": "maximum", "fmin": "minimum", "fmax": "maximum",
    "less": "less", "less_equal": "less_equal",
}  # fmt: skip
_COMPOSED: dict[str, Callable[..., _Traced]] = {
    "greater": lambda x, y: y._do("less", x),
    "greater_equal": lambda x, y: y._do("less_equal", x),
    "positive": lambda x: x,
    "square": lambda x: x * x,
    "reciprocal": lambda x: 1.0 / x,
    "tan": lambda x: x._do("sin") / x._do("cos"),
    "sinh": lambda x: 0.5 * (x._do("exp") - (-x)._do("exp")),
    "cosh": lambda x: 0.5 * (x._do("exp") + (-x)._do("exp")),
    "log1p": lambda x: (1.0 + x)._do("log"),
    "expm1": lambda x: x._do("exp") - 1.0,
    "hypot": lambda x, y: (x * x + y * y)._do("sqrt"),
    "copysign": lambda x, y: abs(x)._do("multiply", (y >= 0.0)._do("where", 1.0, -1.0)),
    "logical_and": lambda x, y: x * y,
    "logical_or": lambda x, y: x._do("maximum", y),
    "logical_not": lambda x: 1.0 - x,
}


def _append(ops: list[Operation], name: str, at: list[int], value: float = 0.0) -> _Traced:
    ops.append((name, at, value))
    return _Traced(ops, len(ops) - 1)


def record(function: Callable[..., Sequence[Any]], n_inputs: int) -> tuple[list[Operation], list[int]]:
    """The operations of `function` of `n_inputs` numbers, and where its results stand among them.

    Raises NotRecordable.

    >>> record(lambda d, v: [abs(d) * v], 2)
    ([('input', [0], 0.0), ('input', [1], 0.0), ('absolute', [0], 0.0), ('multiply', [2, 1], 0.0)], [3])
    """
    ops: list[Operation] = []
    inputs = []
    for i in range(n_inputs):
        ops.append(("input", [i], 0.0))
        inputs.append(_Traced(ops, i))
    return ops, [inputs[0]._lift(result).at for result in function(*inputs)]
