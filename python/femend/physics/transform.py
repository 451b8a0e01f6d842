"""Fit coordinates: law parameters as unbounded numbers of the size one, and back with derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.errors import LawParameterError
from femend.physics.entry import Physics
from femend.physics.free_form import smooth_coordinates

__all__ = ["FitCoordinates"]

Array = NDArray[np.float64]

# gamma/beta of Bouc and Wen in the open interval (-LOW, 1): at -1 nothing limits the force any more
_LOW = 0.95
# a bend of the free-form curves counts so many times as much as their slope
_STIFF = 10.0

# what stands for a positive number that underflows
SMALLEST = float(np.finfo(float).tiny)


class FitCoordinates:
    """Maps the parameters of one law to coordinates without bounds and back.

    Positive parameters go by their logarithm; a "real" one by the logarithm of its size with the sign it starts with (a
    change of sign is another start); a "signed" one as it is, in units of the largest of them at the start, those of
    the free-form law as slopes and bends of its curves with the bends stiffer; fractions by the logit, numbers above
    one by the logarithm of what is above. Bouc and Wen's beta and gamma go as the logarithm of the yield displacement
    (beta + gamma)^(-1/n) and an unbounded image of gamma/beta in (-0.95, 1), so that every coordinate gives a law that
    dissipates, and a change of n leaves the yield displacement alone. Parameters named in `fixed`, choices, and those
    that start on a bound stay where they are.
    """

    def __init__(self, physics: Physics, values: Mapping[str, float], fixed: Sequence[str] = ()) -> None:
        missing = [name for name in physics.parameter_names if name not in values]
        unknown = [name for name in (*values, *fixed) if name not in physics.parameter_names]
        if missing or unknown:
            what = f"{missing[0]} is not given" if missing else f"{unknown[0]} is not one of them"
            names = ", ".join(physics.parameter_names)
            wrong = (missing or unknown)[0]
            raise LawParameterError(
                f"{physics.name} has the parameters {names}; {what}", law=physics.name, parameter=wrong
            )
        self.physics = physics
        self._bouc_wen = physics.law == "bouc_wen"
        self.values = {name: float(values[name]) for name in physics.parameter_names}
        self._domain = {p.name: p.domain for p in physics.parameters}
        signed = [abs(self.values[p.name]) for p in physics.parameters if p.domain == "signed"]
        self._unit = max(signed, default=0.0) or 1.0
        self._signed = [p.name for p in physics.parameters if p.domain == "signed" and p.name not in fixed]
        whole = physics.law == "free_form" and len(self._signed) == len(signed)
        mix = smooth_coordinates(_STIFF) if whole else np.eye(len(self._signed))
        self._mix, self._back = mix / self._unit, np.linalg.inv(mix) * self._unit
        self.free = tuple(p.name for p in physics.parameters if p.name not in fixed and self._moves(p.name, p.domain))

    def _moves(self, name: str, domain: str) -> bool:
        value = self.values[name]
        if self._bouc_wen and name == "gamma":
            return True
        if domain == "signed":
            return True
        if domain == "positive":
            if value < 0:
                self._refuse(name, value, "more than zero")
            return value > 0
        if domain == "fraction":
            return 0 < value < 1
        if domain == "above_one":
            return value > 1
        return domain == "real" and value != 0

    def _refuse(self, name: str, value: float, need: str) -> None:
        raise LawParameterError(
            f"{self.physics.name}: {name} = {value:g}, it must be {need}", law=self.physics.name, parameter=name
        )

    def composite(self, values: Mapping[str, float]) -> list[tuple[str, dict[str, float]]]:
        """The core's laws whose sum the force is at parameter `values`: one."""
        return [(self.physics.law or self.physics.name, dict(values))]

    def start(self) -> Array:
        """Coordinates (n_free,) of the values this map was made with."""
        return self.coordinates(self.values)

    def coordinates(self, values: Mapping[str, float]) -> Array:
        """Coordinates (n_free,) of parameter values; the others are expected at their fixed values."""
        x = []
        signed = iter(self._mix @ np.array([float(values[name]) for name in self._signed]))
        for name in self.free:
            value, domain = float(values[name]), self._domain[name]
            if domain == "fraction":
                x.append(np.log(value / (1 - value)))
            elif domain == "above_one":
                x.append(np.log(value - 1))
            elif domain == "signed":
                x.append(next(signed))
            elif self._bouc_wen and name == "beta":
                x.append(-np.log(values["beta"] + values["gamma"]) / values["n"])
            elif self._bouc_wen and name == "gamma":
                ratio = 2 * (values["gamma"] / values["beta"] + _LOW) / (1 + _LOW) - 1
                x.append(np.arctanh(np.clip(ratio, -1 + 1e-6, 1 - 1e-6)))
            else:
                x.append(np.log(abs(value)))
        return np.array(x, dtype=float)

    def parameters(self, x: Array) -> dict[str, float]:
        """Parameter values at coordinates `x` (n_free,); positive ones are so where a number cannot hold how small they
        are."""
        p = self._map(np.asarray(x, dtype=float))[0]
        return {n: max(v, SMALLEST) if self._domain[n] == "positive" and n in self.free else v for n, v in p.items()}

    def jacobian(self, x: Array) -> Array:
        """dp/dx (n_p, n_free) at `x` (n_free,) with all parameters of the law in their order."""
        return self._map(np.asarray(x, dtype=float))[1]

    def array(self, x: Array) -> Array:
        """Parameter values (n_p,) at `x` (n_free,), in the order in which the core takes them."""
        p = self.parameters(x)
        return np.array([p[name] for name in self.physics.parameter_names])

    def _map(self, x: Array) -> tuple[dict[str, float], Array]:
        names = self.physics.parameter_names
        p = dict(self.values)
        jacobian = np.zeros((len(names), len(self.free)))
        for column, name in enumerate(self.free):
            if self._bouc_wen and name in ("beta", "gamma"):
                continue
            row, domain = names.index(name), self._domain[name]
            if domain == "fraction":
                p[name] = float(1 / (1 + np.exp(-x[column])))
                jacobian[row, column] = p[name] * (1 - p[name])
            elif domain == "above_one":
                p[name] = float(1 + np.exp(x[column]))
                jacobian[row, column] = p[name] - 1
            elif domain == "signed":
                continue
            else:
                p[name] = float(np.copysign(np.exp(x[column]), self.values[name]))
                jacobian[row, column] = p[name]
        if self._signed:
            rows, columns = ([of.index(name) for name in self._signed] for of in (names, self.free))
            p.update(zip(self._signed, (self._back @ x[columns]).tolist(), strict=True))
            jacobian[np.ix_(rows, columns)] = self._back
        if self._bouc_wen and {"beta", "gamma", "n"} & set(self.free):
            self._map_bouc_wen(x, p, jacobian)
        return p, jacobian

    def _map_bouc_wen(self, x: Array, p: dict[str, float], jacobian: Array) -> None:
        start = self.values
        names, free = self.physics.parameter_names, self.free
        n = p["n"]
        ln_yield = -np.log(start["beta"] + start["gamma"]) / start["n"]
        ratio, slope = start["gamma"] / start["beta"], 0.0
        if "beta" in free:
            ln_yield = x[free.index("beta")]
        if "gamma" in free:
            t = np.tanh(x[free.index("gamma")])
            ratio = -_LOW + (1 + _LOW) * (1 + t) / 2
            slope = (1 + _LOW) * (1 - t * t) / 2
        total = np.exp(-n * ln_yield)
        beta = total / (1 + ratio)
        p["beta"], p["gamma"] = float(beta), float(ratio * beta)
        rows = [names.index("beta"), names.index("gamma")]
        share = np.array([beta, ratio * beta])
        if "beta" in free:
            jacobian[rows, free.index("beta")] = -n * share
        if "n" in free:
            column = free.index("n")
            jacobian[rows, column] = -ln_yield * share * (n - 1)
        if "gamma" in free:
            over = np.array([-total, total]) / (1 + ratio) ** 2
            jacobian[rows, free.index("gamma")] = over * slope
