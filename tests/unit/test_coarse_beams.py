"""Beams that are too long for the waves of a band: which they are, and a frame in which they are cut."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.locating.locate import locate
from femend.diagnose.naming.hinges import inside
from femend.diagnose.updating.update import update_model
from femend.model import Model, Parameter, affordable_refinement, find_places, mesh_error, read_model, reduce_model
from femend.model.mesh.coarse_beams import coarse_beams
from femend.model.mesh.refined import refined_model, refined_size
from femend.model.mesh.resolution import unresolved
from femend.model.places.places import inner_joints

sys.path.insert(0, str(Path(__file__).parent))
from test_own_mesh import recorded
from test_refined import HEAD, frequencies

SECTION = "PBAR,1,1,9.-4,2.-8,1.6-7,2.-8"
F_MAX = 600.0


def frame(path: Path, n: int, section: str = SECTION, more: tuple[str, ...] = ()) -> Model:
    """Two columns of 0.7 and 0.8 m and a beam of 1 m in the X-Z plane, n bars each, whose ends are nodes 1 to 4; other
    nodes of a member of four have the ids that the like of them has in finer ones."""
    ends = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.7), (1.0, 0.0, 0.8), (1.0, 0.0, 0.0)])
    lines = [*HEAD, section]
    lines += [f"GRID,{k},,{x},{y},{z},,{246 if 1 < k < 4 else ''}" for k, (x, y, z) in enumerate(ends, 1)]
    for m in range(3):
        inner = [1000 * (m + 1) + k * 24 // n for k in range(1, n)]
        for k, node in enumerate(inner, 1):
            x, y, z = ends[m] + (ends[m + 1] - ends[m]) * k / n
            lines.append(f"GRID,{node},,{x},{y},{z},,246")
        nodes = [m + 1, *inner, m + 2]
        for k in range(n):
            lines.append(f"CBAR,{100 * (m + 1) + k},1,{nodes[k]},{nodes[k + 1]},0.,1.,0.")
    path.write_text("\n".join([*lines, *more, "SPC1,1,123456,1,4", "ENDDATA", ""]))
    parameters = Parameter("E", "E", "material", (1,)), Parameter("E_one", "E", "elements", (101,))
    return read_model(path, parameters=parameters)


def test_a_frame_is_cut_where_a_mode_of_the_band_is_off(tmp_path: Path) -> None:
    model = frame(tmp_path / "m.bdf", 3)
    error = mesh_error(model, F_MAX).error
    assert 0.003 < error.max() < 0.02
    low = float(frequencies(model, 1)[0])
    assert coarse_beams(model, 1.1 * low) == coarse_beams(model, 0.5 * low) == frozenset()
    assert affordable_refinement(model, 1.1 * low) is None
    beams = {100 * m + k for m in (1, 2, 3) for k in range(3)}
    # the lowest bar of the shorter column hardly moves
    assert beams - coarse_beams(model, F_MAX) == {100}
    finer = refined_model(model, beams)
    assert len(finer.node_ids) == refined_size(model, beams) == len(model.node_ids) + 9
    np.testing.assert_allclose(frequencies(finer, 9), frequencies(frame(tmp_path / "f.bdf", 6), 9), rtol=1e-8)
    np.testing.assert_array_equal(finer.node_ids[: len(model.node_ids)], model.node_ids)
    assert finer.parameters[1].ids == finer.parts[101]
    # in its plane alone, as all other nodes
    new = set(finer.node_ids[len(model.node_ids) :].tolist())
    free = {c for node, c in zip(finer.fe.dof_nodes, finer.fe.dof_components, strict=True) if node in new}
    assert free == {1, 3, 5}


def test_shapes_come_nearer_to_the_structures(tmp_path: Path) -> None:
    from femend.analysis.model_modes import model_modes

    model = frame(tmp_path / "m.bdf", 3)
    finer, truth = affordable_refinement(model, F_MAX), frame(tmp_path / "f.bdf", 12)
    assert finer is not None
    shapes = []
    for m in (model, finer, truth):
        at = [6 * m.index(n) + c for n in model.node_ids.tolist() for c in (0, 2)]
        phi = np.asarray(model_modes(m, n_modes=5).phi)[at]
        shapes.append(phi * np.sign(phi[np.abs(phi).argmax(axis=0), range(5)]))
    off = [np.abs(phi - shapes[2]).max(axis=0) / np.abs(shapes[2]).max(axis=0) for phi in shapes[:2]]
    assert off[0].max() > 0.01
    assert off[1].max() < off[0].max() / 8


@pytest.mark.parametrize("n", [3, 4])
def test_places_of_a_cut_frame_are_those_of_the_deck(tmp_path: Path, n: int) -> None:
    model = frame(tmp_path / "m.bdf", n)
    finer = refined_model(model, {eid for eid, _, _ in model.fe.elements()})
    found, cut = find_places(model), find_places(finer)
    assert [(p.kind, p.nodes, p.direction, p.label) for p in cut] == [
        (p.kind, p.nodes, p.direction, p.label) for p in found
    ]
    for one, other in zip(found, cut, strict=True):
        assert one.kind != "member" or finer.drawn_elements(other.elements) == one.elements
    member = next(i for i, p in enumerate(found) if p.kind == "member")
    joints = [[(p.nodes, p.direction) for p in inner_joints(m, p[member])] for m, p in ((model, found), (finer, cut))]
    assert joints[0] == joints[1]
    assert len(joints[0]) == n - 1


PINNED = "CBAR,900,1,2,4,0.,1.,0.\n,5,5"


@pytest.mark.parametrize("more", [PINNED, "PROD,9,1,4.-4\nCROD,900,9,2,4"])
def test_what_would_be_loose_in_its_middle_stays_whole(tmp_path: Path, more: str) -> None:
    model = frame(tmp_path / "m.bdf", 3, more=(more,))
    beams = coarse_beams(model, F_MAX)
    assert beams
    assert 900 not in beams


def test_a_span_between_two_supports_is_let_go(tmp_path: Path) -> None:
    ends = ("GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "SPC1,1,1234,1", "SPC1,1,234,2")
    section = (*HEAD, SECTION)
    paths = tmp_path / "m.bdf", tmp_path / "f.bdf"
    paths[0].write_text("\n".join([*section, *ends, "CBAR,1,1,1,2,0.,0.,1.", "ENDDATA", ""]))
    halves = ("GRID,3,,0.5,0.,0.", "SPC1,1,4,3", "CBAR,1,1,1,3,0.,0.,1.", "CBAR,2,1,3,2,0.,0.,1.")
    paths[1].write_text("\n".join([*section, *ends, *halves, "ENDDATA", ""]))
    model = read_model(paths[0])
    beams = coarse_beams(model, 100.0)
    np.testing.assert_allclose(frequencies(refined_model(model, beams), 4), frequencies(read_model(paths[1]), 4))


def test_a_cut_frame_carries_more_of_the_band(tmp_path: Path) -> None:
    """And where it does not carry all of it, elements a wavelength are told as the deck has them."""
    model = frame(tmp_path / "m.bdf", 2)
    row = 6 * model.index(2)
    finer = affordable_refinement(model, 3 * F_MAX)
    assert finer is not None
    drawn, cut = (unresolved(reduce_model(m, 3 * F_MAX, [row]), (20.0, 3 * F_MAX)) for m in (model, finer))
    assert drawn is not None
    assert cut is not None
    assert cut.limit > 2 * drawn.limit
    assert cut.points == pytest.approx(drawn.points * np.sqrt(drawn.freq / cut.freq), rel=0.05)
    assert "% off even refined; up to" in cut.text
    assert "even" not in drawn.text


def test_large_frames_stay_as_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = frame(tmp_path / "m.bdf", 3)
    monkeypatch.setattr(sys.modules["femend.model.mesh.mesh_error"], "MOST_NODES", len(model.node_ids) + 7)
    assert affordable_refinement(model, F_MAX) is None


@pytest.mark.parametrize("own", [True, False])
def test_a_frame_is_met_with_the_mesh_that_its_recordings_follow(tmp_path: Path, own: bool) -> None:
    """With nothing missing a structure left twice the noise, and priors were strained, by shapes of the deck's mesh."""
    deck = frame(tmp_path / "m.bdf", 3)
    truth = deck if own else frame(tmp_path / "f.bdf", 12)
    nodes = (2, 2008, 3, 2016)
    start = update_model(deck, [recorded(truth, deck, nodes)], 0.01)
    model = start.reduced.model
    assert model.simulated == own
    assert (model.refines is None) == own
    assert start.null.score < 1.2
    assert start.null.prior < 20


def test_joints_inside_a_cut_member_are_at_the_decks_nodes(tmp_path: Path) -> None:
    deck = frame(tmp_path / "m.bdf", 3)
    start = update_model(deck, [recorded(frame(tmp_path / "f.bdf", 6), deck, (2, 2008, 3, 2016))], 0.01)
    assert start.reduced.model.refines is deck
    member = next(p for p in find_places(start.reduced.model) if p.kind == "member" and p.nodes == (2, 3))
    found = locate(start.problem, start.reduced, [member], start.null)
    given = SimpleNamespace(reduced=start.reduced, split=SimpleNamespace(whole=start.problem))
    weak = SimpleNamespace(found=found[0], candidate=SimpleNamespace(values={"factor": 0.1}))
    joints = inside(cast("Any", given), [cast("Any", weak)], set())
    assert {joint.place.nodes for joint in joints} == {(2008,), (2016,)}
