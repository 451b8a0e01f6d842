"""A self-test told: as JSON, as text for a terminal, and as one small page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from femend.selftest.score import COLUMNS, Outcome, Share, bin_of, false_claims, grouped

if TYPE_CHECKING:
    from femend.selftest.found import Selftest

__all__ = ["as_dict", "as_html", "as_text"]

Tables = dict[str, dict[str, dict[str, Share]]]
_HEAD = {"located": "place found", "named": "named right", "wrong": "named wrong", "missed": "missed"}
_STATE = "{done} of {asked} cases finished"

_PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>Self-test: {{ title }}</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; margin: 1rem 0 } th, td { padding: .2rem .8rem; text-align: left }
th { border-bottom: 1px solid #888 } td { border-bottom: 1px solid #ddd; font-variant-numeric: tabular-nums }
</style>
<h1>Self-test: {{ title }}</h1>
<p>{{ state }}. Every case is a truth drawn for this model, recorded with this test's forces, sensors and noise, and
diagnosed blind. Shares with Wilson 95 % intervals.</p>
{% for head, rows in tables.items() %}
<h2>{{ head }}</h2>
<table><tr><th></th>{% for name in rows[0][1] %}<th>{{ name }}</th>{% endfor %}</tr>
{% for name, cells in rows %}<tr><td>{{ name }}</td>{% for text in cells.values() %}<td>{{ text }}</td>{% endfor %}</tr>
{% endfor %}</table>
{% endfor %}
<h2>Every case</h2>
<table><tr><th>case</th><th>concealed</th><th>seen at</th><th>beyond an update</th>
<th>verdict</th><th>said</th><th>seconds</th></tr>
{% for o in outcomes %}<tr><td>{{ o.case }}</td><td>{{ o.effect }} {{ o.control }}</td>
<td>{% if o.visibility %}{{ '%.3g' % o.visibility }} x noise{% endif %}</td>
<td>{% if o.visibility %}{{ '%.2g' % o.beyond }} x noise{% endif %}</td>
<td>{{ o.verdict }}</td><td>{{ o.said }}</td><td>{{ '%.1f' % o.seconds }}</td></tr>
{% endfor %}</table>
{% for case, reason in failed.items() %}<p>case {{ case + 1 }}: {{ reason }}</p>
{% endfor %}
</html>
"""


def as_dict(found: Selftest) -> dict[str, Any]:
    """The self-test for JSON: tables of shares and every case."""
    return {
        "study": found.title,
        "seed": found.seed,
        "cases": {"asked": found.asked, "finished": len(found.outcomes), "failed": _failed(found)},
        "interrupted": found.interrupted,
        "by_effect": _plain(grouped(found.outcomes, lambda o: o.effect)),
        "by_size_beyond_update": _plain(grouped(found.outcomes, bin_of)),
        "false_claims": {kind: _share(s) for kind, s in false_claims(found.outcomes).items()},
        "outcomes": [asdict(o) for o in found.outcomes],
    }


def _failed(found: Selftest) -> dict[str, str]:
    return {str(index + 1): reason for index, reason in found.failed.items()}


def _plain(groups: Mapping[str, Mapping[str, Share]]) -> dict[str, Any]:
    return {name.strip(): {c: _share(s) for c, s in columns.items()} for name, columns in groups.items()}


def _share(share: Share) -> dict[str, Any]:
    low, high = share.interval
    return {"k": share.k, "n": share.n, "low": round(low, 4), "high": round(high, 4)}


def _tables(outcomes: tuple[Outcome, ...]) -> Tables:
    """The tables by title: rows of named shares."""
    tables: Tables = {}
    for title, key in (("Per effect", lambda o: o.effect), ("Size beyond an update", bin_of)):
        rows = grouped(outcomes, key)
        if rows:
            tables[title] = {name: {_HEAD[c]: cells[c] for c in COLUMNS} for name, cells in rows.items()}
    controls = false_claims(outcomes)
    if controls:
        tables["Nothing missing"] = {kind: {"falsely claimed": share} for kind, share in controls.items()}
    return tables


def _headline(found: Selftest) -> str:
    state = _STATE.format(done=len(found.outcomes), asked=found.asked)
    return state + (", interrupted" if found.interrupted else "")


def as_text(found: Selftest) -> str:
    """The self-test for a terminal: what would be found, named, missed and falsely claimed."""
    out = [_headline(found)]
    for title, rows in _tables(found.outcomes).items():
        head = list(next(iter(rows.values())))
        lines = [[title, *head], *([name.strip(), *(s.text for s in cells.values())] for name, cells in rows.items())]
        width = [max(len(line[i]) for line in lines) for i in range(len(head) + 1)]
        out.append("")
        out += ["  ".join(cell.ljust(w) for cell, w in zip(line, width, strict=True)).rstrip() for line in lines]
    out += [f"case {index + 1}: {reason}" for index, reason in found.failed.items()]
    return "\n".join(out)


def as_html(found: Selftest) -> str:
    """The self-test as one self-contained page; all text is escaped."""
    import jinja2

    tables = {
        title: [(name.strip(), {c: s.text for c, s in cells.items()}) for name, cells in rows.items()]
        for title, rows in _tables(found.outcomes).items()
    }
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(_PAGE)
    return template.render(
        title=found.title, state=_headline(found), tables=tables, outcomes=found.outcomes, failed=found.failed
    )
