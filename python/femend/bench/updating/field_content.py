"""Fields and links on the page of an update, and fields as a table for a spreadsheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from femend.bench.page import Section, Table, figures, number, percent
from femend.bench.reading.fields import elements_of_parameters
from femend.bench.reading.links import follows
from femend.bench.steps import write_csv
from femend.report import plots
from femend.report.content import Picture
from femend.study.shown.picture import mesh_picture

if TYPE_CHECKING:
    from femend.bench.updating.update_run import UpdateRun

__all__ = ["field_sections", "link_sections", "write_field_table"]

# parts of a field that the page lists, those that changed most
SHOWN = 12


def field_sections(run: UpdateRun) -> list[Section]:
    """A section for each field of the study."""
    return [_field(run, f) for f in run.result["fields"]]


def _field(run: UpdateRun, f: dict[str, Any]) -> Section:
    parameters = run.result["parameters"]
    most = sorted(f["parts"], key=lambda n: -abs(f["parts"][n] - 1.0))[:SHOWN]
    rows = [
        [n, f"{f['parts'][n]:.4f}", percent(f["parts"][n] - 1), percent(parameters[n]["sd"], sign=False),
         percent(parameters[n]["learned"], 0, sign=False), "the data" if parameters[n]["determined"] else "the prior"]
        for n in most
    ]  # fmt: skip
    title = "" if len(most) == len(f["parts"]) else f"The {len(most)} of {len(f['parts'])} parts that changed most"
    n, prior = len(f["parts"]), percent(f["neighbour_sd"], 1, sign=False)
    others = "; of the others neighbours and the prior do" if f["determined"] < n else ""
    return Section(
        f"Field: {f['name']}",
        f"{n} parts with a factor each, {len(f['neighbours'])} pairs of neighbours held alike: they differ by "
        f"{percent(f['neighbours_differ'], sign=False)} (rms) where {prior} was allowed for. The data tell "
        f"{f['determined']} of {n}{others}.",
        [Table(("part", "factor", "change", "± now", "learned", "told by"), rows, "lrrrrl", title=title)],
        _picture(run, f),
        notes=["updating.fields.csv has all parts."] if title else [],
    )


def _picture(run: UpdateRun, f: dict[str, Any]) -> tuple[Picture, ...]:
    """The factors on the mesh, each element in the colour of its part."""
    model = run.prepared.model
    mesh = mesh_picture(model)
    own = elements_of_parameters(model, list(f["parts"]))
    factor = {eid: f["parts"][name] for name, elements in own.items() for eid in elements}
    if not len(mesh.node_ids) or not factor:
        return ()
    with plots.paper_style():
        made = plots.figure("page", 80)
        plots.draw_field(made.axes[0], mesh, model, factor, label="factor")
        return figures([(f"{f['name']}: factors on the deck's values, on the mesh", made)])


def link_sections(run: UpdateRun) -> list[Section]:
    """What follows what; no section without links."""
    rows = [
        [link["parameter"], follows(link), ", ".join(link["configurations"]) or "all", number(link["value"], 5)]
        for link in run.result["links"]
    ]
    header = ("parameter", "is", "in", "value there")
    lead = (
        "These are no unknowns of their own where they follow others; priors and bounds are those of what they follow."
    )
    return [Section("Links", lead, [Table(header, rows, "lllr")])] if rows else []


def write_field_table(folder: Path, run: UpdateRun) -> list[str]:
    """All parts of all fields as CSV into `folder`; gives the names of the files."""
    of = run.result["parameters"]
    rows = [
        [f["name"], n, v, of[n]["sd"], of[n]["learned"], "data" if of[n]["determined"] else "prior"]
        for f in run.result["fields"]
        for n, v in f["parts"].items()
    ]
    if not rows:
        return []
    write_csv(folder / "updating.fields.csv", ("field", "part", "factor", "sd", "learned", "told by"), rows)
    return ["updating.fields.csv"]
