"""The mismatch map: what a free force at each node leaves, on the mesh of bars, shells and solids."""

from __future__ import annotations

import re
import runpy
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.diagnose.deciding.mismatch import mismatch_map
from femend.diagnose.locating.locate import squares_of
from femend.diagnose.locating.recovered import recover
from femend.report.content import Marker, MeshPicture, MismatchMap, ReportContent
from femend.report.mesh_view import viewer_data
from femend.report.mismatch_map import N_LEVELS, mismatch_figure, on_mesh
from femend.report.page import render
from femend.report.plots import draw_mismatch, figure
from femend.study.result.study_run import StudyRun
from femend.study.shown.content import report_content
from femend.study.shown.curves import accepted, restoring_force

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

E = (7.3e10, 6.8e10)
SPRING = small_study.Truth(E, ("CELAS2,900,3e4,7,3",))
STOP = small_study.Truth(E, laws=[(7, "clearance", {"k": 5e4, "gap": 2e-5, "sides": 1.0})])


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    return small_study.diagnosed(tmp_path_factory.mktemp("spring"), SPRING)


@pytest.fixture(scope="module")
def found(spring: StudyRun) -> MismatchMap:
    given = mismatch_map(spring.diagnosis)
    assert given is not None
    return MismatchMap(*given)


def test_a_force_at_the_true_place_leaves_least(spring: StudyRun, found: MismatchMap) -> None:
    assert spring.result["findings"][0]["location"]["nodes"] == [7]
    # every node that is free in Z or turns with the beam, the clamped one too where it was tried
    assert set(found.nodes.tolist()) >= set(range(2, 14))
    assert found.nodes[np.argmin(found.share)] == 7
    assert 0 < found.share.min() < 0.1
    assert found.share.max() <= 1.0
    far = found.share[found.nodes == 13][0]
    assert far > 3 * found.share.min()


