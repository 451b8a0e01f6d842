"""A correlation as a page and as tables for a spreadsheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.correlation.run_content import run_section
from femend.bench.correlation.weighed import weighed_words
from femend.bench.correlation.where_wrong_content import where_sections
from femend.bench.page import Fact, Page, Section, Table, figures, fixed, number, percent
from femend.bench.reading.compared import Compared
from femend.bench.steps import drawn_model, marker, write_csv
from femend.correlate import match_frfs
from femend.data import FRF
from femend.model import Pair
from femend.report import plots
from femend.report.content import FrfOverlay, Picture
from femend.report.figures import frf_figure
from femend.report.words import sentence
from femend.units import unit_system

if TYPE_CHECKING:
    from femend.bench.correlation.correlation_run import CorrelationRun
    from femend.bench.reading.prepared import Prepared

__all__ = ["correlation_page", "frf_drawings", "mode_rows", "prepared_mesh", "write_tables"]

# rows of a table per sensor, and FRFs that are drawn
SENSORS_SHOWN, FRFS_SHOWN = 30, 4
MODE_HEADER = ("test", "model", "f test, Hz", "f model, Hz", "Δf", "ζ test", "MAC", "cluster")


def correlation_page(done: CorrelationRun, run: dict[str, Any], files: Sequence[str]) -> Page:
    """The page of a correlation that is `done`; `run` is the content of run.json, `files` what stands beside it."""
    prepared, compared, result = done.prepared, done.compared, done.result
    n, of = sum(c.n_pairs for c in compared), sum(c.n_test for c in compared)
    errors = [abs(r.freq_difference) for c in compared for r in c.comparison.table.rows]
    macs = [r.mac for c in compared for r in c.comparison.table.rows]
    mean = percent(float(np.mean(errors)), sign=False) if errors else "–"
    facts = (
        []
        if not compared
        else [
            Fact("Modes paired", f"{n} of {of}", f"MAC of at least {prepared.study.correlation.mac_min:g}"),
            Fact(
                "Frequencies", f"off by {mean}", f"on average, {percent(max(errors, default=None), sign=False)} at most"
            ),
            Fact("Shapes", f"MAC {fixed(float(np.mean(macs)) if macs else None)}", "on average over the pairs"),
        ]
    )
    frfs = [r["frfs"] for r in result["recordings"] if "frfs" in r]
    if frfs:
        csac = float(np.mean([f["mean_csac"] for f in frfs]))
        facts.append(Fact("FRFs", f"CSAC {fixed(csac)}", f"CSF {fixed(float(np.mean([f['mean_csf'] for f in frfs])))}"))
    each = zip(compared, result["recordings"], strict=True)
    sections = [
        section
        for (c, r), w in zip(each, done.wrong, strict=True)
        for section in (_section(c, r["orthogonality"]), *where_sections(done, c, w))
    ]
    units = unit_system(prepared.study.units)
    sections += [run_section(c, r, units) for c, r in zip(done.runs, result["runs"], strict=True)]
    said = []
    if compared:
        said.append(f"{n} of {of} measured modes are paired with the model, their frequencies off by {mean} on average")
    peaks, mates = sum(c.measured.peaks.size for c in done.runs), sum(c.n_pairs for c in done.runs)
    more, words = _of_runs(peaks, mates, [h["csac"] for r in result["runs"] for h in r["held"]])
    said = [*said, *words] or ["no run has a peak that could be compared with the model's modes"]
    return Page(
        prepared.study.title,
        "femend correlation",
        "; ".join(said),
        _judged(n + mates, of + peaks),
        [*facts, *more],
        sentence(result["advice"]),
        [sentence(w) for w in result["warnings"]],
        prepared_mesh(prepared),
        f"{len(prepared.placed.pairing)} sensors and shakers at their places."
        + weighed_words(result["model"], prepared.study.units)
        + (
            "" if result["solver"] is None else f" Its modes are what {' '.join(result['solver']['command'])} computes."
        ),
        [*sections, _sensors(prepared)],
        run,
        files,
    )


def _of_runs(peaks: int, mates: int, held: Sequence[float | None]) -> tuple[list[Fact], list[str]]:
    """What is told first of a rotor's runs: how many `peaks` have `mates`, and the CSAC at speeds that are `held`."""
    facts, said = [], []
    if peaks:
        facts.append(Fact("Runs", f"{mates} of {peaks} peaks", "have the shape of a mode of the model"))
        said.append(f"{mates} of {peaks} peaks of operating shapes look like a mode of the model")
    if held:
        known = [c for c in held if c is not None]
        csac = fixed(float(np.mean(known)) if known else None)
        facts.append(Fact("Held speeds", f"CSAC {csac}", f"on average over {len(held)}"))
        said.append(f"operating shapes at {len(held)} held speeds have a CSAC of {csac} with the model's on average")
    return facts, said


