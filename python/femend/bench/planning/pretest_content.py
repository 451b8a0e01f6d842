"""The plan of a test as a page and as tables for the people who glue the sensors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.page import Fact, Page, Section, Table, deviation, figures, fixed, number, percent
from femend.bench.steps import drawn_model, marker, write_csv
from femend.correlate import automac
from femend.report import plots
from femend.report.words import sentence
from femend.units import unit_system

if TYPE_CHECKING:
    from femend.bench.planning.pretest_run import PretestRun

__all__ = ["pretest_page", "write_tables"]


def pretest_page(run: PretestRun, info: dict[str, Any], files: Sequence[str]) -> Page:
    """The page of a plan; `info` is the content of run.json, `files` what stands beside it."""
    r = run.result
    low, high = r["targets"][0]["freq"], r["targets"][-1]["freq"]
    facts = [
        Fact("Target modes", str(len(r["targets"])), f"{number(low)} to {number(high)} Hz"),
        Fact("Sensors", str(len(r["sensors"])), f"of {r['places']} places, by {r['method']}"),
        Fact("Told apart", f"AutoMAC ≤ {fixed(r['largest_off_diagonal'], 2)}", "largest off the diagonal"),
        Fact("Excite at", ", ".join(e["dof"] for e in r["exciters"]["chosen"]), "driving-point residues"),
    ]
    forecast = r.get("forecast")
    if forecast:
        n = sum(p["determined"] for p in forecast["parameters"])
        facts.append(Fact("Parameters", f"{n} of {len(forecast['parameters'])} determined", "expected"))
    v = r["virtual_test"]
    counts = ((len(r["sensors"]), "sensor"), (len(r["exciters"]["chosen"]), "exciter"), (len(r["targets"]), "mode"))
    sensors, drives, modes = (f"{n} {what}{'s' * (n != 1)}" for n, what in counts)
    words = f"{sensors} and {drives} for {modes}"
    if "found" in v:
        words += f"; the virtual test finds {v['found']} of {len(v['modes'])}"
        wrong = sum(not p["within_three_sd"] for p in v["parameters"])
        words += f" and {wrong} of {len(v['parameters'])} parameters wrong" if wrong else ""
    model = run.model
    return Page(
        run.study.title,
        "femend pretest",
        words,
        ("plan", "good") if not r["advice"] else ("plan with doubts", "warn"),
        facts,
        sentence(r["advice"]),
        [sentence(w) for w in r["warnings"]],
        drawn_model(
            model,
            [marker(d, model, str(d)) for d in run.plan.sensors],
            [marker(d, model, str(d)) for d in run.plan.exciters],
        ),
        "Thin arrows: sensors. Thick ones: exciters.",
        [_targets(run), _sensors(run), _exciters(run), *_forecast(run), *_explanations(run), *_virtual(run)],
        info,
        files,
    )


def _targets(run: PretestRun) -> Section:
    r = run.result
    shift = r.get("mass_loading", {}).get("shift")
    rows = []
    for k, t in enumerate(r["targets"]):
        mass = [percent(x, 1, sign=False) for x in t["effective_mass"]]
        rows.append([str(t["mode"]), number(t["freq"]), *mass, "–" if shift is None else percent(shift[k])])
    header = ("mode", "f, Hz", "mass X", "mass Y", "mass Z", "shift by the sensors")
    total = " ".join(percent(x, 0, sign=False) for x in r["effective_mass_of_targets"])
    return Section(
        "Target modes",
        f"Effective mass in X, Y and Z as a share of the whole; the targets carry {total} of it.",
        [Table(header, rows, "rrrrrr")],
        notes=[f"free structure; quietest places to hang it from: {', '.join(r['suspension'])}"] if r["free"] else (),
    )


def _sensors(run: PretestRun) -> Section:
    r, plan = run.result, run.plan
    rows = [
        [str(k), s["dof"], *(number(x, 5) for x in s["xyz"]), "already placed" if s["placed"] else ""]
        for k, s in enumerate(r["sensors"], 1)
    ]
    unit = unit_system(run.model.units).length_text
    header = ("", "DOF", f"x, {unit}", f"y, {unit}", f"z, {unit}", "")
    compared = [
        [
            name,
            fixed(m["largest_off_diagonal"], 3),
            fixed(m["ln_det"], 2),
            "–" if m["variance_left"] is None else percent(m["variance_left"], 2, sign=False),
            ", ".join(m["sensors"][:12]) + (" …" if len(m["sensors"]) > 12 else ""),
        ]
        for name, m in r["methods"].items()
    ]
    phi = plan.targets.shapes(plan.places)
    freq = plan.targets.freq.tolist()
    with plots.paper_style():
        made = plots.figure("page", 78, 1, 2)
        for axis, matrix, name in zip(
            made.axes, (automac(phi[plan.placement.rows]), automac(phi)), ("these sensors", "all places"), strict=True
        ):
            plots.draw_mac(
                axis, np.nan_to_num(matrix), freq, freq, name_a="model", name_b="model", criterion="AutoMAC",
                colorbar=name == "all places",
            )  # fmt: skip
            axis.set_title(name)
        pictures = figures([("AutoMAC of the target modes at the chosen sensors, and at all places", made)])
    return Section(
        "Sensors",
        "The plan, what the other methods would choose, and how well each tells modes and parameters apart: largest "
        "AutoMAC off the diagonal (less is better), ln det of the shapes' products (more), share of the parameters' "
        "prior variance that is left (less).",
        [
            Table(header, rows, "rlrrrl"),
            Table(("method", "AutoMAC", "ln det Q", "variance left", "sensors"), compared, "lrrrl", frozenset({0})),
        ],
        pictures,
    )


def _exciters(run: PretestRun) -> Section:
    e = run.result["exciters"]
    ranked = [[x["dof"], fixed(x["least_relative_residue"]), str(x["weakest_mode"])] for x in e["ranking"]]
    modes = [
        [str(t["mode"]), number(t["freq"]), fixed(x), fixed(m)]
        for t, x, m in zip(run.result["targets"], e["relative_residue"], e["indicator"], strict=True)
    ]
    return Section(
        "Exciters",
        f"Chosen: {', '.join(c['dof'] for c in e['chosen'])}. A driving-point residue is told relative to the largest "
        "that any allowed place has in the mode; an indicator near 0 says that the mode stands out, near 1 that it "
        "is not seen.",
        [
            Table(("mode", "f, Hz", "relative residue", "mode indicator"), modes, "rrrr", title="With these exciters"),
            Table(("place", "least relative residue", "in mode"), ranked, "lrr", title="The best single places"),
        ],
    )


def _forecast(run: PretestRun) -> list[Section]:
    forecast = run.result.get("forecast")
    if not forecast:
        return []
    rows = [
        [p["name"], deviation(p, "prior_sd"), deviation(p, "expected_sd"),
         percent(p["learned"], 0, sign=False), "the test" if p["determined"] else "the prior"]
        for p in forecast["parameters"]
    ]  # fmt: skip
    header = ("parameter", "± before", "± expected", "learned", "told by")
    words = (
        f"Frequencies known to {percent(run.study.pretest.freq_sd, sign=False)}, shapes to "
        f"{percent(run.study.pretest.shape_sd, 0, sign=False)} of their largest "
        "component; linear about the deck's values."
    )
    notes = [f"not told apart: {' and '.join(g)}" for g in forecast["not_told_apart"]]
    return [Section("What the test would tell", words, [Table(header, rows, "lrrrl")], notes=notes)]


def _explanations(run: PretestRun) -> list[Section]:
    pairs = run.result.get("distinguish")
    if not pairs:
        return []
    rows = [
        [d["truth"], d["rival"], fixed(d["detected"], 1), fixed(d["distance"], 1), "yes" if d["told"] else "no",
         fixed(d["distance_with_all_places"], 1)]
        for d in pairs
    ]  # fmt: skip
    header = ("if there is", "taken for", "shown", "left by it", "told apart", "with all places")
    words = (
        "If the first were there with its size, by how many deviations the data would contradict the deck (shown), and "
        "what the second in its stead, of any size, would leave of them, the parameters following inside their priors; "
        "three are asked. Linear about the deck's values; supports that give way are solved as they would be, and "
        "dashpots show in damping ratios and in the phases of shapes."
    )
    lost = frozenset(i for i, d in enumerate(pairs) if not d["told"])
    return [Section("Which explanations it would tell apart", words, [Table(header, rows, "llrrlr", lost)])]


def _virtual(run: PretestRun) -> list[Section]:
    v = run.result["virtual_test"]
    if "modes" not in v:
        return []
    modes = [[number(m["freq"], 5), number(m["identified"], 5), fixed(m["mac"])] for m in v["modes"]]
    rows = [
        [
            p["name"],
            fixed(p["truth"], 4),
            fixed(p["found"], 4),
            fixed(p["sd"], 4),
            "yes" if p["within_three_sd"] else "no",
        ]
        for p in v["parameters"]
    ]
    tables = [Table(("f of the structure, Hz", "identified", "MAC"), modes, "rrr", title="Modes")]
    if rows:
        header = ("parameter", "true", "found", "±", "within three deviations")
        tables.append(Table(header, rows, "lrrrl", title="Parameters"))
    words = (
        f"The model at other parameters drawn from their priors, measured at the planned places with "
        f"{percent(run.study.pretest.noise, 1, sign=False)} noise, identified and updated on as a real test would be."
    )
    return [Section("Virtual test", words, tables, notes=[v["note"]] if v["note"] else ())]


def write_tables(folder: Path, run: PretestRun) -> list[str]:
    """Tables of sensors, exciters and target modes as CSV into `folder`; gives the names of the files."""
    r = run.result
    sensors = [
        [k, s["node"], s["direction"], *s["xyz"], *s["basic"], "placed" if s["placed"] else "new"]
        for k, s in enumerate(r["sensors"], 1)
    ]
    where = ("number", "node", "direction", "x", "y", "z", "basic X", "basic Y", "basic Z")
    write_csv(folder / "pretest.sensors.csv", (*where, "state"), sensors)
    drives = [[k, e["node"], e["direction"], *e["xyz"], *e["basic"]] for k, e in enumerate(r["exciters"]["chosen"], 1)]
    write_csv(folder / "pretest.exciters.csv", where, drives)
    modes = [
        [t["mode"], t["freq"], *t["effective_mass"], x, m]
        for t, x, m in zip(r["targets"], r["exciters"]["relative_residue"], r["exciters"]["indicator"], strict=True)
    ]
    header = ("mode", "f Hz", "mass X", "mass Y", "mass Z", "relative residue", "indicator")
    write_csv(folder / "pretest.modes.csv", header, modes)
    return ["pretest.sensors.csv", "pretest.exciters.csv", "pretest.modes.csv"]
