"""Elastic beddings: which lines and areas are places, what one adds to a model, and that it is told and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from tests.small_study import Truth, deck, dense_modes, diagnosed, updated

from femend.diagnose.locating.beddings import likely_beddings
from femend.diagnose.locating.dressed import with_own
from femend.model import Model, Place, ReducedModel, read_model, reduce_model
from femend.model.beddings.bed_extents import BedExtents
from femend.model.beddings.bed_places import Beds, bed_places
from femend.model.mesh.refined import refined_model
from femend.report.words import how_much, place_text
from femend.study.result.patch import deck_cards

NX, NY, SIDE = 8, 6, 0.05


def plate(folder: Path, more: tuple[str, ...] = (), frame: str = "") -> Model:
    """A plate held at its left edge, its displacements told in `frame`."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    lines += ["PSHELL,1,1,0.003,1,,1", "CORD2R,5,,0.,0.,0.,1.,0.,0.,", "+,0.,1.,0."]
    for j in range(NY + 1):
        lines += [f"GRID,{1 + i + (NX + 1) * j},,{i * SIDE},{j * SIDE},0.,{frame}" for i in range(NX + 1)]
    for j in range(NY):
        n = [1 + i + (NX + 1) * j for i in range(NX)]
        lines += [f"CQUAD4,{100 * j + a},1,{a},{a + 1},{a + NX + 2},{a + NX + 1}" for a in n]
    lines += [f"SPC1,1,123456,{1 + (NX + 1) * j}" for j in range(NY + 1)]
    path = folder / "plate.bdf"
    path.write_text("\n".join([*lines, *more, "ENDDATA", ""]))
    return read_model(path)


def along(places: list[Place], *nodes: int) -> Place:
    return next(p for p in places if set(p.nodes) == set(nodes))


def shares(place: Place) -> dict[int, float]:
    return {n: float(x @ x) / place.bed_stiffness for n, _, x in place.bed}


def matrices(reduced: ReducedModel, x: float) -> tuple[np.ndarray, np.ndarray]:
    """K and M at the deck's values and ln factor `x` of the part added last."""
    K, M = reduced.K_fixed.copy(), reduced.M_fixed.copy()
    p = np.array([0.0] * (len(reduced.names) - 1) + [x])
    for term in reduced.terms:
        scale = np.exp(sum(power * p[i] for i, power in term.exponents))
        K += 0.0 if term.K is None else scale * term.K
        M += 0.0 if term.M is None else scale * term.M
    return K, M


def test_edges_and_areas_of_a_plate_stand_for_their_length_and_area(tmp_path: Path) -> None:
    found = bed_places(reduce_model(plate(tmp_path), 300.0, [6 * 60 + 2]), 300.0)
    assert {p.direction for p in found} == {"Z"}
    edge = shares(along(found, 55, 63))
    # the first node is held, and stands for nothing that moves
    assert sorted(edge) == list(range(56, 64))
    assert edge[60] == pytest.approx(2 * edge[63])
    whole = shares(along(found, 1, 9, 55, 63))
    assert len(whole) == NX * (NY + 1)
    assert whole[13] == pytest.approx(2 * whole[4]) == pytest.approx(4 * whole[9])
    for place in found:
        assert sum(shares(place).values()) == pytest.approx(1.0)
        assert len(place.bed) >= 3
    halves = [p for p in found if set(p.nodes) == {5, 9, 59, 63}]
    assert len(halves) == 1  # each is there once