def _judged(n: int, of: int) -> tuple[str, str]:
    """The page's mark where `n` of so many modes and peaks are paired."""
    if not of:
        return "nothing to pair", "warn"
    return ("all paired", "good") if n == of else ("modes without a mate", "warn") if n else ("nothing paired", "bad")


def prepared_mesh(prepared: Prepared) -> str:
    """The model with its sensors and shakers, as SVG."""
    placed, model = {p.sensor: p for p in prepared.placed.pairing}, prepared.model
    inputs = {d for m in prepared.measured if m.frf is not None for d in m.frf.input_dofs if d is not None}
    sensors = {d for m in prepared.measured for d in m.modes.dofs} | {d for r in prepared.runs for d in r.dofs}
    return drawn_model(
        model,
        [marker(placed[d].dof, model, str(d), placed[d].point) for d in sorted(sensors)],
        [marker(placed[d].dof, model, str(d), placed[d].point) for d in sorted(inputs)],
    )


def mode_rows(c: Compared) -> list[list[str]]:
    """The mode table as text: pairs, then modes of both sides without a mate."""
    t = c.comparison.table
    rows = [
        [
            str(r.a + 1),
            str(r.b + 1),
            number(r.freq_a),
            number(r.freq_b),
            percent(r.freq_difference),
            percent(r.zeta_a, sign=False),
            fixed(r.mac),
            "" if r.cluster is None else str(r.cluster + 1),
        ]
        for r in t.rows
    ]
    rows += [[str(k + 1), "–", number(f), "–", "–", percent(float(c.test.zeta[k]), sign=False), "–", ""]
             for k, f in t.alone_a]  # fmt: skip
    top = float(c.test.freq[-1])
    rows += [["–", str(k + 1), "–", number(f), "–", "–", "–", ""] for k, f in t.alone_b if f <= top]
    return rows


def _section(c: Compared, orthogonality: list[dict[str, Any]] | None) -> Section:
    m = c.measured
    lone = [k for k, r in enumerate(mode_rows(c)) if r[1] == "–"]
    tables = [Table(MODE_HEADER, mode_rows(c), "rrrrrrrr", frozenset(lone), "Modes")]
    if c.comac is not None and c.ecomac is not None and c.macco is not None:
        order = np.argsort(-c.ecomac, kind="stable")[:SENSORS_SHOWN]
        rows = [
            [str(c.dofs[i]), fixed(float(c.comac[i])), fixed(float(c.ecomac[i])), fixed(float(np.nanmean(c.macco[i])))]
            for i in order
        ]
        tables.append(Table(("sensor", "CoMAC", "eCoMAC", "MAC without it, gain"), rows, "lrrr", title="By sensor"))
    if c.frfs is not None:
        rows = [
            [str(o), str(i), fixed(float(c.frfs.frac[a, b])), fixed(float(c.frfs.faac[a, b]))]
            for a, o in enumerate(c.frfs.matched.outputs)
            for b, i in enumerate(c.frfs.matched.inputs)
        ]
        worst = sorted(rows, key=lambda r: r[2])[:SENSORS_SHOWN]
        tables.append(Table(("output", "input", "FRAC", "FAAC"), worst, "llrr", title="FRFs, the worst first"))
    if orthogonality:
        rows = [
            [r["reduction"], *(fixed(r[k]) for k in ("off_model", "off_test", "least_pair", "off_cross")), r["status"]]
            for r in orthogonality
        ]
        header = ("mass reduced by", "model, off", "test, off", "least pair", "cross, off", "")
        title = "Orthogonality of the pairs (asked by NASA-STD-5002: pairs at least 0.9, all else at most 0.1)"
        tables.append(Table(header, rows, "lrrrrl", title=title))
    held = "" if m.role == "fit" else ", held out (only ever scored)"
    return Section(
        f"{m.name}: {m.configuration}",
        f"{c.n_test} modes {m.how}{held}, compared at {len(c.dofs)} DOFs. Marked rows are measured modes without a "
        "mate.",
        tables,
        _pictures(c),
        frf_drawings(c),
        notes=c.comparison.table.notes,
    )


