"""Supports of plates that give way: opened and put on a spring they are the deck without them, on that spring."""

from __future__ import annotations

import gc
import sys
import weakref
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femend.diagnose.locating.dressed import own_values, with_own
from femend.diagnose.locating.joint import open_joint
from femend.model import Model, Parameter, Place, ReducedModel, read_model, reduce_model
from femend.model.places.freed import freed, own_stiffness

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_plate import CORNERS, NX, NY, SIDE, mesh, plate, supports

INSIDE = 18


def frequencies(K: np.ndarray, M: np.ndarray, n: int = 6) -> np.ndarray:
    return np.sqrt(np.abs(eigh(K, M, eigvals_only=True)[:n])) / (2 * np.pi)


def deck(reduced: ReducedModel, name: str) -> np.ndarray:
    """K or M of a reduced model at the deck's values."""
    parts = [getattr(t, name) for t in reduced.terms]
    return np.asarray(getattr(reduced, f"{name}_fixed") + sum(p for p in parts if p is not None))


def test_every_corner_may_give_way_by_itself(tmp_path: Path) -> None:
    places = supports(plate(tmp_path, CORNERS))
    assert [(p.nodes, p.direction, p.to) for p in places] == [((n,), "Z", "ground") for n in CORNERS]
    assert all(p.label == f"support at node {n}, Z" for p, n in zip(places, CORNERS, strict=True))


@pytest.mark.parametrize(("k", "within"), [(1e3, 0.025), (2e4, 0.02), (3e5, 2e-3), (3e6, 2e-4)])
def test_an_opened_support_with_a_spring_is_the_deck_on_that_spring(tmp_path: Path, k: float, within: float) -> None:
    model = plate(tmp_path, CORNERS)
    place = supports(model)[1]
    rows = [6 * INSIDE + 2]
    joint = open_joint(place, reduce_model(model, 600.0, rows), 600.0, rows)
    K, M, w = deck(joint.reduced, "K"), deck(joint.reduced, "M"), joint.w[0]
    K = K - place.support**2 / (k + place.support) * np.outer(w, w)
    freed = plate(tmp_path, (1, 105, 117), f"CELAS2,900,{k},13,3")
    K_true, M_true = (a.toarray() for a in freed.matrices())
    # the inertia of the corner itself is left out
    np.testing.assert_allclose(frequencies(K, M), frequencies(K_true, M_true), rtol=within)


def test_a_clamped_edge_gives_way_as_a_whole(tmp_path: Path) -> None:
    edge = tuple(1 + (NX + 1) * j for j in range(NY + 1))
    model = plate(tmp_path, edge)
    found = {p.direction: p for p in supports(model)}
    # held in Z alone, an edge moves up and down; its tilt is a motion of a region held in all directions
    assert set(found) == {"Z", "RX"}
    assert found["Z"].nodes == edge
    assert "support at nodes 1, 14, 27, 40 and 5 more" in found["Z"].label


