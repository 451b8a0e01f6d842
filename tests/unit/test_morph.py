"""Nodes that move along fields: matrices as of a deck with these nodes, derivatives, and what is refused."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend.dof import Dof
from femend.errors import DeckError, GeometryError, ModelError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    MorphedMatrices,
    Problem,
    deck_system,
    unknowns_of,
    updated_deck,
)
from femend.model import (
    Model,
    Morph,
    Parameter,
    amplitude_limits,
    grown,
    joint_moved,
    nodes_moved,
    offset_along_normal,
    read_model,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from morph_models import frame_deck, mixed_deck, rib_deck

Array = NDArray[np.float64]


def mixed(folder: Path, parameters: tuple[Parameter, ...] = ()) -> Model:
    """The deck of all kinds with three morphs that reach every element."""
    rng = np.random.default_rng(5)
    model = read_model(mixed_deck(folder), parameters=parameters)
    shear = Morph("shear", [1, 2, 3, 4, 5, 6], rng.standard_normal((6, 3)), 0.01)
    arm = Morph.of("arm", {7: (0.0, 1.0, 0.5), 8: (1.0, 0.0, 0.0), 9: (0.0, 0.0, 1.0)}, 0.01)
    away = Morph.of("away", {20: (1.0, 0.5, 0.0), 5: (0.0, 0.0, 1.0)}, 0.01)
    return model.with_morphs([shear, arm, away])


def whole(model: Model, K: Array) -> Array:
    indptr, indices = model.fe.assemble()[:2]
    return csc_array((K, indices, indptr), shape=(model.fe.n_a, model.fe.n_a)).toarray()


def test_moved_matrices_are_those_of_the_written_deck(tmp_path: Path) -> None:
    thickness = (Parameter("t", "t", "property_id", (2,)), Parameter("rho", "rho", "material", (1,)))
    model = mixed(tmp_path, thickness)
    amplitudes = {"shear": 0.04, "arm": -0.07, "away": 0.1}
    factors = {"t": 1.2, "rho": 0.9}
    matrices = MorphedMatrices(model)
    K, M = matrices.at(np.array([*factors.values(), *amplitudes.values()]))
    changed = updated_deck(model, {**amplitudes, **factors})
    changed.write(tmp_path / "new")
    again = read_model(tmp_path / "new" / "mixed.bdf")
    assert np.abs(again.xyz - model.moved(amplitudes)).max() < 1e-13
    K2, M2 = (A.toarray() for A in again.matrices())
    C, H = matrices.damping(np.array([*factors.values(), *amplitudes.values()]))
    H2 = whole(again, again.fe.assemble()[5])
    for new, old in ((whole(model, K), K2), (whole(model, M), M2), (whole(model, H), H2)):
        assert np.abs(new - old).max() <= 1e-12 * np.abs(old).max()
    assert not C.any()
    K0, M0 = (A.toarray() for A in model.matrices(factors))
    assert np.abs(K2 - K0).max() > 1e-2 * np.abs(K0).max()
    assert np.abs(M2 - M0).max() > 1e-3 * np.abs(M0).max()


def test_only_elements_at_moved_nodes_are_evaluated_again(tmp_path: Path) -> None:
    model = read_model(frame_deck(tmp_path)).with_morphs([Morph.of("knee", {4: (1.0, 0.0, 0.0)}, 0.01)])
    names = [model.fe.elements()[i][0] for i in model.fe.reached]
    assert names == [3, 4]


def test_derivatives_are_exact_to_a_billionth(tmp_path: Path) -> None:
    parameters = (Parameter("t", "t", "property_id", (2,)), Parameter("E", "E", "material", (1,)))
    model = mixed(tmp_path, parameters)
    matrices = MorphedMatrices(model)
    at = np.array([1.1, 0.95, 0.02, 0.03, -0.05])
    slopes = [*matrices.slopes(at), *matrices.damping_slopes(at)]
    for i in range(at.size):

        def values(x: float, i: int = i) -> list[Array]:
            there = at.copy()
            there[i] += x
            return [*matrices.at(there), *matrices.damping(there)]

        # sixth order (Fornberg 1988, table 1): its own error is below 1e-10 here
        h = 2e-3
        ends = {k: values(k * h) for k in (-3, -2, -1, 1, 2, 3)}
        for which, slope in enumerate(slopes):
            d = {k: v[which] for k, v in ends.items()}
            exact = (45 * (d[1] - d[-1]) - 9 * (d[2] - d[-2]) + (d[3] - d[-3])) / (60 * h)
            size = np.abs(exact).max()
            assert np.abs(slope[i] - exact).max() <= 3e-9 * size, (matrices.names[i], which)


def test_a_plate_is_off_along_its_normal(tmp_path: Path) -> None:
    model = read_model(rib_deck(tmp_path, wide=True))
    lid = offset_along_normal(model, "lid", 1e-3, properties=(4,))
    assert lid.nodes.size == 27
    assert np.allclose(np.abs(lid.field[:, 2]), 1.0)
    assert np.allclose(lid.field[:, :2], 0.0)


def test_shapes_of_morphs(tmp_path: Path) -> None:
    frame = read_model(frame_deck(tmp_path))
    joint = joint_moved(frame, "apex", 0.01, [21], (0, 0, 2.0), held=[4, 41])
    lift = dict(zip(joint.nodes.tolist(), joint.field[:, 2].tolist(), strict=True))
    assert lift == pytest.approx({11: 0.25, 12: 0.5, 13: 0.75, 21: 1.0, 31: 0.75, 32: 0.5, 33: 0.25})
    assert joint.unit == "m"
    near = nodes_moved(frame, "knee", 0.01, [4], (1, 0, 0), 0.8, held=[1])
    follow = dict(zip(near.nodes.tolist(), near.field[:, 0].tolist(), strict=True))
    assert follow[4] == 1.0
    assert 0 < follow[3] < (1 - 0.625) ** 4 * (4 * 0.625 + 1)
    assert set(follow) == {3, 4, 11}
    wide = grown(frame, "wide", 0.01, [1, 4, 21], (1.5, 0, 0), axis=(1, 0, 0), along=True)
    assert wide.field.tolist() == [[-1.5, 0, 0], [-1.5, 0, 0]]
    tall = grown(frame, "tall", 0.01, [4, 21], (0, 0, 0), axis=(1, 0, 0))
    assert tall.field == pytest.approx(np.array([[0, 0, 1.5], [0, 0, 2.1]]))
    assert grown(frame, "all", 0.01, [4], (0, 0, 0.5)).field.tolist() == [[0, 0, 1.0]]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Morph("a", [1, 2], np.zeros((3, 3)), 0.1), r"shape \(3, 3\) for 2 nodes; give \(2, 3\)"),
        (lambda: Morph("a", [1, 2], np.ones(3), 0.1), r"shape \(3,\) for 2 nodes"),
        (lambda: Morph("a", [1, 1], np.ones((2, 3)), 0.1), "node 1 stands 2 times"),
        (lambda: Morph("a", [1], [[0, np.nan, 0]], 0.1), "vector of node 1 is .*nan"),
        (lambda: Morph("a", [1], [[0, 0, 0]], 0.1), "moves none of its 1 nodes"),
        (lambda: Morph("a", [1.5], [[0, 0, 1]], 0.1), "give node ids"),
        (lambda: Morph("a", [1], [["x", 0, 1]], 0.1), "no array of numbers"),
        (lambda: Morph("a", [1], [[0, 0, 1]], 0.0), "standard deviation of 0"),
        (lambda: Morph("a", [1], [[0, 0, 1]], 0.1, (0.1, 0.2)), "bounds are 0.1 to 0.2"),
        (lambda: Morph.of("a", {1: (0, 1)}, 0.1), r"vector of node 1 has shape \(2,\); give \(3,\)"),
        (lambda: Morph.of("a", {}, 0.1), "has no node"),
    ],
)
def test_fields_that_are_none(make: object, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        make()  # type: ignore[operator]


def test_morphs_that_do_not_fit_the_deck(tmp_path: Path) -> None:
    model = read_model(frame_deck(tmp_path), parameters=[Parameter("E", "E", "material", (1,))])
    up = {21: (0.0, 0.0, 1.0)}
    for morphs, words in (
        ([Morph.of("a", {999: (0, 0, 1)}, 0.1)], "morph 'a': node 999 is not in the deck; give GRIDs"),
        ([Morph.of("a", up, 0.1), Morph.of("a", up, 0.1)], "two morphs are called 'a'"),
        ([Morph.of("a", {50: (0, 0, 1)}, 0.1)], "morph 'a': moving its 1 nodes changes nothing"),
        ([Morph.of("E", up, 0.1)], "a parameter and a morph are called 'E'"),
    ):
        with pytest.raises(ModelError, match=words):
            model.with_morphs(morphs)
    for make, words in (
        (lambda: joint_moved(model, "j", 0.1, [21], (0, 0, 1), held=[]), "nothing holds the part of node 21"),
        (lambda: joint_moved(model, "j", 0.1, [21], (0, 0, 1), held=[21]), "node 21 is to move and is held"),
        (lambda: joint_moved(model, "j", 0.1, [], (0, 0, 1), held=[1]), "no node is to move"),
        (lambda: nodes_moved(model, "j", 0.1, [77], (0, 0, 1), 1.0), "node 77 is no GRID"),
        (lambda: nodes_moved(model, "j", 0.1, [21], (0, 0, 0), 1.0), r"direction is \[0.0, 0.0, 0.0\]"),
        (lambda: nodes_moved(model, "j", 0.1, [21], (0, 0, 1), 0.0), "radius is 0"),
        (lambda: offset_along_normal(model, "o", 0.1, properties=(1,)), "no shell .* has the property 1"),
        (lambda: grown(model, "g", 0.1, [4], (0, 0, 0), along=True), "along an axis, and none is given"),
    ):
        with pytest.raises(ModelError, match=words):
            make()
    with pytest.raises(ModelError, match="no morph is called 'b'"):
        model.with_morphs([Morph.of("a", up, 0.1)]).moved({"b": 1.0})


def test_an_element_that_turns_inside_out_is_named_with_the_limit(tmp_path: Path) -> None:
    model = read_model(rib_deck(tmp_path))
    free = offset_along_normal(model, "lid", 5e-3, properties=(4,))
    morphed = model.with_morphs([free])
    way = float(np.sign(free.field[0, 2]))
    with pytest.raises(GeometryError, match=r"CQUAD4 \d+ turns inside out: .*'lid' = .*up to 'lid' =") as caught:
        MorphedMatrices(morphed).at(np.array([-0.15 * way]))
    assert re.fullmatch(r"CQUAD4 \d+", caught.value.element or "")
    # the upper row of flange elements is half the height of 0.1
    assert abs(caught.value.limits["lid"]) == pytest.approx(0.05, rel=3e-3)
    low, high = amplitude_limits(morphed, "lid", 0.2)
    assert (low if way > 0 else high) == pytest.approx(-0.05 * way, rel=5e-3)
    assert (high if way > 0 else low) == 0.2 * way
    with pytest.raises(GeometryError, match=r"morph 'lid': at its bound .* CQUAD4"):
        model.with_morphs([offset_along_normal(model, "lid", 5e-3, properties=(4,), bounds=(-0.08, 0.08))])
    frame = read_model(frame_deck(tmp_path)).with_morphs([Morph.of("knee", {3: (0.0, 0.0, 1.0)}, 0.1)])
    with pytest.raises(GeometryError, match=r"CBAR 3 turns inside out: its axis has turned by 180 degrees"):
        MorphedMatrices(frame).at(np.array([0.7]))
    with pytest.raises(GeometryError, match=r"CBAR 3 has zero length"):
        MorphedMatrices(frame).at(np.array([0.5]))


def test_what_cannot_follow_is_refused(tmp_path: Path) -> None:
    text = mixed_deck(tmp_path).read_text()
    path = tmp_path / "axes.bdf"
    path.write_text(text.replace("GRID,20,", "CORD1R,9,20,1,2\nGRID,21,9,0.,0.,.1\nGRID,20,"))
    with pytest.raises(DeckError, match="axes stand on node 20, which is moved"):
        read_model(path).with_morphs([Morph.of("a", {20: (1, 0, 0)}, 0.1)])
    model = mixed(tmp_path)
    with pytest.raises(UpdatingError, match=r"sensor 8:\+Z hangs on a rigid element"):
        deck_system(model, [Dof.parse("8:+Z")], 2)
    with pytest.raises(UpdatingError, match="gravity: node 5 has displacement axes of its own"):
        deck_system(model, [Dof.parse("3:+Z")], 2, inertia=True)
    with pytest.raises(UpdatingError, match="no parameter 'nowhere'"):
        updated_deck(model, {"nowhere": 1.0})
    with pytest.raises(UpdatingError, match="the amplitude of the morph 'arm' is nan"):
        updated_deck(model, {"arm": float("nan")})
    truss = tmp_path / "truss.bdf"
    truss.write_text(
        "BEGIN BULK\nMAT1,1,2.1E11,,.3\nPROD,1,1,1.E-4\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,2.,0.,0.\n"
        "CROD,1,1,1,2\nCROD,2,1,2,3\nSPC1,1,123,1,3\nENDDATA\n"
    )
    with pytest.raises(ModelError, match=r"DOF 2:[23] is resisted or loaded once the nodes move"):
        read_model(truss).with_morphs([Morph.of("up", {2: (0, 0, 1)}, 0.1)])


def test_unknowns_of_a_model(tmp_path: Path) -> None:
    model = read_model(frame_deck(tmp_path), parameters=[Parameter("E", "E", "material", (1,), 0.05)])
    unknowns = unknowns_of(model.with_morphs([Morph.of("rise", {21: (0, 0, 1)}, 0.01, (-0.1, 0.1), "m")]))
    assert unknowns.names == ("E", "rise")
    assert unknowns.items[1].unit == "m"
    assert unknowns.values(unknowns.mean).tolist() == [1.0, 0.0]
    assert np.array_equal(model.moved({}), model.xyz)


def test_a_morph_that_no_unknown_moves_stays_where_it_is(tmp_path: Path) -> None:
    plain = read_model(frame_deck(tmp_path), parameters=[Parameter("E", "E", "material", (1,), 0.05)])
    model = plain.with_morphs([Morph.of("rise", {21: (0, 0, 1)}, 0.01)])
    system, before = (deck_system(m, [Dof.parse("21:+Z")], 3) for m in (model, plain))
    freq = np.ones(3)
    E = unknowns_of(plain)
    problem = Problem(E, (Configuration("a", system, (Frequencies(freq, 0.01),), ModeTest(freq)),))
    assert problem.factors(E.mean, 0).tolist() == [1.0, 0.0]
    at_rest = problem.states(E.mean)[0].value("freq")
    assert at_rest == pytest.approx(before.solve(np.ones(1)).value("freq"), rel=1e-9)


def test_mass_and_centre_follow_the_nodes(tmp_path: Path) -> None:
    model = read_model(frame_deck(tmp_path), parameters=[Parameter("rho", "rho", "material", (1,))], spc=0)
    apex = joint_moved(model, "apex", 0.05, [21], (0, 0, 1), held=[4, 41])
    model = model.with_morphs(
        [apex, grown(model, "wide", 0.05, [41, 42, 43, 44], (0, 0, 0), axis=(1, 0, 0), along=True)]
    )
    system = deck_system(model, [Dof.parse("21:+Z")], 0, inertia=True)
    at = np.array([1.1, 0.1, -0.05])
    state = system.solve(at)
    updated_deck(model, {"rho": 1.1, "apex": 0.1, "wide": -0.05}).write(tmp_path / "new")
    again = deck_system(read_model(tmp_path / "new" / "frame.bdf", spc=0), [Dof.parse("21:+Z")], 0, inertia=True)
    there = again.solve(np.ones(0))
    h = 1e-4
    for name in ("mass", "centre"):
        # eight columns hold the coordinates of the right column to 5e-7
        assert state.value(name) == pytest.approx(there.value(name), rel=1e-6, abs=1e-9)
        for i in range(3):
            up, down = (system.solve(at + s * h * np.eye(3)[i]).value(name) for s in (1, -1))
            # second order of the step of 1e-4
            assert state.slope(name)[i] == pytest.approx((up - down) / (2 * h), rel=1e-6, abs=1e-6)
