"""A population as plain values: what population.json holds, and what the terminal says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from femend.bench.page import fixed, number, percent
from femend.bench.populations.population_structure import OneStructure
from femend.bench.updating.counted import Counted
from femend.bench.updating.without_mistaken import Sound
from femend.estimate.updating import Population, UpdatedDeck
from femend.numerals import plain
from femend.report.text_table import table

__all__ = ["FORMAT", "population_result", "population_text"]

FORMAT = "femend-population/1"
# of a scatter that single structures tell less than this share of, little is known
HARDLY = 0.5


def population_result(
    sound: Sound,
    found: Population,
    structures: Sequence[OneStructure],
    deck: UpdatedDeck,
    counted: Sequence[Counted],
    priors: Mapping[str, tuple[float, float]],
) -> dict[str, Any]:
    """The content of population.json; `priors` are means and deviations of the deck's values by name."""
    parameters = _parameters(found, priors)
    prepared, faults = sound.prepared, sound.doubts
    return {
        "format": FORMAT,
        "title": prepared.study.title,
        "status": "converged" if found.converged else "limit",
        "rounds": found.n_rounds,
        "parameters": parameters,
        "structures": [_structure(s) for s in structures],
        # a scatter that is none is no doubt
        "doubtful": bool(faults) or not found.converged or any(s.found.status == "at bound" for s in structures),
        "advice": "; ".join(_advice(found, parameters, structures, sound.mend)),
        "warnings": list(
            dict.fromkeys([*prepared.warnings, *faults, *(t for c in counted for t in c.left_out), *deck.warnings])
        ),
    }


def _parameters(found: Population, priors: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """Mean and scatter of every unknown, and which share of its scatter single structures tell."""
    unknowns = found.results[0].problem.unknowns
    own = np.array([np.diag(r.covariance) for r in found.results]).mean(axis=0)
    mean, told = unknowns.values(found.mean), 1.0 - np.minimum(own / found.sd**2, 1.0)
    deviations = (found.mean_sd, found.sd, found.alone_sd)
    mean_sd, scatter, alone = (unknowns.value_sd(found.mean, np.diag(sd**2)) for sd in deviations)
    # of n structures a deviation is known to this share, if they are told without error
    few = 1.0 / np.sqrt(2.0 * (len(found.results) - 1))
    return {
        u.name: {
            "mean": float(mean[i]),
            "unit": u.unit,
            "mean_sd": float(mean_sd[i]),
            "scatter": float(scatter[i]),
            "scatter_sd": float(scatter[i] * few / max(np.sqrt(told[i]), 1e-3)),
            "told": float(told[i]),
            "alone_sd": float(alone[i]),
            "prior_mean": priors[u.name][0] if u.name in priors else None,
            "prior_sd": priors[u.name][1] if u.name in priors else None,
        }
        for i, u in enumerate(unknowns.items)
    }


def _structure(s: OneStructure) -> dict[str, Any]:
    values, sd = s.found.values, s.found.sd

    def mean(of: Sequence[Any], key: str) -> float:
        known = [x for x in (c.summary()[key] for c in of) if np.isfinite(x)]
        return float(np.mean(known)) if known else float("nan")

    return {
        "name": s.name,
        "recordings": [c.measured.name for c in s.before],
        "status": s.found.status,
        "parameters": {n: {"value": v, "sd": sd[n]} for n, v in values.items()},
        "freq_error": {"before": mean(s.before, "freq_error"), "after": mean(s.after, "freq_error")},
        "mac": {"before": mean(s.before, "mac"), "after": mean(s.after, "mac")},
        "squares": s.found.after.squares,
        "values": s.found.after.n_values,
    }


def _advice(
    found: Population, parameters: Mapping[str, Any], structures: Sequence[OneStructure], mend: Sequence[str]
) -> list[str]:
    said = [*mend]
    if not found.converged:
        said.append(
            f"mean and scatter still changed after {found.n_rounds} rounds: a scatter that goes to 0, or parameters "
            "that the structures do not tell"
        )
    hardly = [n for n, p in parameters.items() if p["told"] < HARDLY]
    if hardly:
        values = ", ".join(f"{n} {plain(parameters[n]['scatter'], 2)}" for n in hardly)
        alone = ", ".join(plain(parameters[n]["alone_sd"], 2) for n in hardly)
        said.append(
            f"a scatter of {values} is hardly told from none: what one structure's recordings tell has a deviation of "
            f"{alone}; measure more of each, or take these as alike"
        )
    ends = [s.name for s in structures if s.found.status == "at bound"]
    if ends:
        said.append(f"parameters of {', '.join(ends)} stand at their limits: a population goes on beyond them")
    return said


def population_text(result: dict[str, Any]) -> str:
    """What the terminal says: mean and scatter of the parameters, every structure, and what to do."""
    n = len(result["structures"])
    parts = [f"{result['status']} after {result['rounds']} rounds, {n} structures", ""]
    rows = [
        [name, number(p["mean"], 5), number(p["mean_sd"], 2), number(p["scatter"], 2), number(p["scatter_sd"], 2),
         number(p["prior_sd"], 2), percent(p["told"], 0, sign=False)]
        for name, p in result["parameters"].items()
    ]  # fmt: skip
    header = ["parameter", "mean", "sd of mean", "scatter", "sd of scatter", "prior sd", "told by each"]
    parts += [table(header, rows, "lrrrrrr"), ""]
    names = list(result["parameters"])[:6]
    rows = [
        [s["name"], *(number(s["parameters"][k]["value"], 4) for k in names),
         *(percent(s["freq_error"][k], sign=False) for k in ("before", "after")), fixed(s["mac"]["after"])]
        for s in result["structures"]
    ]  # fmt: skip
    parts.append(table(["structure", *names, "df before", "after", "MAC"], rows, "l" + "r" * (len(names) + 3)))
    parts += [""] + [f"warning   {w}" for w in result["warnings"]]
    return "\n".join([*parts, f"advice    {result['advice']}" if result["advice"] else ""]).rstrip()
