"""Supports of plates that give way: opened and put on a spring they are the deck without them, on that spring."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femend.diagnose.locating.joint import open_joint
from femend.model import Model, Parameter, Place, ReducedModel, find_places, read_model, reduce_model

NX, NY, SIDE = 12, 8, 0.025
CORNERS = (1, 13, 105, 117)
INSIDE = 18


def plate(folder: Path, held: tuple[int, ...], more: str = "", parameters: tuple[Parameter, ...] = ()) -> Model:
    """A plate on its corners; in-plane motion held everywhere, as for a plate that bends."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    lines += ["PSHELL,1,1,0.003,1,,1"]
    for j in range(NY + 1):
        for i in range(NX + 1):
            lines.append(f"GRID,{1 + i + (NX + 1) * j},,{i * SIDE:.3f},{j * SIDE:.3f},0.")
    for j in range(NY):
        for i in range(NX):
            n = 1 + i + (NX + 1) * j
            lines.append(f"CQUAD4,{1 + i + NX * j},1,{n},{n + 1},{n + NX + 2},{n + NX + 1}")
    lines += [f"SPC1,1,126,1,THRU,{(NX + 1) * (NY + 1)}", *(f"SPC1,1,3,{n}" for n in held)]
    lines += [*([more] if more else []), "ENDDATA", ""]
    path = folder / "plate.bdf"
    path.write_text("\n".join(lines))
    return read_model(path, parameters=parameters)


def supports(model: Model) -> list[Place]:
    return [p for p in find_places(model) if p.kind == "support"]


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


def test_a_support_that_no_single_parameter_scales_is_left_out(tmp_path: Path) -> None:
    thickness = Parameter("t", "t", "property_id", (1,))
    assert supports(plate(tmp_path, CORNERS, parameters=(thickness,))) == []
    modulus = Parameter("E", "E", "material", (1,))
    assert [p.parameter for p in supports(plate(tmp_path, CORNERS, parameters=(modulus,)))] == [0, 0, 0, 0]