def test_with_many_sensors_fewer_nodes_are_tried(spring: StudyRun, monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("femend.diagnose.deciding.mismatch")
    monkeypatch.setattr(module, "MOST", 40)
    few = mismatch_map(spring.diagnosis)
    monkeypatch.setattr(module, "SENSORS", 1)
    many = mismatch_map(spring.diagnosis)
    assert few is not None
    assert many is not None
    assert 2 <= len(many[0]) < len(few[0])
    # the best place is among them
    assert many[0][np.argmin(many[1])] == 7


def test_shares_are_those_of_the_places_that_were_fitted_to_their_end(spring: StudyRun, found: MismatchMap) -> None:
    d = spring.diagnosis
    first = d.located[0]
    assert first.place.nodes == (7,)
    # fewer lines here, more of them on resonances, where updating leaves most
    before = d.null.prior + squares_of(d.problem, d.null, 0.0)
    assert 0.5 < found.share.min() / (first.cost / before) < 2.0


def test_there_is_no_map_where_nothing_is_missing(spring: StudyRun) -> None:
    d = spring.diagnosis
    assert mismatch_map(replace(d, settings=replace(d.settings, consistent=2 * d.null.score))) is None
    assert mismatch_map(replace(d, located=[])) is None


def shell() -> tuple[MeshPicture, MismatchMap]:
    """Two by one quadrilaterals; a force at node 6 leaves least, node 3 was not tried."""
    xyz = np.array([[x, y, 0.0] for y in (0.0, 1.0) for x in (0.0, 1.0, 2.0)])
    faces = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    mesh = MeshPicture(np.arange(1, 7), xyz, faces=faces)
    return mesh, MismatchMap(np.array([1, 2, 4, 5, 6]), np.array([1.0, 0.8, 0.9, 0.1, 0.001]))


def test_a_node_that_was_not_tried_is_drawn_as_the_nearest_one() -> None:
    mesh, given = shell()
    assert on_mesh(given, mesh.xyz, mesh.node_ids).tolist() == [1.0, 0.8, 0.8, 0.9, 0.1, 0.001]
    other = MismatchMap(np.array([77]), np.array([0.5]))
    assert np.isnan(on_mesh(other, mesh.xyz, mesh.node_ids)).all()


def test_the_report_has_the_map_in_levels(spring: StudyRun) -> None:
    mesh, given = shell()
    content = ReportContent("plate", {"verdict": "missing-physics"}, mesh=mesh, located=(6,), mismatch=given)
    drawn = mismatch_figure(viewer_data(content) or {}, given)
    assert drawn.count('<path class="face m') == 2
    assert drawn.count('class="key m') == N_LEVELS
    # the mean of the corners: levels 0, 0, 0 and 2 of the one face, 0, 0, 2 and 7 of the other
    assert sorted(int(part[0]) for part in drawn.split('class="face m')[1:]) == [0, 2]
    assert "0.1 %" in drawn
    assert "100 %" in drawn
    assert mismatch_figure(viewer_data(content) or {}, MismatchMap(np.array([77]), np.array([0.5]))) == ""
    page = render(report_content(spring, {}))
    assert "Mismatch map" in page
    # bars have colours as faces do, the mean of their ends
    assert {'class="wire m0"', 'class="wire m6"'} <= set(re.findall(r'class="wire m[0-9]"', page))
    assert "Mismatch map" not in render(replace(content, mismatch=None))


def test_the_picture_draws_bars_and_faces(spring: StudyRun, found: MismatchMap) -> None:
    mesh, given = shell()
    drawn = figure()
    draw_mismatch(drawn.axes[0], mesh, given, located=(6,), sensors=(Marker("2:Z", 2),), shakers=(Marker("4:Z", 4),))
    (skin,) = (c for c in drawn.axes[0].collections if len(c.get_paths()) == 2 and c.get_array() is not None)
    # from the back to the front: the face at node 6 comes first
    assert sorted(skin.get_array()) == pytest.approx([(0.8 * 0.8 * 0.001 * 0.1) ** 0.25, (0.8 * 0.1 * 0.9) ** 0.25])
    assert {t.get_label() for t in drawn.axes[0].collections} >= {"found place", "sensor", "shaker"}
    with pytest.raises(ValueError, match="none of the 1 nodes"):
        draw_mismatch(figure().axes[0], mesh, MismatchMap(np.array([77]), np.array([0.5])))


@pytest.mark.slow
def test_the_force_is_recovered_on_all_lines(tmp_path: Path) -> None:
    stop = small_study.diagnosed(tmp_path, STOP)
    force, ranked = restoring_force(stop), accepted(stop.diagnosis)
    assert force is not None
    assert force.law_f is not None
    assert ranked is not None
    assert ranked.recovered is not None

    def roughness(d: np.ndarray, f: np.ndarray) -> float:
        """Share of the force that is no function of the displacement: what differs between neighbours in it."""
        return float(np.std(np.diff(f[np.argsort(d)])) / np.std(f))

    best, problem = stop.diagnosis.best, stop.diagnosis.problem
    assert best is not None
    assert best.joint is not None
    (record,) = (r for r in problem.records if r.name == force.recording)
    few = recover(problem.on([record]).thinned(60), best.joint, best.p)
    assert few is not None
    # a stop's force reaches beyond the band in which it is read off
    alike = [np.corrcoef(f, force.law_f)[0, 1] for f in (force.f, few.f[0][0])]
    assert alike[0] > 0.4
    assert alike[0] > alike[1] + 0.1, alike
    assert roughness(force.d, force.f) < roughness(few.d[0][0], few.f[0][0])


def readme_picture(project_root: Path) -> dict[str, Any]:
    return runpy.run_path(str(project_root / "benches" / "readme_picture.py"))


def test_the_readme_shows_the_picture(project_root: Path) -> None:
    script = readme_picture(project_root)
    picture = script["PICTURE"]
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture.stat().st_size <= 200_000
    readme = (project_root / "README.md").read_text(encoding="utf-8")
    introduction = readme.split("\n## ")[0]
    assert f"]({picture.relative_to(project_root).as_posix()})" in introduction
    assert "benches/readme_picture.py" in introduction


def test_the_script_draws_a_study(project_root: Path, tmp_path: Path, spring: StudyRun) -> None:
    script = readme_picture(project_root)
    held = script["held_out"](spring, name="held")
    first, last = script["stretch"](held.measured[0])
    assert 0 <= first < last <= held.measured.shape[1]
    drawn = script["draw"](spring, held)
    labels = [t.get_text() for ax in drawn.axes for t in (ax.get_legend().get_texts() if ax.get_legend() else ())]
    assert {"found place", "recovered, no law assumed", "measured"} <= set(labels)
    before, after = (float(text.split("NRMSE ")[1]) for text in labels if "NRMSE" in text)
    assert after < before
    units = {ax.get_xlabel() for ax in drawn.axes} | {ax.get_ylabel() for ax in drawn.axes}
    assert units >= {"displacement at the place, mm", "force, N", "time, s", "acceleration, m/s²"}
    script["save"](drawn, tmp_path / "picture.png")
    assert 10_000 < (tmp_path / "picture.png").stat().st_size <= 200_000
