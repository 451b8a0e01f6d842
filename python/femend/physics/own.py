"""Laws of one's own: a force function and its parameters, checked, and from then on laws like the catalogue's."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import LawParameterError
from femend.physics.catalogue import add
from femend.physics.entry import FAMILIES, Domain, Parameter, Physics
from femend.physics.own_check import check, scaling, states_along
from femend.physics.tracing import record
from femend.units import parse_unit

__all__ = ["register"]

Array = NDArray[np.float64]
_DOMAINS = ("real", "positive", "fraction", "above_one")


def register(
    name: str,
    force: Callable[..., Any],
    parameters: Mapping[str, tuple[Any, ...]],
    *,
    family: str = "nonlinear elastic",
    left_out: str = "",
    state: Sequence[str] = (),
    rate: Callable[..., Any] | None = None,
    derivatives: Callable[..., Mapping[str, float]] | None = None,
    amplitude: float = 1e-3,
    speed: float = 0.1,
) -> Physics:
    """Makes a law known by `name`, to be simulated, fitted and compared like any other; registering again replaces it.

    `force(d, v, k=..., ...)` gives the force against the motion from displacement d, velocity v and the parameters by
    name. `parameters` maps each to (unit, ordinary size) or (unit, ordinary size, domain), a domain being "positive"
    (the default for a positive size), "real", "fraction" or "above_one"; the unit is SI for a translation. With `state`
    the force is `force(d, v, z=..., k=...)`, and `rate(d, v, z=..., k=...)` gives z' (a number, or one for each state
    variable); all are zero at rest and z is integrated with d linear over a step.

    A function of arithmetic and numpy's elementwise functions (`numpy.where` in place of `if`) is recorded once and
    then runs in the core, with exact derivatives. One that cannot be recorded is called for every step, slower by two
    orders; `derivatives(d, v, k=...)`, a mapping of "d", "v" and each parameter to the force's derivative, spares it
    the differences. `amplitude` (m) and `speed` (m/s) say where the law is checked: its values are finite, what was
    recorded agrees with the function, derivatives agree with differences of the function. `family` and `left_out` are
    how the catalogue lists it.

    Raises LawParameterError with law and parameter where a check fails.

    >>> law = register("my_spring", lambda d, v, k, d0: k * np.tanh(d / d0), {"k": ("N", 10.0), "d0": ("m", 1e-3)})
    >>> law.parameter_names, law.parameters[1].shape
    (('k', 'd0'), True)
    """
    known = {key: _parameter(name, key, *value) for key, value in parameters.items()}
    _refuse(name, family, stateful=bool(state), rated=rate is not None)
    _check_signature(name, force, [*state, *known])
    outputs = _outputs(name, force, rate, tuple(state), tuple(known))
    typical = np.array([p.typical for p in known.values()])
    z = states_along(outputs, len(state), typical, amplitude, speed)
    scales = np.concatenate([[amplitude, speed], z, np.abs(typical)])
    specification = [(p.name, value[0], p.domain) for p, value in zip(known.values(), parameters.values(), strict=True)]
    slopes = None if derivatives is None or state else _slopes(name, derivatives, tuple(known))
    labels = ["d", "v", *state, *known]
    source = _source(outputs, slopes, scales)
    trial = f"{name} (being checked)"  # what does not pass leaves a law of that name as it was
    try:
        _core.register_law(trial, specification, len(state), **source)
        check(name, trial, outputs, labels, scales, typical, slopes)
        scaled, together = scaling(name, outputs, labels, scales, [p.dims[0] != 0 for p in known.values()])
    finally:
        _core.forget_law(trial)
    entries = tuple(replace(p, shape=p.name not in scaled) for p in known.values())
    entry = Physics(
        name, family, left_out or f"the law {name}", name, "nonlinear", entries,
        companion=True, extended=True, scales_together=together,
    )  # fmt: skip
    add(entry)
    _core.register_law(name, specification, len(state), **source)
    return entry


def _refuse(name: str, family: str, *, stateful: bool, rated: bool) -> None:
    """Raises LawParameterError for a family that is none, and for states without their rates or rates without."""
    if family not in FAMILIES:
        raise LawParameterError(
            f"law {name}: no family is called {family!r}; families are {', '.join(FAMILIES)}", law=name
        )
    if stateful != rated:
        raise LawParameterError(f"law {name}: state and rate belong together; give both or neither", law=name)


def _source(outputs: Callable[..., list[Any]], slopes: Any, scales: Array) -> dict[str, Any]:
    """How the core gets at the law: its record, or else the function itself."""
    try:
        return {"recorded": record(outputs, len(scales))}
    except Exception:  # whatever a function does that a record cannot; with numbers it may well run
        return {"function": _plain(outputs), "slopes": slopes, "scales": list(scales)}


def _parameter(law: str, name: str, unit: str, typical: float, domain: str = "") -> Parameter:
    dims = parse_unit(unit).dims if unit not in ("", "-") else (0, 0, 0, 0)
    length, mass, time, _ = dims
    domain = domain or ("positive" if typical > 0 else "real")
    inside = {"positive": typical > 0, "fraction": 0 < typical < 1, "above_one": typical > 1, "real": typical != 0}
    if domain not in _DOMAINS:
        raise LawParameterError(
            f"law {law}: {name} has the domain {domain!r}; domains are {', '.join(_DOMAINS)}", law=law, parameter=name
        )
    if not (np.isfinite(typical) and inside[domain]):
        raise LawParameterError(
            f"law {law}: {name} = {typical:g} is no ordinary size of a parameter that is {domain}",
            law=law,
            parameter=name,
        )
    return Parameter(name, (mass, length - mass, time + 2 * mass), cast(Domain, domain), typical=float(typical))


def _check_signature(law: str, force: Callable[..., Any], names: Sequence[str]) -> None:
    taken = inspect.signature(force).parameters
    if any(p.kind is p.VAR_KEYWORD for p in taken.values()):
        return
    own = list(taken)[2:]
    missing = [name for name in names if name not in own]
    more = [name for name in own if name not in names and taken[name].default is inspect.Parameter.empty]
    if missing or more:
        what = f"does not take {missing[0]!r}" if missing else f"takes {more[0]!r}, which is no parameter"
        raise LawParameterError(
            f"law {law}: its force {what}; it is called as force(d, v, {', '.join(f'{n}=...' for n in names)})",
            law=law,
            parameter=(missing or more)[0],
        )


def _outputs(
    law: str,
    force: Callable[..., Any],
    rate: Callable[..., Any] | None,
    state: tuple[str, ...],
    names: tuple[str, ...],
) -> Callable[..., list[Any]]:
    """Force and rates as a function of (d, v, z.., p..)."""

    def outputs(*inputs: Any) -> list[Any]:
        d, v = inputs[:2]
        keywords = dict(zip((*state, *names), inputs[2:], strict=True))
        out = [force(d, v, **keywords)]
        if rate is not None:
            rates = rate(d, v, **keywords)
            rates = list(rates) if isinstance(rates, (tuple, list)) else [rates]
            if len(rates) != len(state):
                raise LawParameterError(
                    f"law {law}: rate gives {len(rates)} values for the state variables {', '.join(state)}", law=law
                )
            out += rates
        return out

    return outputs


def _plain(outputs: Callable[..., list[Any]]) -> Callable[[list[float]], list[float]]:
    return lambda inputs: [float(x) for x in outputs(*inputs)]


def _slopes(
    law: str, derivatives: Callable[..., Mapping[str, float]], names: tuple[str, ...]
) -> Callable[[list[float]], list[float]]:
    def slopes(inputs: list[float]) -> list[float]:
        given = derivatives(inputs[0], inputs[1], **dict(zip(names, inputs[2:], strict=True)))
        missing = [name for name in ("d", "v", *names) if name not in given]
        if missing:
            raise LawParameterError(
                f"law {law}: derivatives gives none over {missing[0]}; give one over d, v and each parameter",
                law=law,
                parameter=missing[0],
            )
        return [float(given[name]) for name in ("d", "v", *names)]

    return slopes
