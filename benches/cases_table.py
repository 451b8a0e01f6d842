"""The README's table of diagnosed cases:

    python benches/cases_table.py RESULTS CASES [--scorer ../shared/cases/score.py]

RESULTS/<case>/ is what `femend diagnose CASES/<case>/public/study.toml --out RESULTS/<case>` wrote. The scorer's rows
are joined with the seconds and the peak memory of run.json and printed as a markdown table. Nothing here reads what a
case conceals; the scorer does. It needs pyuff.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import math
import runpy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

HEADER = (
    "case",
    "concealed",
    "verdict",
    "named",
    "located",
    "right name",
    "NRMSE updated",
    "NRMSE final",
    "seconds",
    "peak MB",
)


def scored(scorer: Path, results: Path, cases: Path) -> tuple[list[dict[str, Any]], str]:
    """The scorer's rows and the closing line that it prints."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        rows = runpy.run_path(str(scorer))["main"](str(results), str(cases))
    return rows, said.getvalue().rstrip().splitlines()[-1]


def cost(folder: Path) -> tuple[str, str]:
    """Seconds and peak memory (MB) of a run; dashes where it left no run.json."""
    path = folder / "run.json"
    if not path.is_file():
        return "–", "–"
    run = json.loads(path.read_text(encoding="utf-8"))
    memory = run.get("peak_memory_mb")
    return f"{run['seconds']:.0f}", "–" if memory is None else f"{memory:.0f}"


def markdown(rows: Sequence[Mapping[str, Any]], closing: str, results: Path) -> str:
    """The table, with the scorer's closing line below it."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    for row in rows:
        control = row["truth"] == "none"
        right = "silent" if control else "yes"
        cells = (
            row["case"],
            "nothing (control)" if control else row["truth"],
            row["verdict"],
            row["named"] or "–",
            right if row["located"] else "no",
            right if row["exact"] else "no",
            _figure(row.get("before")),
            _figure(row.get("after")),
            *cost(results / row["case"]),
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", closing[:1].upper() + closing[1:] + "."])


def _figure(value: float | None) -> str:
    return "–" if value is None or not math.isfinite(value) else f"{value:.3f}"


def main() -> None:
    """Prints the table of the cases whose results stand in a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("cases", type=Path)
    parser.add_argument("--scorer", type=Path, default=Path("../shared/cases/score.py"))
    asked = parser.parse_args()
    rows, closing = scored(asked.scorer, asked.results, asked.cases)
    print(markdown(rows, closing, asked.results))


if __name__ == "__main__":
    main()
