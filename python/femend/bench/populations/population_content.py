"""A population as a page and as tables for a spreadsheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.correlation.correlation_content import prepared_mesh
from femend.bench.page import Fact, Page, Section, Table, figures, fixed, number, percent
from femend.bench.steps import write_csv
from femend.report import plots
from femend.report.content import Picture
from femend.report.words import sentence

if TYPE_CHECKING:
    from femend.bench.populations.population_run import PopulationRun

__all__ = ["population_page", "write_population_tables"]

# more parameters would not be read in one picture, or one table
DRAWN = 16


def population_page(run: PopulationRun, info: dict[str, Any], files: Sequence[str]) -> Page:
    """The page of a population; `info` is the content of run.json, `files` what stands beside it."""
    result = run.result
    structures, parameters = result["structures"], result["parameters"]
    before, after = (_mean([s["freq_error"][k] for s in structures]) for k in ("before", "after"))
    told = [n for n, p in parameters.items() if p["told"] >= 0.5]
    facts = [
        Fact("Structures", str(len(structures)), "nominally equal, each with its own values"),
        Fact("Frequencies", f"{percent(before, sign=False)} → {percent(after, sign=False)}", "mean error over all"),
        Fact("Scatter told", f"{len(told)} of {len(parameters)}", ", ".join(told[:6]) or "none"),
    ]
    widest = max(parameters, key=lambda n: parameters[n]["scatter"] / max(abs(parameters[n]["mean"]), 1e-300))
    p = parameters[widest]
    share = percent(p["scatter"] / abs(p["mean"]), sign=False)
    return Page(
        run.study.title,
        "femend population",
        f"{len(structures)} structures: {widest} scatters most, by {share} of its mean",
        (result["status"], "warn" if result["doubtful"] else "good"),
        facts,
        sentence(result["advice"]),
        [sentence(w) for w in result["warnings"]],
        prepared_mesh(run.prepared),
        f"{len(run.prepared.placed.pairing)} sensors and shakers at their places.",
        [_parameters(run), _structures(run), _deck(run)],
        info,
        files,
    )


def _mean(values: Sequence[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return float(np.mean(known)) if known else float("nan")


def _parameters(run: PopulationRun) -> Section:
    rows = [
        [name, f"{number(p['mean'], 5)} {p['unit']}".strip(), number(p["mean_sd"], 2), number(p["scatter"], 3),
         number(p["scatter_sd"], 2), number(p["prior_sd"], 2), percent(p["told"], 0, sign=False)]
        for name, p in run.result["parameters"].items()
    ]  # fmt: skip
    header = ("parameter", "mean", "± mean", "scatter", "± scatter", "prior sd", "told by each")
    return Section(
        "Mean and scatter",
        "Factors of the deck's values (of positions amplitudes). Parameters of a structure are taken as normal about "
        "the mean with the scatter, one sigma; both are those under which the recordings of all structures are "
        "likeliest (expectation-maximisation, restricted likelihood). Told by each is the share of the scatter's "
        "variance that the recordings of one structure take away; of a scatter that single structures hardly tell "
        "little is known.",
        [Table(header, rows, "lrrrrrr")],
        _picture(run),
    )


def _picture(run: PopulationRun) -> tuple[Picture, ...]:
    parameters = run.result["parameters"]
    names = [n for n, p in parameters.items() if p["prior_mean"] == 1.0][:DRAWN]
    if not names:
        return ()
    values = np.array([[s["parameters"][n]["value"] for n in names] for s in run.result["structures"]])
    mean, scatter = (np.array([parameters[n][k] for n in names]) for k in ("mean", "scatter"))
    with plots.paper_style():
        made = plots.figure("page", 62)
        plots.draw_scatter(made.axes[0], values, names, mean, scatter)
        return figures([("Factors of every structure (dots), the mean and one and two sigma of the scatter", made)])


def _structures(run: PopulationRun) -> Section:
    names = list(run.result["parameters"])[:DRAWN]
    rows = [
        [s["name"], *(number(s["parameters"][n]["value"], 4) for n in names),
         *(percent(s["freq_error"][k], sign=False) for k in ("before", "after")),
         *(fixed(s["mac"][k]) for k in ("before", "after"))]
        for s in run.result["structures"]
    ]  # fmt: skip
    header = ("structure", *names, "Δf before", "Δf after", "MAC before", "MAC after")
    return Section(
        "Structures",
        "What each is inside the population: where its recordings tell little, it is drawn to the mean.",
        [Table(header, rows, "l" + "r" * (len(names) + 4))],
    )


def _deck(run: PopulationRun) -> Section:
    diff = run.deck.diff or "nothing changes"
    shown = diff if len(diff) < 8000 else diff[:8000] + "\n…"
    return Section(
        "The deck", "model.mean.bdf has the mean values; it differs from the deck in these lines.", code=shown
    )


def write_population_tables(folder: Path, run: PopulationRun) -> list[str]:
    """Parameters and structures as CSV into `folder`; gives the names of the files."""
    parameters = run.result["parameters"]
    keys = ("mean", "mean_sd", "scatter", "scatter_sd", "told", "prior_sd")
    header = ("parameter", "mean", "sd of mean", "scatter", "sd of scatter", "told by each", "prior sd")
    write_csv(folder / "population.parameters.csv", header, [[n, *(p[k] for k in keys)] for n, p in parameters.items()])
    rows = [
        [s["name"], *(v for n in parameters for v in s["parameters"][n].values()),
         s["freq_error"]["before"], s["freq_error"]["after"], s["mac"]["before"], s["mac"]["after"]]
        for s in run.result["structures"]
    ]  # fmt: skip
    own = [text for n in parameters for text in (n, f"sd of {n}")]
    last = ("freq error before", "freq error after", "mac before", "mac after")
    write_csv(folder / "population.structures.csv", ("structure", *own, *last), rows)
    return ["population.parameters.csv", "population.structures.csv"]
