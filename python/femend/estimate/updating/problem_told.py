"""What a problem is made of in words, to tell two of them apart."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from femend.estimate.updating.problem import Problem
from femend.numerals import listed, plain

__all__ = ["differences", "told_problem"]

# differences that are named
NAMED = 6
# a value in words, and a digest where words may hide what differs
Entry = list[str]
Told = dict[str, dict[str, Entry]]


def told_problem(problem: Problem) -> Told:
    """Priors and limits of every parameter of `problem`, and what was measured in every configuration: by subject and
    key, each value in words with a digest, as JSON keeps it."""
    told: Told = {}
    for u in problem.unknowns.items:
        told[f"parameter {u.name!r}"] = {
            "prior_sd": _entry(float(u.sd)),
            "prior mean": _entry(float(u.mean)),
            "bounds": _entry(u.bounds),
            "scale and unit": _entry((u.scale, u.unit, u.owner, "positive" if u.positive else "of either sign")),
        }
    told["the parameters together"] = {"precision of the prior": _entry(problem.unknowns.precision)}
    for c in problem.configurations:
        told[c.name] = {
            "parameters of the model": _entry(tuple(c.system.names)),
            "links": _entry(sorted(c.links.items(), key=str)),
        }
        for r in c.responses:
            fields = dataclasses.fields(r)  # type: ignore[arg-type]
            told[f"{r.name} of {c.name}"] = {f.name: _entry(getattr(r, f.name)) for f in fields if f.name != "name"}
    return told


def differences(then: Mapping[str, Mapping[str, Entry]], problem: Problem) -> str:
    """How `problem` differs from what was told of one `then`, in words with both values; "" where nothing told does.

    The joint prior is told where no parameter's own says it. Raises nothing.
    """
    now = told_problem(problem)
    found: list[str] = []
    for subject in dict.fromkeys([*then, *now]):
        if subject not in now or subject not in then:
            found.append(f"{subject} {'was not in it' if subject in now else 'is there no longer'}")
            continue
        if subject == "the parameters together" and found:
            continue
        changed = [
            _changed(key, then[subject].get(key), now[subject].get(key))
            for key in dict.fromkeys([*then[subject], *now[subject]])
            if then[subject].get(key) != now[subject].get(key)
        ]
        if changed:
            found.append(f"{subject}: {', '.join(changed)}")
    return listed(found, NAMED, "; ")


def _changed(key: str, then: Entry | None, now: Entry | None) -> str:
    if then is None or now is None:
        return f"{key} {'is new' if then is None else 'is there no longer'}"
    if then[0] == now[0]:
        return f"{key} has other values ({now[0]} both times)"
    return f"{key} was {then[0]}, is {now[0]}"


def _entry(value: Any) -> Entry:
    """A value in words, and its digest."""
    if isinstance(value, np.ndarray):
        content = np.ascontiguousarray(value).tobytes()
        size = np.abs(value) if np.iscomplexobj(value) else value
        numbers = size[np.isfinite(size)] if np.issubdtype(value.dtype, np.number) else np.zeros(0)
        words = f"{value.size} value{'s' * (value.size != 1)}"
        if numbers.size:
            low, high = plain(float(numbers.min())), plain(float(numbers.max()))
            words += f" of {low}" if low == high else f" from {low} to {high}"
    else:
        content = repr(value).encode()
        words = _words(value)
    return [words, hashlib.sha256(content).hexdigest()[:16]]


def _words(value: Any) -> str:
    if value is None or value == () or value == []:
        return "none"
    if isinstance(value, float):
        return plain(value)
    if isinstance(value, tuple | list):
        return ", ".join(_words(v) for v in value)
    return str(value)
