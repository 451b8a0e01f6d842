"""The report as one self-contained HTML page: no network, no fonts or scripts from elsewhere, under about 2 MB."""

from __future__ import annotations

import json
import math
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from typing import Any, TypeVar

from femend.diagnose.deciding.stages import STAGES
from femend.numerals import plain
from femend.report import words
from femend.report.content import LawRow, ParameterRow, ReportContent
from femend.report.figures import error_bars, frf_figure, interval, places_figure, restoring_figures, trace_figure
from femend.report.headline import final_error, headline
from femend.report.mesh_view import static_picture, viewer_data
from femend.report.mismatch_map import mismatch_figure
from femend.report.numbers import factor_as_percent, ratio, significant

__all__ = ["asset", "render"]

_FIGURE_BYTES = 1_200_000
_VISIBLE = 4

_T = TypeVar("_T")


def render(content: ReportContent) -> str:
    """The page as text, to be written as UTF-8. Absent pieces of `content` are left out; all text is escaped."""
    import jinja2
    from markupsafe import Markup

    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    environment.filters.update(svg=Markup, ratio=ratio, significant=significant, percent=words.percent)
    environment.filters.update(sentence=words.sentence)
    template = environment.from_string(asset("report.html.j2"))
    mesh = viewer_data(content)
    traces, used = _drawn(content.traces, trace_figure, _FIGURE_BYTES * 2 // 5)
    frfs, _ = _drawn(content.overlays, frf_figure, _FIGURE_BYTES - used)
    return template.render(
        content=content,
        status=str(content.result.get("status") or ""),
        status_told=words.sentence(words.status_text(str(content.result.get("status") or ""))),
        advice=words.sentence(str(content.result.get("advice") or "")),
        warnings=[words.sentence(str(text)) for text in content.result.get("warnings") or ()],
        staged=bool(content.result.get("stages")),
        verdict=str(content.result.get("verdict", "")),
        verdict_name=words.verdict_name(str(content.result.get("verdict", ""))),
        headline=_unbroken(headline(content.result)),
        findings=_findings(content.result),
        error=final_error(content.result),
        fit=_fit_rows(content.result),
        mesh=mesh,
        mesh_json=Markup(_script_json(mesh)),
        mesh_svg=static_picture(mesh) if mesh else "",
        frfs=frfs,
        traces=traces,
        visible=_VISIBLE,
        left_out=len(content.overlays) + len(content.traces) - len(frfs) - len(traces),
        restoring=restoring_figures(content.restoring) if content.restoring else [],
        mismatch=mismatch_figure(mesh, content.mismatch) if mesh and content.mismatch else "",
        places=places_figure(content.places, content.place_threshold),
        laws=_law_rows(content.laws),
        pictures=[(p.caption, b64encode(p.png).decode()) for p in content.pictures],
        parameters=_parameter_rows(content),
        run=_run(content.run),
        style=Markup(asset("style.css")),
        script=Markup(asset("viewer.js") + asset("page.js")),
    )


def _drawn(items: Iterable[_T], draw: Callable[[_T], str], limit: int) -> tuple[list[tuple[_T, str]], int]:
    """Items with their figures until these reach `limit` characters, so that many sensors make no large page."""
    drawn: list[tuple[_T, str]] = []
    size = 0
    for item in items:
        if size >= limit:
            break
        figure = draw(item)
        size += len(figure)
        if figure:
            drawn.append((item, figure))
    return drawn, size


def _findings(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Each finding as words for the cards at the top."""
    shown = []
    for finding in words.rows(result.get("findings")):
        location = words.mapping(finding.get("location"))
        parameters = words.mapping(finding.get("parameters"))
        physics = words.law_of(finding)
        span = words.span_text(location)
        also = [] if span else [words.nodes_text(place) for place in location.get("also_possible") or ()]
        configurations = [str(c) for c in finding.get("configurations") or ()]
        shown.append(
            {
                "what": words.sentence(words.misplaced_text(finding)) or _name(physics, parameters),
                "where": words.place_text(location, physics),
                "sure": words.sentence(words.sure_text(finding, str(result.get("verdict", "")))),
                "span": span,
                "also": also[:6],
                "also_more": max(0, len(also) - 6),
                "sensor": words.sentence(words.sensor_text(location)) if also else "",
                "considered": words.sentence(words.considered_text(finding)),
                "values": [row for row in words.how_much(finding) if row[0] != "sides"],
                "configurations": [] if configurations == ["as modelled"] else configurations,
            }
        )
    return shown


def _name(physics: str, parameters: Mapping[str, Any]) -> str:
    return words.physics_name(physics, parameters) if physics else "no name"


def _fit_rows(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    table = words.rows(result.get("fit"))
    values = [v for row in table for s in STAGES if (v := words.number(row.get(s))) is not None]
    largest = max(values, default=1.0)
    shown = []
    for row in table:
        per_stage = [(s, words.number(row.get(s))) for s in STAGES]
        noise = words.number(row.get("noise_floor"))
        figure = {"noise": noise, "bars": error_bars(per_stage, noise, largest), **dict(per_stage)}
        shown.append({"recording": str(row.get("recording", "")), "role": str(row.get("role", "")), **figure})
    return shown


def _law_rows(laws: Sequence[LawRow]) -> list[dict[str, Any]]:
    return [
        {
            "name": words.physics_name(law.physics),
            "place": law.place,
            "n": "–" if law.n_parameters is None else law.n_parameters,
            "fit": "–" if law.misfit_fit is None else significant(law.misfit_fit),
            "choose": "–" if law.misfit_choose is None else significant(law.misfit_choose),
            "probability": words.percent(law.probability),
            "remark": law.remark,
            "chosen": law.chosen,
        }
        for law in laws
    ]


def _parameter_rows(content: ReportContent) -> list[dict[str, Any]]:
    """From the table if it was given, else from the result alone."""
    table = list(content.parameters)
    if not table:
        for name, entry in words.mapping(content.result.get("parameters")).items():
            factor = words.number(words.mapping(entry).get("factor"))
            sd = words.number(words.mapping(entry).get("sd"))
            if factor is not None:
                table.append(ParameterRow(str(name), factor, sd if sd is not None else math.nan))
    return [
        {
            "name": row.name,
            "factor": f"{row.factor:.3f}",
            "change": factor_as_percent(row.factor),
            "sd": "–" if not math.isfinite(row.sd) else f"{plain(row.sd * 100, 2)} %",
            "prior": "–" if row.prior_sd is None else f"{plain(row.prior_sd * 100, 2)} %",
            "z": "–" if row.z is None or not math.isfinite(row.z) else f"{row.z:+.1f}".replace("-", "−"),
            "far": row.z is not None and abs(row.z) > 3,
            "moved": abs(row.z) if row.z is not None and math.isfinite(row.z) else 0.0,
            "figure": interval(row.factor, row.sd, row.prior_sd),
        }
        for row in table
    ]


def _run(run: Mapping[str, Any]) -> dict[str, Any]:
    steps = [
        {
            "name": str(s.get("name", "")),
            "seconds": _digits(s.get("seconds"), 2),
            "memory": _digits(s.get("peak_memory_mb"), 0),
        }
        for s in words.rows(run.get("steps"))
    ]
    facts = []
    for key, label in (("started", "started"), ("seed", "seed"), ("threads", "threads"), ("system", "system")):
        if run.get(key) is not None:
            facts.append((label, str(run[key])))
    if words.number(run.get("seconds")) is not None:
        facts.append(("wall-clock time", f"{_digits(run['seconds'], 1)} s"))
    if words.number(run.get("peak_memory_mb")) is not None:
        facts.append(("peak memory", f"{_digits(run['peak_memory_mb'], 0)} MB"))
    versions = [f"{name} {version}" for name, version in words.mapping(run.get("versions")).items()]
    return {"steps": steps, "facts": facts, "versions": versions}


def _unbroken(text: str) -> str:
    """No line break between a number and what belongs to it."""
    return text.replace(" → ", "\u00a0→\u00a0").replace(" ± ", "\u00a0±\u00a0").replace("node ", "node\u00a0")


def _digits(value: Any, decimals: int) -> str:
    known = words.number(value)
    return "–" if known is None else f"{known:.{decimals}f}"


def _script_json(data: Any) -> str:
    """JSON that cannot end the script element it stands in."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for sign, code in (("<", "\\u003c"), (">", "\\u003e"), ("&", "\\u0026")):
        text = text.replace(sign, code)
    return text.replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def asset(name: str) -> str:
    """The text of a file of the page, by its name among the assets."""
    return resources.files("femend.report").joinpath("assets", name).read_text(encoding="utf-8")
