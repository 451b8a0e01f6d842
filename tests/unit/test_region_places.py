"""Regions of shells and solids as places: which there are, and that a factor on one is the deck with it weaker."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femend.diagnose.locating.dressed import hypothesis_of, with_own
from femend.diagnose.locating.region_stiffness import prepare_regions, region_stiffness
from femend.model import Model, Parameter, Place, find_places, read_model, reduce_model
from femend.model.mesh.refined import refined_model

region_stiffness_module = import_module("femend.diagnose.locating.region_stiffness")  # it has a function of that name

NX, NY, SIDE = 12, 8, 0.025
LEFT = Parameter("E_left", "E", "material", (1,))


def plate(
    folder: Path, parameters: tuple[Parameter, ...] = (), weak: tuple[int, ...] = (), factor: float = 1.0
) -> Model:
    """A plate on its edge, halves of their own properties; the elements `weak` have their modulus times `factor`."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1"]
    for pid in (1, 2, 3, 4):
        E = 7e10 * (factor if pid > 2 else 1.0)
        lines += [f"MAT1,{pid},{E:.6e},,0.33,2700.", f"PSHELL,{pid},{pid},0.003,{pid},,{pid}"]
    for j in range(NY + 1):
        lines += [f"GRID,{1 + i + (NX + 1) * j},,{i * SIDE:.3f},{j * SIDE:.3f},0." for i in range(NX + 1)]
    for j in range(NY):
        for i in range(NX):
            n, eid = 1 + i + (NX + 1) * j, 1 + i + NX * j
            pid = (1 if i < NX // 2 else 2) + (2 if eid in weak else 0)
            lines.append(f"CQUAD4,{eid},{pid},{n},{n + 1},{n + NX + 2},{n + NX + 1}")
    lines += [f"SPC1,1,126,1,THRU,{(NX + 1) * (NY + 1)}"]
    lines += [f"SPC1,1,345,{1 + (NX + 1) * j}" for j in range(NY + 1)]
    path = folder / "plate.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    return read_model(path, parameters=parameters)


def regions(model: Model) -> list[Place]:
    return [p for p in find_places(model) if p.kind == "region"]


def half(first: int) -> set[int]:
    return {1 + i + NX * j for j in range(NY) for i in range(first, first + NX // 2)}


def test_properties_come_first_and_patches_are_unlikely(tmp_path: Path) -> None:
    found = regions(plate(tmp_path))
    assert [set(p.elements) for p in found[:2]] == [half(0), half(6)]
    assert [p.unlikely for p in found[:3]] == [False, False, True]
    assert all(p.unlikely for p in found[2:])
    # nodes at the corners of the box around the region
    assert found[0].nodes == (1, 105, 7, 111)
    assert found[0].label == "region of 48 elements of property 1 between nodes 1, 105, 7, 111"


def test_what_a_parameter_covers_is_no_place_but_its_patches_are(tmp_path: Path) -> None:
    found = regions(plate(tmp_path, (LEFT,)))
    assert [set(p.elements) for p in found if not p.unlikely] == [half(6)]
    assert any(p.unlikely and set(p.elements) < half(0) for p in found)
    # a thickness covers its elements though it does not scale their stiffness
    by_t = regions(plate(tmp_path, (Parameter("t", "t", "property_id", (2,)),)))
    assert [set(p.elements) for p in by_t if not p.unlikely] == [half(0)]
    some = (1, 2, 13, 14)
    of_elements = regions(plate(tmp_path, (Parameter("E_some", "E", "elements", some),)))
    assert len([p for p in of_elements if not p.unlikely]) == 2


def test_patches_are_connected_lie_in_one_property_and_differ(tmp_path: Path) -> None:
    found = [p for p in regions(plate(tmp_path)) if p.unlikely]
    assert len({frozenset(p.elements) for p in found}) == len(found) > 20
    for p in found:
        own = set(p.elements)
        assert own < half(0) or own < half(6)
        reached, todo = set(), [p.elements[0]]
        while todo:
            e = todo.pop()
            reached.add(e)
            todo += [n for n in (e - NX, e - 1, e + 1, e + NX) if n in own - reached]
        assert reached == own
        # a rectangle of cells
        columns, rows = {(e - 1) % NX for e in own}, {(e - 1) // NX for e in own}
        assert len(own) == len(columns) * len(rows)


def test_pieces_of_one_property_are_places_by_themselves(tmp_path: Path) -> None:
    lines = ["BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PSHELL,1,1,0.003,1,,1"]
    for first, z in ((1, 0.0), (11, 0.5)):
        lines += [f"GRID,{first + i},,{0.1 * (i // 2):.1f},{0.1 * (i % 2):.1f},{z}" for i in range(6)]
        lines += [f"CQUAD4,{first + i},1,{first + i},{first + i + 2},{first + i + 3},{first + i + 1}" for i in (0, 2)]
    path = tmp_path / "pieces.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    assert [p.elements for p in regions(read_model(path))] == [(1, 3, 11, 13), (1, 3), (11, 13)]


@pytest.mark.parametrize("parameters", [(), (LEFT,)], ids=["fixed", "scaled"])
def test_a_factor_on_a_region_is_the_deck_with_it_weaker(tmp_path: Path, parameters: tuple[Parameter, ...]) -> None:
    model = plate(tmp_path, parameters)
    place = next(p for p in regions(model) if p.unlikely and set(p.elements) < half(0))
    assert place.parameter == (0 if parameters else None)
    reduced = reduce_model(model, 2000.0, [6 * 110 + 2])
    own = with_own(place, reduced)
    assert own.names[-1] == "member"
    x = np.zeros(len(own.names))
    x[-1] = np.log(0.5)
    K, M = own.K_fixed.copy(), own.M_fixed.copy()
    for term in own.terms:
        scale = np.exp(sum(power * x[i] for i, power in term.exponents))
        K += 0.0 if term.K is None else scale * term.K
        M += 0.0 if term.M is None else scale * term.M
    weak = plate(tmp_path, weak=place.elements, factor=0.5)
    K_true, M_true = (a.toarray() for a in weak.matrices())
    found, true = (np.sqrt(eigh(*pair, eigvals_only=True)[:6]) for pair in ((K, M), (K_true, M_true)))
    # the basis is that of the deck, so that frequencies are a little high
    np.testing.assert_allclose(found, true, rtol=5e-3)
    assert (found > true * (1 - 1e-9)).all()
    plain = np.sqrt(eigh(*(a.toarray() for a in model.matrices()), eigvals_only=True)[:6])
    assert np.abs(plain / true - 1).max() > 0.02
    assert place.values(x[-1:]) == {"factor": pytest.approx(0.5)}


def test_a_region_of_a_refined_mesh_is_made_of_the_decks_elements(tmp_path: Path) -> None:
    model = plate(tmp_path)
    finer = refined_model(model)
    for coarse, fine in zip(regions(model), regions(finer), strict=True):
        assert coarse.nodes == fine.nodes
        assert len(fine.elements) == 4 * len(coarse.elements)
        assert finer.drawn_elements(fine.elements) == coarse.elements


def test_stiffness_follows_the_basis_it_is_asked_for(tmp_path: Path) -> None:
    model = plate(tmp_path)
    place = regions(model)[0]
    for f_max in (300.0, 900.0):
        reduced = reduce_model(model, f_max, [6 * 110 + 2])
        K = np.zeros((reduced.r, reduced.r))
        for eid in place.elements:
            rows, Ke, _ = model.fe.element_matrices(eid, np.ones(0))
            K += reduced.V[rows].T @ Ke @ reduced.V[rows]
        np.testing.assert_allclose(region_stiffness(place, reduced), K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert hypothesis_of(place, reduced).reduced.members == (place,)


def test_regions_of_a_large_model_are_made_of_the_cells_they_share(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = plate(tmp_path)
    reduced = reduce_model(model, 900.0, [6 * 110 + 2])
    alone = [region_stiffness(place, reduced) for place in regions(model)]
    monkeypatch.setattr(region_stiffness_module, "LARGE", 10)
    together = regions(model)
    projected: list[int] = []
    own = region_stiffness_module._assembled

    def counted(elements: Sequence[int], model: Model) -> object:
        projected.extend(elements)
        return own(elements, model)

    monkeypatch.setattr(region_stiffness_module, "_assembled", counted)
    prepare_regions(together, reduced)
    assert sorted(projected) == sorted({eid for place in together for eid in place.elements})
    for place, K in zip(together, alone, strict=True):
        np.testing.assert_allclose(region_stiffness(place, reduced), K, rtol=0, atol=1e-9 * np.abs(K).max())
    assert len(projected) == NX * NY