@pytest.mark.parametrize("among", [False, True])
@pytest.mark.parametrize("k", [{2: 3e3}, {2: 4e4, 3: 150.0}])
def test_an_edge_on_springs_is_the_deck_without_it_tied_to_a_rigid_bar_on_them(
    tmp_path: Path, k: dict[int, float], among: bool
) -> None:
    edge = tuple(1 + (NX + 1) * j for j in range(NY + 1))
    model = plate(tmp_path, edge)
    found = supports(model)[0]
    # in the plane and about Z it is held, too, where bending takes nothing of it
    assert [motion.component for motion in found.motions] == [0, 1, 2, 3, 5]
    assert (own_stiffness(model, found.motions) > 0).all()
    # sought around another stiffness, so that the unknowns stand elsewhere than at nothing
    springs = tuple((motion, 5 * k[motion.component]) for motion in found.motions if motion.component in k)
    place = Place("support", edge, "", "ground", springs=springs, motions=found.motions if among else ())
    reduced = with_own(place, reduce_model(model, 600.0, [6 * INSIDE + 2]))
    p = np.full(len(k), np.log(1 / 5))
    assert own_values(reduced, p) == pytest.approx({f"k{c + 1}": value for c, value in k.items()})
    factors = [np.exp(sum(exponent * p[i] for i, exponent in term.exponents)) for term in reduced.terms]
    K = reduced.K_fixed + sum(f * t.K for f, t in zip(factors, reduced.terms, strict=True) if t.K is not None)

    loose = plate(tmp_path, ())
    rows = {int(row): i for i, row in enumerate(loose.g_rows())}
    at = [rows[6 * loose.index(n) + 2] for n in edge]
    y = np.array([loose.xyz[loose.index(n)][1] for n in edge])
    T = np.delete(np.eye(len(rows)), at, axis=1)
    for component, t in ((2, np.ones(len(edge))), (3, y - y.mean())):
        if component in k:
            T = np.hstack([T, np.zeros((len(rows), 1))])
            T[at, -1] = t
    K_true, M_true = (T.T @ a.toarray() @ T for a in loose.matrices())
    K_true[range(-len(k), 0), range(-len(k), 0)] += list(k.values())
    # the plate turns about its edge as it likes
    np.testing.assert_allclose(frequencies(K, deck(reduced, "M"))[1:], frequencies(K_true, M_true)[1:], rtol=1e-5)


def skew(folder: Path, turn: float) -> Model:
    """A plate in mm and t, clamped along an edge that is turned by `turn` against the axes."""
    lines = [
        "SOL 103",
        "CEND",
        "SPC = 1",
        "BEGIN BULK",
        "PARAM,COUPMASS,1",
        "MAT1,1,7.+4,,0.33,2.7-9",
        "PSHELL,1,1,3.,1,,1",
    ]
    lines += mesh(1000 * SIDE, turn)
    lines += [f"SPC1,1,126,1,THRU,{(NX + 1) * (NY + 1)}", *(f"SPC1,1,345,{1 + (NX + 1) * j}" for j in range(NY + 1))]
    path = folder / "skew.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    return read_model(path)


@pytest.mark.parametrize("among", [False, True])
def test_a_support_that_is_skew_to_the_axes_turns_on_its_springs_as_one_that_is_not(
    tmp_path: Path, among: bool
) -> None:
    found = []
    for turn in (0.0, 0.7):
        model = skew(tmp_path, turn)
        (whole,) = (p for p in supports(model) if p.direction == "RX")
        springs = tuple((motion, 5e4) for motion in whole.motions if motion.component in (3, 4))
        place = Place("support", whole.nodes, "", "ground", springs=springs, motions=whole.motions if among else ())
        reduced = with_own(place, reduce_model(model, 600.0, [6 * INSIDE + 2]))
        found.append(frequencies(*reduced.as_drawn()))
    clamped = reduce_model(skew(tmp_path, 0.0), 600.0, [6 * INSIDE + 2]).freq
    np.testing.assert_allclose(found[1], found[0], rtol=2e-3)
    assert (found[0][:3] < 0.98 * clamped[:3]).all()


def test_what_is_kept_of_a_support_set_free_goes_with_its_model(tmp_path: Path) -> None:
    model = plate(tmp_path, CORNERS)
    (corner,) = supports(model)[0].motions[2:3]
    reduced = reduce_model(model, 600.0, [6 * INSIDE + 2])
    first = freed(reduced, [corner], [corner])
    assert freed(reduced, [corner], [corner]).V is first.V
    gone = weakref.ref(model)
    del model, reduced, first
    gc.collect()
    assert gone() is None


def test_a_support_that_no_single_parameter_scales_is_left_out(tmp_path: Path) -> None:
    thickness = Parameter("t", "t", "property_id", (1,))
    assert supports(plate(tmp_path, CORNERS, parameters=(thickness,))) == []
    modulus = Parameter("E", "E", "material", (1,))
    assert [p.parameter for p in supports(plate(tmp_path, CORNERS, parameters=(modulus,)))] == [0, 0, 0, 0]
