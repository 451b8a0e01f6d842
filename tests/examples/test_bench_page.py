"""The study file that the page of updating shows, through all three commands."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner

from femend import load_study
from femend.cli import main
from femend.study.file.bench_settings import UpdatingSettings
from femend.study.file.morph_tables import MOVES
from femend.study.file.schema import CorrelationTable, PretestTable, UpdatingTable

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import TRUE_E, Recorded, write_study


@pytest.fixture
def shown(project_root: Path) -> str:
    page = (project_root / "python" / "docs" / "updating.md").read_text(encoding="utf-8")
    (whole,) = (block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if block.startswith("format ="))
    return str(whole)


def test_the_page_shows_every_key(shown: str) -> None:
    tables = tomllib.loads(shown)
    for name, kind in (("correlation", CorrelationTable), ("updating", UpdatingTable), ("pretest", PretestTable)):
        known = {f.encode_name for f in msgspec.structs.fields(kind)}
        # modes take the place of the band, design_points go with a surface, strengths with a regularisation, which a
        # comment shows; tables of their own have examples of their own
        apart = {"morph", "field", "link", "structure", "design_points", "regularisation", "strengths"}
        known -= {"pretest": {"modes"}, "updating": apart}.get(name, set())
        assert set(tables[name]) == known


def test_the_page_shows_every_move(project_root: Path, shown: str, tmp_path: Path) -> None:
    page = (project_root / "python" / "docs" / "updating.md").read_text(encoding="utf-8")
    (example,) = (block for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[updating.morph]]" in block)
    path = write_study(tmp_path, (Recorded("tip"), Recorded("more", mass=(7, 0.15)), Recorded("middle", "validate", 9)))
    path.write_text(shown + example)
    assert [m.name for m in load_study(path).updating.morph] == ["apex", "corner"]
    for move, (needed, more) in MOVES.items():
        (row,) = re.findall(rf'^\| `"{move}"` \| (.*) \| `\S+` \|$', page, re.MULTILINE)
        assert re.findall(r"`(\w+)`", row) == [*needed, *more]


def test_the_study_of_the_page_runs(shown: str, tmp_path: Path) -> None:
    path = write_study(tmp_path, (Recorded("tip"), Recorded("more", mass=(7, 0.15)), Recorded("middle", "validate", 9)))
    path.write_text(shown)
    settings = load_study(path).updating
    assert settings == UpdatingSettings(modes=(1, 2, 3))
    for command, page in (("pretest", "pretest"), ("correlate", "correlation"), ("update", "updating")):
        done = CliRunner().invoke(main, [command, str(path), "--out", str(tmp_path / command)])
        assert done.exit_code == 0, done.output
        assert (tmp_path / command / f"{page}.html").is_file()
    updated = (tmp_path / "update" / "model.updated.bdf").read_text()
    E = [float(line.split(",")[2]) for line in updated.splitlines() if line.startswith("MAT1")]
    np.testing.assert_allclose(E, TRUE_E, rtol=2e-3)
