"""One self-contained HTML page of tables, pictures and words, in the look of the report."""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from femend.numerals import plain
from femend.report.content import Picture
from femend.report.page import asset

__all__ = ["Fact", "Page", "Section", "Table", "figures", "render_page"]


@dataclass(frozen=True)
class Table:
    """A table: `header`, `rows` of text, `align` with "l" or "r" per column; `marked` rows (from 0) stand out. A cell
    that is an `Svg` is drawn."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    align: str
    marked: frozenset[int] = frozenset()
    title: str = ""


class Svg(str):
    """A drawing that a cell of a table holds, as SVG made by femend itself."""


@dataclass(frozen=True)
class Fact:
    """One of the boxes at the top: a heading, the fact, and a remark."""

    head: str
    big: str
    small: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the page: `title`, words, `tables`, `pictures`, `drawings` (caption, SVG made by femend), `code` as it
    stands in a file, and `notes`."""

    title: str
    lead: str = ""
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    drawings: Sequence[tuple[str, str]] = ()
    code: str = ""
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Page:
    """All that a page shows. `kind` is what it is ("femend correlation"), `badge` a word with its colour ("good",
    "warn", "bad"), `mesh` the SVG of the model, `files` what stands beside the page."""

    title: str
    kind: str
    headline: str
    badge: tuple[str, str]
    facts: Sequence[Fact] = ()
    advice: str = ""
    warnings: Sequence[str] = ()
    mesh: str = ""
    mesh_words: str = ""
    sections: Sequence[Section] = ()
    run: Mapping[str, Any] = field(default_factory=dict)
    files: Sequence[str] = ()


def render_page(page: Page) -> str:
    """The `page` as text, to be written as UTF-8: no network, nothing from elsewhere; all text is escaped."""
    import jinja2
    from markupsafe import Markup

    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    environment.filters.update(svg=Markup, cell=lambda text: Markup(text) if isinstance(text, Svg) else text)
    return environment.from_string(asset("bench.html.j2")).render(
        page=page,
        png=lambda picture: b64encode(picture.png).decode(),
        steps=[(s["name"], f"{s['seconds']:.2f}") for s in page.run.get("steps", ())],
        versions=[f"{name} {version}" for name, version in dict(page.run.get("versions", {})).items()],
        style=Markup(asset("style.css")),
        script=Markup(asset("page.js")),
    )


def number(value: float | None, digits: int = 4) -> str:
    """A number for a table, an en dash where there is none."""
    return "–" if value is None or not math.isfinite(value) else plain(value, digits)


def percent(value: float | None, digits: int = 2, sign: bool = True) -> str:
    """A share as percent, an en dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{round(100 * value, digits) + 0.0:{'+' if sign else ''}.{digits}f} %".replace("-", "−")


def deviation(parameter: Mapping[str, Any], key: str) -> str:
    """The deviation `key` of a forecast `parameter`: a share as percent, with its unit where it is an amplitude."""
    if "unit" in parameter:
        return f"{number(parameter[key], 3)} {parameter['unit']}".strip()
    return percent(parameter[key], 2, sign=False)


def fixed(value: float | None, digits: int = 3) -> str:
    """A number with so many decimals, an en dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def figures(drawn: Sequence[tuple[str, Any]]) -> tuple[Picture, ...]:
    """Pictures of (caption, matplotlib figure) as PNG."""
    from io import BytesIO

    found = []
    for caption, figure in drawn:
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=180)
        found.append(Picture(caption, buffer.getvalue()))
    return tuple(found)
