"""Links between parameters of a study: what each is in a configuration, and which unknowns are left."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from femend.estimate.updating import Link, Unknown, Unknowns
from femend.model import Model
from femend.numerals import plain
from femend.study.file.bench_settings import LinkSettings
from femend.study.file.study import Study

__all__ = [
    "deck_priors",
    "follows",
    "kept_as_drawn",
    "link_lines",
    "linked_unknowns",
    "links_in",
    "links_result",
    "values_in",
]


def links_in(study: Study, configuration: str) -> dict[str, Link]:
    """What parameters are in the `configuration` of this name where they are not unknowns of their own name."""
    return {
        s.parameter: Link(tuple(zip(s.to, s.powers, strict=True)), s.scale)
        for s in study.updating.link
        if s.holds_in(configuration)
    }


def linked_unknowns(study: Study, unknowns: Unknowns, configurations: Iterable[str]) -> Unknowns:
    """The `unknowns` without those that no configuration has, since they are linked in all of them, and with those that
    parameters have of their own in some."""
    used = set[str]()
    for name in set(configurations):
        links = links_in(study, name)
        used |= {n for n in unknowns.names if n not in links}
        used |= {n for link in links.values() for n, _ in link.powers}
    keep = [i for i, n in enumerate(unknowns.names) if n in used]
    left = Unknowns(tuple(unknowns.items[i] for i in keep), unknowns.mean[keep], unknowns.precision[np.ix_(keep, keep)])
    return left.extended([u for s in study.updating.link if s.own and s.to[0] in used for u in _own(s, unknowns)])


def _own(s: LinkSettings, unknowns: Unknowns) -> list[Unknown]:
    """The unknown that a parameter is in some configurations, with the prior and bounds that it has elsewhere."""
    return [replace(unknowns.items[unknowns.index(s.parameter)], name=s.to[0])]


def deck_priors(study: Study, model: Model) -> dict[str, tuple[float, float]]:
    """Mean and 1-sigma of the prior of whatever may be an unknown of the deck, or of a solver's input, by name: factors
    about 1, amplitudes about 0, and those of their own in some configurations."""
    if study.solver is not None:
        return {v.name: (1.0, v.prior_sd) for v in study.solver.values}
    found = {p.name: (1.0, p.prior_sd) for p in model.parameters} | {m.name: (0.0, m.prior_sd) for m in model.morphs}
    return found | {s.to[0]: found[s.parameter] for s in study.updating.link if s.own}


def values_in(study: Study, model: Model, found: Mapping[str, float], configuration: str) -> dict[str, float]:
    """Factors of the parameters of `model` and amplitudes of its morphs in the `configuration` of this name, by what
    was `found` of the unknowns; as the deck has them where these do not tell."""
    links = links_in(study, configuration)
    drawn = {p.name: 1.0 for p in model.parameters} | {m.name: 0.0 for m in model.morphs}
    out = {}
    for name, as_drawn in drawn.items():
        link = links.get(name, Link(((name, 1.0),)))
        told = all(n in found for n, _ in link.powers)
        out[name] = link.scale * float(np.prod([found[n] ** e for n, e in link.powers])) if told else as_drawn
    return out


def kept_as_drawn(study: Study, model: Model, found: Mapping[str, float], configuration: str) -> list[str]:
    """That the deck keeps values which only other configurations told, where it does."""
    links = links_in(study, configuration)
    names = [p.name for p in model.parameters] + [m.name for m in model.morphs]
    lost = [n for n in names if any(to not in found for to, _ in links.get(n, Link(((n, 1.0),))).powers)]
    return [
        f"{', '.join(lost)}: what was found is of other configurations ([[updating.link]]); the updated deck, which is "
        f"{configuration!r}, keeps its value"
    ] if lost else []  # fmt: skip


def links_result(study: Study, model: Model, found: Mapping[str, float]) -> list[dict[str, Any]]:
    """What updating.json holds of the links: what follows what, where, and its value there."""
    return [
        {
            "parameter": s.parameter,
            "to": list(s.to),
            "powers": list(s.powers),
            "scale": s.scale,
            "own": s.own,
            "configurations": list(s.configurations),
            "value": values_in(study, model, found, where)[s.parameter] if all(n in found for n in s.to) else None,
        }
        for s in study.updating.link
        for where in (s.configurations or ("",))[:1]
    ]


def follows(link: Mapping[str, Any]) -> str:
    """What a parameter is by one of `links_result`, as a formula."""
    if link["own"]:
        return "a value of its own"
    parts = [n if e == 1 else f"{n}^{plain(e)}" for n, e in zip(link["to"], link["powers"], strict=True)]
    return " * ".join([*([plain(link["scale"])] if link["scale"] != 1 else []), *parts])


def link_lines(links: Iterable[Mapping[str, Any]]) -> list[str]:
    """A line for each link on the terminal."""
    return [
        f"link      {k['parameter']} is {follows(k)} in {', '.join(k['configurations']) or 'all configurations'}"
        + ("" if k["value"] is None else f": {plain(k['value'], 5)}")
        for k in links
    ]
