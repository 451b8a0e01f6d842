"""The table of diagnosed cases, from a scorer's rows and the runs' own figures."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

SCORER = """
def main(results, cases):
    print("a table")
    print("located 1/1, controls silent 1/1")
    return [
        dict(case="a1", truth="none", verdict="consistent", named="", located=True, exact=True,
             before=0.02, after=0.02),
        dict(case="a2", truth="added_mass", verdict="missing-physics", named="clearance", located=True, exact=False,
             before=0.5, after=float("inf")),
        dict(case="a3", truth="added_mass", verdict="no result", named="", located=False, exact=False),
    ]
"""


def test_rows_become_a_markdown_table(project_root: Path, tmp_path: Path) -> None:
    scorer, results = tmp_path / "score.py", tmp_path / "results"
    scorer.write_text(SCORER, encoding="utf-8")
    (results / "a2").mkdir(parents=True)
    (results / "a2" / "run.json").write_text(json.dumps({"seconds": 61.26, "peak_memory_mb": 412.4}), encoding="utf-8")
    script = runpy.run_path(str(project_root / "benches" / "cases_table.py"))
    rows, closing = script["scored"](scorer, results, tmp_path)
    lines = script["markdown"](rows, closing, results).splitlines()
    assert lines[2] == "| a1 | nothing (control) | consistent | – | silent | silent | 0.020 | 0.020 | – | – |"
    assert lines[3] == "| a2 | added_mass | missing-physics | clearance | yes | no | 0.500 | – | 61 | 412 |"
    assert lines[4] == "| a3 | added_mass | no result | – | no | no | – | – | – | – |"
    assert lines[-1] == "Located 1/1, controls silent 1/1."
    assert len({line.count("|") for line in lines[:-2]}) == 1