def test_lines_of_beams_are_whole_members_and_parts_across(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(deck())
    found = bed_places(reduce_model(read_model(path), 200.0, [6 * 12 + 2]), 200.0)
    assert {p.direction for p in found} == {"Z"}  # X is along, nothing moves in Y
    assert found[0].nodes == (1, 13)
    assert (9, 13) in [p.nodes for p in found]  # from a lump to the end


def test_a_finer_mesh_has_the_beddings_of_the_deck(tmp_path: Path) -> None:
    model = plate(tmp_path)
    coarse, fine = (bed_places(reduce_model(m, 300.0, [6 * 60 + 2]), 300.0) for m in (model, refined_model(model)))
    assert [(p.nodes, [n for n, _, _ in p.bed]) for p in coarse] == [(p.nodes, [n for n, _, _ in p.bed]) for p in fine]


@pytest.mark.parametrize("frame", ["", "5"], ids=["basic", "turned"])
def test_a_bedding_is_the_deck_with_its_springs(tmp_path: Path, frame: str) -> None:
    reduced = reduce_model(plate(tmp_path, frame=frame), 2000.0, [6 * 60 + 2])
    place = along(bed_places(reduced, 300.0), 55, 63)
    k, own = 4000.0, with_own(place, reduced)
    x = place.logarithms({"k": k})
    assert place.values(x) == {"k": pytest.approx(k)}
    component = 2 if frame else 3  # the frame's second axis is the basic Z
    cards = tuple(f"CELAS2,{900 + n},{k * s:.6f},{n},{component}" for n, s in shares(place).items())
    found = np.sqrt(eigh(*matrices(own, float(x[0])), eigvals_only=True)[:4])
    true = dense_modes(plate(tmp_path, cards, frame))[0][:4]
    np.testing.assert_allclose(found, true, rtol=2e-3)
    plain = np.sqrt(eigh(*matrices(own, 0.0), eigvals_only=True)[:4])
    np.testing.assert_allclose(plain, np.sqrt(eigh(*reduced.as_drawn(), eigvals_only=True)[:4]), rtol=1e-9)
    assert np.abs(plain / true - 1).max() > 0.02
    # what an unknown's deviation is for the stiffness
    step = 1e-5
    slope = np.log(place.values(x + step)["k"] / place.values(x - step)["k"]) / (2 * step)
    assert place.slopes(x)[0] == pytest.approx(slope, rel=1e-6)


BEDDED = Truth(E=(7.3e10, 6.8e10), more=tuple(f"CELAS2,{900 + n},{k},{n},3" for n, k in
               ((9, 2500.0), (10, 5000.0), (11, 5000.0), (12, 5000.0), (13, 2500.0))))  # fmt: skip


def test_the_right_bedding_is_among_the_likely_ones(tmp_path: Path) -> None:
    start = updated(tmp_path, BEDDED)
    beds = bed_places(start.reduced, start.problem.band[1])
    plain = start.problem.sparing(120).untuned().pressed()
    likely = likely_beddings(plain, start.problem.sparing(250), start.reduced, beds)
    assert (9, 13) in [place.nodes for place, _ in likely]


def test_a_bedding_is_told_with_its_stiffness_and_written_as_springs(tmp_path: Path) -> None:
    run = diagnosed(tmp_path, BEDDED)
    (finding,) = run.result["findings"]
    where, k = finding["location"], finding["parameters"]["k"]
    assert (finding["physics"], where["nodes"], where["direction"]) == ("support_stiffness", [9, 13], "Z")
    assert where["region"] == [9, 10, 11, 12, 13]
    assert abs(k["value"] - 20000.0) < 1.645 * k["sd"] < 10000.0
    assert k["unit"] == "N/m"
    assert place_text(where) == "under 5 nodes between nodes 9–13 in Z, to ground"
    assert how_much(finding)[0][0] == "stiffness in all"
    cards = [line.split(",") for line in deck_cards(run.model, run.result) if line.startswith("CELAS2")]
    assert [(int(c[3]), int(c[4])) for c in cards] == [(n, 3) for n in where["region"]]
    assert sum(float(c[2]) for c in cards) == pytest.approx(k["value"], rel=1e-3)
    assert float(cards[1][2]) == pytest.approx(2 * float(cards[0][2]), rel=1e-3)


def test_ends_of_a_line_move_by_a_node(tmp_path: Path) -> None:
    reduced = reduce_model(plate(tmp_path), 300.0, [6 * 60 + 2])
    beds = Beds(reduced, 300.0)
    extents = BedExtents(beds)
    half = along(bed_places(reduced, 300.0), 59, 63)
    near = {p.nodes for p in extents.next_to(half)}
    assert near - {half.nodes} == {(58, 63), (60, 63), (59, 62), (58, 62), (60, 62)}  # 63 is the last of the edge
    other = next(p for p in extents.next_to(half) if p.nodes == (58, 62))
    assert shares(other)[60] == pytest.approx(2 * shares(other)[62])


def test_sides_of_an_area_move_by_a_row_of_faces(tmp_path: Path) -> None:
    reduced = reduce_model(plate(tmp_path), 300.0, [6 * 60 + 2])
    extents = BedExtents(Beds(reduced, 300.0))
    half = along(bed_places(reduced, 300.0), 5, 9, 59, 63)
    near = {frozenset(p.nodes) for p in extents.next_to(half)}
    assert {frozenset((4, 9, 58, 63)), frozenset((6, 9, 60, 63)), frozenset((4, 8, 58, 62))} <= near
    assert frozenset((14, 18, 59, 63)) in near  # without its lowest row


def test_beddings_about_a_spring_are_small_ones_at_its_node(tmp_path: Path) -> None:
    reduced = reduce_model(plate(tmp_path), 300.0, [6 * 60 + 2])
    extents = BedExtents(Beds(reduced, 300.0))
    inside, edge = (Place("ground", (n,), "Z", "ground") for n in (32, 59))
    assert {n for n, _, _ in extents.about(inside)[0].bed} == {22, 23, 24, 31, 32, 33, 40, 41, 42}
    assert {p.nodes for p in extents.about(edge) if len(p.nodes) == 2} == {(58, 60), (57, 61), (55, 63)}
    assert extents.about(Place("ground", (32,), "RX", "ground")) == []


ELSEWHERE = Truth(E=(7.3e10, 6.8e10), more=tuple(f"CELAS2,{900 + n},{k},{n},3" for n, k in
                  ((8, 10000.0), (9, 20000.0), (10, 20000.0), (11, 10000.0))))  # fmt: skip


def test_a_bedding_of_none_of_the_parts_is_found_from_the_nearest_law(tmp_path: Path) -> None:
    run = diagnosed(tmp_path, ELSEWHERE)
    (finding,) = run.result["findings"]
    k = finding["parameters"]["k"]
    assert (finding["physics"], finding["location"]["region"]) == ("support_stiffness", [8, 9, 10, 11])
    assert abs(k["value"] - 60000.0) < 1.645 * k["sd"] < 9000.0
