"""Response surface, other starts and drawn posterior on the page of an update, and as tables for a spreadsheet."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from femend.bench.page import Section, Table, figures, fixed, number, percent
from femend.bench.reading.links import deck_priors
from femend.bench.steps import write_csv
from femend.bench.updating.drawn import Drawn
from femend.bench.updating.starts import Starts
from femend.bench.updating.strength_content import strength_section, write_strength_table
from femend.bench.updating.surface_start import SurfaceStart
from femend.numerals import plain
from femend.report import plots
from femend.report.content import Picture

if TYPE_CHECKING:
    from femend.bench.updating.update_run import UpdateRun

__all__ = ["estimate_sections", "estimate_tables"]

# more minima, or more densities, would not be read
MINIMA_SHOWN, DENSITIES_SHOWN, ACROSS = 12, 24, 4


def estimate_sections(run: UpdateRun) -> list[Section]:
    """What a response surface, other starts and draws say, as far as there are any."""
    found = [] if run.strength is None else [strength_section(run.strength)]
    found += [] if run.surface is None else [_surface(run.surface)]
    found += [] if run.starts is None else [_starts(run.starts)]
    return found if run.drawn is None else [*found, _posterior(run, run.drawn)]


def estimate_tables(folder: Path, run: UpdateRun) -> list[str]:
    """The minima and the draws as CSV into `folder`, as far as there are any; gives the names of the files."""
    names, unknowns = write_strength_table(folder, run.strength), run.problem.unknowns.names
    if run.starts is not None:
        minima = [
            [k, len(m.starts), m.result.after.cost, m.result.after.squares, m.result.status, *m.result.values.values()]
            for k, m in enumerate(run.starts.many.minima, 1)
        ]
        write_csv(folder / "updating.starts.csv", ("minimum", "starts", "cost", "squares", "status", *unknowns), minima)
        names.append("updating.starts.csv")
    if run.drawn is not None:
        rows = [[*p, s] for p, s in zip(run.drawn.values.tolist(), run.drawn.posterior.squares.tolist(), strict=True)]
        write_csv(folder / "updating.posterior.csv", (*unknowns, "squares"), rows)
        names.append("updating.posterior.csv")
    return names


def _surface(surface: SurfaceStart) -> Section:
    told = surface.as_dict()
    cost = told["cost"]
    share = told["sobol"]
    rows = [
        [name, number(value, 5), *(percent(share[name][k], 0, sign=False) for k in ("first", "total"))]
        for name, value in told["minimum"].items()
    ]
    begun = "The search began there" if told["begun_there"] else "The search began at the deck, which costs less"
    lead = (
        f"The models solved at {told['points']} points of a Latin hypercube between the bounds, a quadratic of "
        f"{told['terms']} terms through every residual. Points left out are foretold to "
        f"{number(told['press_error'], 3)} deviations (rms), over the design residuals scatter by "
        f"{number(told['spread'], 3)}: {plain(100 * told['left_of_variance'], 2)} % of their variance is left. At its "
        "least point the surface foretells a "
        f"cost of {number(cost['foretold'], 5)}, the models have {number(cost['there'], 5)}, the deck "
        f"{number(cost['deck'], 5)}. {begun}. Over the priors each parameter makes so much of the residuals' variance "
        "by itself, and has a part in so much (Sobol indices of all residuals together)."
    )
    header = ("parameter", "at the least point", "makes by itself", "has a part in")
    return Section("Response surface", lead, [Table(header, rows, "lrrr")])


def _starts(starts: Starts) -> Section:
    told = starts.as_dict()
    rows = [
        [
            str(k),
            str(len(m["starts"])),
            number(m["cost"], 5),
            number(m["squares"], 5),
            m["status"] + ("" if m["in_full_model"] else ", reduced model"),
            str(m["modes_without_mate"]),
            ", ".join(f"{n} {plain(v)}" for n, v in m["parameters"].items()),
        ]
        for k, m in enumerate(told["minima"][:MINIMA_SHOWN], 1)
    ]
    header = ("minimum", "starts", "cost", "squares", "search", "modes without mate", "parameters")
    taken = frozenset() if starts.at is None else frozenset({starts.at})
    more = len(told["minima"]) - len(rows)
    lead = (
        f"{told['starts']} searches: one from the deck as it stands, the others from points all over the bounds. "
        f"{told['end_there']} of them end where the one that was taken does (marked)."
    )
    if told["reduced_model_error"] is not None:
        lead += (
            f" They were made in reduced models, whose frequencies are off by up to "
            f"{plain(100 * told['reduced_model_error'], 2)} %, and the best gone on from in the full ones."
        )
    return Section(
        "Other starts",
        lead,
        [Table(header, rows, "rrrrlrl", taken)],
        notes=[f"{more} more in updating.starts.csv"] if more > 0 else [],
    )


def _posterior(run: UpdateRun, drawn: Drawn) -> Section:
    told = drawn.as_dict()
    laplace = run.found.sd
    rows = [
        [
            name,
            number(p["mean"], 5),
            number(p["sd"], 3),
            number(laplace[name], 3),
            *(number(q, 5) for q in p["quantiles"].values()),
            fixed(p["shift_from_laplace"], 2),
        ]
        for name, p in told["parameters"].items()
    ]
    header = ("parameter", "mean", "sd", "sd, Laplace", "2.5 %", "50 %", "97.5 %", "shift, Laplace sd")
    unlike = frozenset(i for i, n in enumerate(told["parameters"]) if n in told["unlike_laplace"])
    evidence = run.found.log_evidence
    beside = "" if math.isnan(evidence) else f" (Laplace's {evidence:.2f})"
    where = "" if drawn.small is None else f" in reduced models, off by up to {plain(100 * drawn.small.error, 2)} %"
    return Section(
        "The posterior by draws",
        f"{told['draws']} draws by sequential Monte Carlo, {told['models_solved']} models solved{where}; ln evidence "
        f"{told['log_evidence']:.2f} ± {told['log_evidence_se']:.2f}{beside}. Laplace's bell is what the parameters' "
        "deviations above tell of; where draws tell another story the row stands out.",
        [Table(header, rows, "lrrrrrrr", unlike)],
        _densities(run, drawn),
    )


def _densities(run: UpdateRun, drawn: Drawn) -> tuple[Picture, ...]:
    names = drawn.names[:DENSITIES_SHOWN]
    across = min(ACROSS, len(names))
    down = -(-len(names) // across)
    found, sd = run.found.values, run.found.sd
    prior = deck_priors(run.study, run.prepared.model)
    with plots.paper_style():
        made = plots.figure("page", 38.0 * down + 6.0, down, across, squeeze=False)
        for i, name in enumerate(names):
            plots.draw_posterior(
                made.axes[i], drawn.values[:, i], name=name, laplace=(found[name], sd[name]), prior=prior.get(name)
            )
        for ax in made.axes[len(names) :]:
            ax.set_axis_off()
        made.axes[0].legend(fontsize=6)
        return figures([("Draws of each parameter, Laplace's bell and the prior over them", made)])
