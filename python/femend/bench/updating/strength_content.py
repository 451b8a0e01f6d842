"""The strength of the priors on the page of an update, and its curve as a table for a spreadsheet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femend.bench.page import Section, Table, figures, number
from femend.bench.steps import write_csv
from femend.bench.updating.strength import Strength
from femend.numerals import plain
from femend.report import plots
from femend.report.content import Picture
from femend.study.file.bench_settings import RULES

__all__ = ["strength_section", "write_strength_table"]

# lines of parameters over the strength that can be told apart
DRAWN = 10


def strength_section(s: Strength) -> Section:
    """The strength that was taken, what others do to squares and parameters, and why it was taken."""
    c, told = s.curve, s.as_dict()
    k = int(np.flatnonzero(c.strengths == c.strength)[0])
    rows = [
        [number(a, 3), number(1 / np.sqrt(a), 3), number(q, 5), number(x, 5), number(v, 4)]
        for a, q, x, v in zip(c.strengths, c.squares, c.penalties, c.criterion, strict=True)
    ]
    header = ("strength", "prior sd times", "squares", "penalty", "criterion")
    effect = ""
    if 1.0 in c.strengths:
        i = int(np.flatnonzero(c.strengths == 1.0)[0])
        names = s.problem.unknowns.names
        there, stated = (np.array([told["parameters"][n][j] for n in names]) for j in (k, i))
        most = int(np.argmax(np.abs(there - stated)))
        effect = (
            f" With the priors as stated the squares are {plain(c.squares[i])}, with these {plain(c.squares[k])} "
            f"({told['values']} values); {names[most]} changes most by it, from {plain(stated[most])} to "
            f"{plain(there[most])}."
        )
    taken = (
        f"It is what {RULES[c.rule]} takes of {len(c.strengths)} strengths, each a search of its own, from the "
        "strongest on."
        if len(c.strengths) > 1
        else "It is the one that the study gives."
    )
    if not s.has_corner:
        taken = f"The L-curve has no corner among {len(c.strengths)} strengths: this is the one nearest to 1."
    return Section(
        "Strength of the priors",
        f"The priors count {plain(c.strength, 3)} times as much as the study states them: as if every prior deviation "
        f"were {plain(s.wider, 3)} times as large. {taken}{effect} Deviations, and what the data tell, are with this "
        "prior; grey intervals and prior sd in the table of parameters are the priors as stated.",
        [Table(header, rows, "rrrrr", frozenset([k]))],
        _pictures(s, k),
    )


def _pictures(s: Strength, k: int) -> tuple[Picture, ...]:
    c, unknowns = s.curve, s.problem.unknowns
    if len(c.strengths) < 2:
        return ()
    values = np.array([unknowns.values(p) for p in c.p])
    moved = np.argsort(-np.ptp(values / np.array([abs(u.scale) for u in unknowns.items]), axis=0))[:DRAWN]
    with plots.paper_style():
        made = plots.figure("page", 66, 1, 2)
        plots.draw_l_curve(made.axes[0], c.squares, c.penalties, c.strengths, k)
        names = [unknowns.names[i] for i in moved]
        plots.draw_traces(made.axes[1], c.strengths, values[:, moved], names, k)
        more = f", the {DRAWN} that change most" if len(unknowns) > DRAWN else ""
        return figures([(f"What is left against how far the parameters go, and the parameters{more}", made)])


def write_strength_table(folder: Path, s: Strength | None) -> list[str]:
    """The curve as CSV into `folder`; gives the names of the files."""
    if s is None:
        return []
    c, unknowns = s.curve, s.problem.unknowns
    rows = [
        [a, q, x, v, *unknowns.values(p)]
        for a, q, x, v, p in zip(c.strengths, c.squares, c.penalties, c.criterion, c.p, strict=True)
    ]
    header = ("strength", "squares", "penalty", "criterion", *unknowns.names)
    write_csv(folder / "updating.strengths.csv", header, rows)
    return ["updating.strengths.csv"]