def _pictures(c: Compared) -> tuple[Picture, ...]:
    name = c.measured.name
    with plots.paper_style():
        made = plots.figure("page", 78, 1, 2)
        shown = min(c.modes.n_modes, max(c.n_test + 4, int(np.sum(c.modes.freq <= 1.1 * c.test.freq[-1]))))
        pairs = [(p.a, p.b) for p in c.comparison.pairing.pairs if p.b < shown]
        plots.draw_mac(
            made.axes[0], np.nan_to_num(c.comparison.mac[:, :shown]), list(c.test.freq), list(c.modes.freq[:shown]),
            pairs=pairs, colorbar=False,
        )  # fmt: skip
        plots.draw_mac(
            made.axes[1], np.nan_to_num(c.automac), list(c.test.freq), list(c.test.freq), name_b="test",
            criterion="AutoMAC",
        )  # fmt: skip
        drawn = [(f"{name}: MAC of test and model, pairs framed; AutoMAC of the test", made)]
        if c.frfs is not None:
            made = plots.figure("page", 60)
            curves = {"CSAC (shape)": np.nan_to_num(c.frfs.csac), "CSF (level)": np.nan_to_num(c.frfs.csf)}
            plots.draw_signature(made.axes[0], c.frfs.matched.freq, curves, criterion="CSAC, CSF")
            drawn.append((f"{name}: agreement of the FRFs line by line", made))
        return figures(drawn)


def frf_drawings(c: Compared, after: FRF | None = None) -> list[tuple[str, str]]:
    """The largest FRFs, measured and of the model, and with `after` those of the updated one, as SVG."""
    if c.frfs is None:
        return []
    m = c.frfs.matched
    found = []
    size = np.abs(m.H_a).max(axis=0)
    updated = None if after is None else match_frfs(c.measured.frf, after).H_b  # type: ignore[arg-type]
    for k in np.argsort(-size, axis=None)[:FRFS_SHOWN]:
        o, i = (int(v) for v in np.unravel_index(int(k), size.shape))
        label = f"{m.outputs[o]} / {m.inputs[i]}"
        last = None if updated is None else updated[:, o, i]
        curves = FrfOverlay(m.freq, m.H_a[:, o, i], m.H_b[:, o, i], last, None, label, c.measured.name, m.unit)
        found.append((f"{c.measured.name}: {label}", frf_figure(curves)))
    return found


def _sensors(prepared: Prepared) -> Section:
    placed = prepared.placed
    rows = [[str(p.sensor), _place(p), p.by, number(p.distance, 3)] for p in placed.pairing]
    a = placed.alignment
    words = (
        "Sensors belong to nodes by their number; where the test has other ones, to the element on which they lie "
        "between nodes, or to the nearest node."
    )
    if a is not None:
        rms = float(np.sqrt(np.mean(a.distance**2)))
        words += (
            f" The test's geometry lies on the model's within {number(rms, 2)} (rms), with scale {a.scale:.6g}"
            + (", brought onto it" if placed.applied else "")
            + "."
        )
    header = ("sensor", "DOF of the model", "by", "distance")
    return Section("Sensors", words, [Table(header, rows[:200], "lllr")])


def _place(pair: Pair) -> str:
    """A sensor's place in the model: a DOF, or the nodes of the element on which it is."""
    if pair.point is None:
        return str(pair.dof)
    direction = str(pair.dof).split(":")[1]
    return f"{direction} between {', '.join(map(str, pair.point.nodes))}"


def write_tables(folder: Path, compared: Sequence[Compared]) -> list[str]:
    """Tables of modes, of sensors and of FRFs as CSV into `folder`; gives the names of the files."""
    modes, dofs, pairs = [], [], []
    for c in compared:
        name, role = c.measured.name, c.measured.role
        for r in c.comparison.table.rows:
            modes.append([name, role, r.a + 1, r.b + 1, r.freq_a, r.freq_b, r.freq_difference, r.zeta_a, r.mac])
        modes += [[name, role, k + 1, "", f, "", "", float(c.test.zeta[k]), ""] for k, f in c.comparison.table.alone_a]
        if c.comac is not None and c.ecomac is not None and c.macco is not None:
            gain = np.nanmean(c.macco, axis=1)
            dofs += [[name, str(d), c.comac[i], c.ecomac[i], gain[i]] for i, d in enumerate(c.dofs)]
        if c.frfs is not None:
            m = c.frfs.matched
            pairs += [
                [name, str(o), str(i), c.frfs.frac[a, b], c.frfs.faac[a, b]]
                for a, o in enumerate(m.outputs) for b, i in enumerate(m.inputs)
            ]  # fmt: skip
    header = ("recording", "role", "test mode", "model mode", "f test Hz", "f model Hz", "df", "zeta test", "MAC")
    write_csv(folder / "correlation.modes.csv", header, modes)
    write_csv(folder / "correlation.sensors.csv", ("recording", "sensor", "CoMAC", "eCoMAC", "MACCo"), dofs)
    names = ["correlation.modes.csv", "correlation.sensors.csv"]
    if pairs:
        write_csv(folder / "correlation.frfs.csv", ("recording", "output", "input", "FRAC", "FAAC"), pairs)
        names.append("correlation.frfs.csv")
    return names
