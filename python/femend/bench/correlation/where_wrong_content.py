"""Where the deck is wrong, as sections of the page and as tables for a spreadsheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from femend.bench.correlation.where_wrong import SHOWN, WhereWrong, where_wrong_words
from femend.bench.page import Section, Table, figures, fixed, number, percent
from femend.bench.reading.compared import Compared
from femend.bench.steps import write_csv
from femend.report import plots
from femend.report.content import Picture
from femend.study.shown.picture import mesh_picture

if TYPE_CHECKING:
    from femend.bench.correlation.correlation_run import CorrelationRun

__all__ = ["where_sections", "write_where_tables"]


def where_sections(done: CorrelationRun, c: Compared, w: WhereWrong | None) -> list[Section]:
    """The section of a recording `c`; none where it was not looked for."""
    if w is None:
        return []
    title = f"{c.measured.name}: where the deck is wrong"
    if w.energy is None:
        return [Section(title, where_wrong_words(w))]
    tables = []
    if w.ranking is not None:
        rows = [
            [r.name, percent(r.removes, 0, sign=False), percent(r.change, 1), percent(r.sd, 1, sign=False),
             fixed(r.z, 1), ", ".join(r.alike)]
            for r in w.ranking.rows[:SHOWN]
        ]  # fmt: skip
        header = ("parameter", "removes", "by changing", "±", "moved, prior sd", "not told apart from")
        tables.append(Table(header, rows, "lrrrrl", title="Parameters, each by itself"))
    e = w.energy
    density = dict(zip(e.elements.tolist(), e.density.tolist(), strict=True))
    rows = [[str(i), percent(s, 1, sign=False), number(density[i], 3)] for i, s in e.worst(SHOWN)]
    tables.append(Table(("element", "share", "per strain energy"), rows, "lrr", title="Elements"))
    rows = [[n, percent(s, 1, sign=False)] for n, s in sorted(e.regions.items(), key=lambda one: -one[1])[:SHOWN]]
    rows += [
        [f"joint at node {n}", percent(s, 1, sign=False)]
        for n, s in sorted(e.joints.items(), key=lambda one: -one[1])[:SHOWN]
    ]
    tables.append(Table(("region, joint", "share"), rows, "lr", title="Regions and joints"))
    return [
        Section(
            title,
            f"{where_wrong_words(w)} Measured shapes are expanded to the whole model at the measured frequencies, as "
            "little against its equations of motion as their deviations allow; the energy of what these lack stands in "
            f"the elements ({len(w.modes)} modes). Few sensors leave it wide.",
            tables,
            _pictures(done, c, w),
        )
    ]


def _pictures(done: CorrelationRun, c: Compared, w: WhereWrong) -> tuple[Picture, ...]:
    model = done.prepared.models.of(c.measured.configuration)
    mesh = mesh_picture(model)
    if not len(mesh.node_ids) or w.energy is None:
        return ()
    with plots.paper_style():
        made = plots.figure("column", 66)
        plots.draw_residual(made.axes[0], mesh, model, w.energy)
        return figures([(f"{c.measured.name}: energy of what the equations of motion lack, on the mesh", made)])


def write_where_tables(folder: Path, done: CorrelationRun) -> list[str]:
    """Elements and parameters of all recordings as CSV into `folder`; gives the names of the files."""
    elements, parameters = [], []
    for c, w in zip(done.compared, done.wrong, strict=True):
        if w is None or w.energy is None:
            continue
        name, e = c.measured.name, w.energy
        elements += [[name, int(i), s, d] for i, s, d in zip(e.elements, e.element, e.density, strict=True)]
        if w.ranking is not None:
            parameters += [[name, r.name, r.removes, r.change, r.sd, r.z, " ".join(r.alike)] for r in w.ranking.rows]
    names = []
    if elements:
        names.append("correlation.elements.csv")
        write_csv(folder / names[-1], ("recording", "element", "share", "per strain energy"), elements)
    if parameters:
        names.append("correlation.parameters.csv")
        header = ("recording", "parameter", "removes", "change", "sd", "moved by prior sd", "alike")
        write_csv(folder / names[-1], header, parameters)
    return names
