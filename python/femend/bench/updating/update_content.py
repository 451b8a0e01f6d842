"""An update as a page and as tables for a spreadsheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.correlation.correlation_content import frf_drawings, prepared_mesh
from femend.bench.page import Fact, Page, Section, Svg, Table, figures, fixed, number, percent
from femend.bench.steps import write_csv
from femend.bench.updating.estimates_content import estimate_sections, estimate_tables
from femend.bench.updating.field_content import field_sections, link_sections, write_field_table
from femend.bench.updating.field_result import grouped, made_for_fields
from femend.bench.updating.run_update_content import run_facts, run_sections, write_run_update_table
from femend.report import plots
from femend.report.content import Picture
from femend.report.figures import interval
from femend.report.words import sentence

if TYPE_CHECKING:
    from femend.bench.updating.update_run import UpdateRun

__all__ = ["update_page", "write_tables"]

# rows of the sensitivity picture; more would not be read
VALUES_SHOWN = 60
BADGES = {"converged": "good", "at bound": "warn", "stalled": "bad", "limit": "warn", "stopped": "warn"}


def update_page(run: UpdateRun, info: dict[str, Any], files: Sequence[str]) -> Page:
    """The page of an update; `info` is the content of run.json, `files` what stands beside it."""
    result, study = run.result, run.study
    fit = result["fit"]
    held = [r for r in result["recordings"] if r["role"] == "validate"]
    before, after = fit["freq_error"]["before"], fit["freq_error"]["after"]
    told = [n for n, p in result["parameters"].items() if p["determined"]]
    facts = [
        Fact(
            "Frequencies",
            f"{percent(before, sign=False)} → {percent(after, sign=False)}",
            "mean error of the modes that count",
        ),
        Fact("Shapes", f"{fixed(fit['mac']['before'])} → {fixed(fit['mac']['after'])}", "their mean MAC"),
        Fact(
            "Parameters told",
            f"{len(told)} of {len(result['parameters'])}",
            ", ".join(grouped(told, made_for_fields(study, run.prepared.model))[:6]) or "none",
        ),
    ]
    facts = [*(facts if run.counted else facts[2:]), *run_facts(result["runs"])]
    if run.starts is not None:
        n = len(run.starts.many.starts)
        facts.append(Fact("Starts", f"{run.starts.together} of {n}", "end where the one that was taken does"))
    if held:
        b, a = (percent(_mean(held, k, "freq_error"), sign=False) for k in ("before", "after"))
        facts.append(Fact("Held out", f"{b} → {a}", "mean frequency error of recordings that had no part"))
    return Page(
        study.title,
        "femend update",
        _headline(result),
        _badge(result),
        facts,
        sentence(result["advice"]),
        [sentence(w) for w in result["warnings"]],
        prepared_mesh(run.prepared),
        f"{len(run.prepared.placed.pairing)} sensors and shakers at their places.",
        [
            _parameters(run),
            *field_sections(run),
            *link_sections(run),
            *estimate_sections(run),
            *_recordings(run),
            *run_sections(result["runs"]),
            _search(run),
            _deck(run),
        ],
        info,
        files,
    )


def _headline(result: dict[str, Any]) -> str:
    """How many parameters were updated on how many of the measured modes, and how these are met."""
    n, counted, measured = len(result["parameters"]), result["modes"]["counted"], result["modes"]["measured"]
    head = f"{n} parameter{'s' * (n > 1)} updated"
    before, after = result["fit"]["freq_error"]["before"], result["fit"]["freq_error"]["after"]
    if not np.isfinite(after):
        return head
    met = f"met to {percent(after, sign=False)}, before to {percent(before, sign=False)}"
    if counted < measured:
        return f"{head} on {counted} of {measured} measured modes, whose frequencies are {met}"
    return f"{head}: measured frequencies are {met}"


def _badge(result: dict[str, Any]) -> tuple[str, str]:
    """The status; what is doubtful as a whole is not green, however well the search went."""
    colour = BADGES[result["status"]]
    return result["status"], "warn" if result["doubtful"] and colour == "good" else colour


def _mean(recordings: Sequence[dict[str, Any]], when: str, key: str) -> float:
    values = [r[when][key] for r in recordings if np.isfinite(r[when][key])]
    return float(np.mean(values)) if values else float("nan")


def _parameters(run: UpdateRun) -> Section:
    rows = []
    wider = ["± with misfit"] if run.result["wider"] else []
    field_of = made_for_fields(run.study, run.prepared.model)
    for name, p in run.result["parameters"].items():
        if name in field_of:
            continue  # which has a section of its own
        factor = p.get("factor")
        value = f"{factor:.4f}" if factor is not None else f"{number(p['value'])} {p['unit']}".strip()
        sd, wide, before = (
            percent(p[k], 1 if k == "prior_sd" else 2, sign=False) if factor is not None else number(p[k], 2)
            for k in ("sd", "widened_sd", "prior_sd")
        )
        rows.append(
            [
                name,
                value,
                "–" if factor is None else percent(factor - 1),
                sd,
                *[wide for _ in wider],
                before,
                fixed(p["moved_by_prior_sd"], 1),
                percent(p["learned"], 0, sign=False),
                ("the data" if p["determined"] else "the prior") + (", at its limit" if p["at_bound"] else ""),
                "" if factor is None else Svg(interval(factor, p["widened_sd" if wider else "sd"], p["prior_sd"])),
            ]
        )
    header = (
        "parameter", "factor", "change", "± now", *wider, "± before", "moved, prior sd", "learned", "told by", "",
    )  # fmt: skip
    wide_too = (
        " What is left unmet asks for wider deviations than those of the measurement: the interval has them."
        if wider
        else ""
    )
    return Section(
        "Parameters: prior to posterior",
        f"Factors of {_whose(run)}. Grey: the prior, one and two standard deviations; blue: the "
        f"estimate with its 95 % interval (Laplace).{wide_too} A parameter is told by the data where they take away "
        "more than half of its prior variance.",
        [Table(header, rows, "lrrr" + "r" * len(wider) + "rrrll")] if rows else [],
        _sensitivity(run),
        notes=[f"not told apart: {' '.join(f'{w:+.2f} {n}' for n, w in zip(c.names, c.weights, strict=True))} "
               f"(condition index {c.condition:.0f})"
               for c in run.sensitivity.collinear if not set(c.names) <= set(field_of)],
    )  # fmt: skip


def _whose(run: UpdateRun) -> str:
    """What factors are of; and what a value without percent is, where there are positions among them."""
    if run.result["solver"] is not None:
        return "the values in the solver's input files"
    morphs = run.study.updating.morph
    return "the deck's values" + (
        f", and amplitudes of positions ({', '.join(m.name for m in morphs)}), 0 in the deck" if morphs else ""
    )


def _sensitivity(run: UpdateRun) -> tuple[Picture, ...]:
    labels, rows = [], []
    at = 0
    table = run.sensitivity.table
    active = run.problem.evaluate(run.problem.unknowns.mean)
    # a rotor's runs come behind what is counted, and have no frequencies
    n_counted = len(run.counted)
    for c, config, mates in zip(
        run.counted, run.problem.configurations[:n_counted], active.mates[:n_counted], strict=True
    ):
        for response in config.responses:
            n = response.compare(active.states[run.counted.index(c)], mates, False).residual.size
            if response.name == "frequencies" and mates is not None:
                rows += list(range(at, at + n))
                labels += [f"{c.name}: f {c.numbers[t]}" for t in mates.test]
            at += n
    if not rows or table.shape[1] > 40:
        return ()
    with plots.paper_style():
        made = plots.figure("page", min(30.0 + 6.0 * len(rows[:VALUES_SHOWN]), 150.0))
        plots.draw_sensitivity(
            made.axes[0], table[rows[:VALUES_SHOWN]], labels[:VALUES_SHOWN], list(run.sensitivity.names),
            label="test sd per prior sd",
        )  # fmt: skip
        caption = "What one prior deviation of each parameter does to each frequency, in deviations of the test"
        return figures([(caption, made)])


def _recordings(run: UpdateRun) -> list[Section]:
    sections = []
    for r, before, after in zip(run.result["recordings"], run.before, run.after, strict=True):
        rows = [
            [
                str(m["mode"]),
                number(m["freq"]),
                number(m["freq_before"]),
                number(m["freq_after"]),
                percent(m["error_before"]),
                percent(m["error_after"]),
                fixed(m["mac_before"]),
                fixed(m["mac_after"]),
                "–" if m["model_mode_after"] is None else str(m["model_mode_after"]),
            ]
            for m in r["modes"]
        ]
        header = (
            "mode",
            "f test, Hz",
            "before",
            "after",
            "Δf before",
            "Δf after",
            "MAC before",
            "MAC after",
            "is model's",
        )
        lead = "Used to fit." if r["role"] == "fit" else "Held out: it had no part in the update."
        if r["sensors_left_out"]:
            lead += f" Without {', '.join(r['sensors_left_out'])}, which look mistaken: MAC and FRFs are of the others."
        if "csac" in r["before"]:
            b, a = r["before"], r["after"]
            lead += (
                f" FRFs: CSAC {fixed(b['csac'])} → {fixed(a['csac'])}, CSF {fixed(b['csf'])} → {fixed(a['csf'])}, "
                f"magnitudes off by {fixed(b['frf_error_db'], 1)} → {fixed(a['frf_error_db'], 1)} dB (rms)."
            )
        lost = frozenset(k for k, m in enumerate(r["modes"]) if m["model_mode_after"] is None)
        sections.append(
            Section(
                f"{r['recording']}: {r['configuration']}",
                lead,
                [Table(header, rows, "rrrrrrrrr", lost)],
                drawings=frf_drawings(before, after.frf),
            )
        )
    return sections


def _search(run: UpdateRun) -> Section:
    history = run.result["history"]
    rows = [
        [str(i), number(h["cost"], 6), number(h["squares"], 6), number(h["radius"], 3), "; ".join(h["notes"])]
        for i, h in enumerate(history)
    ]
    counted = [
        [c["name"], str(n), number(f, 5), percent(s / f, 3, sign=False), percent(d, 1, sign=False)]
        for c in run.result["counted"]
        for n, f, s, d in zip(c["modes"], c["freq"], c["freq_sd"], c["shape_sd"], strict=True)
    ]
    responses = ", ".join(run.result["responses"])
    begun = "" if run.strength is None else " It began where the search with the strength that was taken had ended."
    if run.surface is not None and run.surface.taken:
        begun = " The search began at the least point of the response surface."
    if run.starts is not None and run.starts.at_start != 0:
        begun = f" The search that was taken began at start {run.starts.at_start + 1}."
    return Section(
        "The search",
        f"Compared: {responses}. The cost is the sum of squared differences in deviations of the test and of the prior "
        f"({run.result['squares']['values']} values).{begun}",
        [
            Table(("step", "cost", "squares", "radius", "what happened"), rows, "rrrrl"),
            Table(
                ("recording", "mode", "f, Hz", "± f", "± shape"), counted, "lrrrr", title="What counted, and how well"
            ),
        ],
    )


def _deck(run: UpdateRun) -> Section:
    diff = run.deck.diff or "nothing changes"
    shown = diff if len(diff) < 8000 else diff[:8000] + "\n…"
    if run.result["solver"] is None:
        return Section(
            "The deck", "model.updated.bdf differs from the deck in these lines; model.diff has them all.", code=shown
        )
    solver, names = run.result["solver"], ", ".join(run.updated_files())
    values = solver["values"].items()
    rows = [[n, number(v, 6), number(v * run.factors[n], 6), percent(run.factors[n] - 1)] for n, v in values]
    return Section(
        "The solver",
        f"{' '.join(solver['command'])}: {solver['runs']} runs, {solver['failed']} of them without a result; what runs "
        f"gave is kept in {solver['folder']} and taken from there. It computed what is compared before and after, and "
        f"in the search. {names}: input files with the values found, which differ in these lines.",
        [Table(("value", "before", "after", "change"), rows, "lrrr")],
        code=shown,
    )


def write_tables(folder: Path, run: UpdateRun) -> list[str]:
    """Tables of parameters and modes as CSV into `folder`; gives the names of the files."""
    parameters = [
        [n, p.get("factor", p.get("value")), p["sd"], p["widened_sd"], p["before"], p["prior_sd"],
         p["moved_by_prior_sd"], p["learned"], "data" if p["determined"] else "prior"]
        for n, p in run.result["parameters"].items()
    ]  # fmt: skip
    header = (
        "parameter",
        "value",
        "sd",
        "sd with misfit",
        "before",
        "prior sd",
        "moved by prior sd",
        "learned",
        "told by",
    )
    write_csv(folder / "updating.parameters.csv", header, parameters)
    keys = ("mode", "freq", "freq_before", "freq_after", "error_before", "error_after", "mac_before", "mac_after")
    modes = [[r["recording"], r["role"], *(m[k] for k in keys)] for r in run.result["recordings"] for m in r["modes"]]
    write_csv(folder / "updating.modes.csv", ("recording", "role", *keys), modes)
    return [
        "updating.parameters.csv",
        "updating.modes.csv",
        *estimate_tables(folder, run),
        *write_field_table(folder, run),
        *write_run_update_table(folder, run.result["runs"]),
    ]
