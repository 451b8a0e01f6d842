"""Cards of what was found between two nodes, and the elements that a factor is of."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_array

from femend.model import Model, read_model
from femend.study.result.patch import cards_told, deck_cards

DECK = """BEGIN BULK
CORD2R,7,,0.0,0.0,0.0,0.0,0.0,1.0
,0.0,1.0,0.0
GRID,1,,0.0,0.0,0.0
GRID,2,,0.1,0.0,0.0
GRID,3,,0.1,0.1,0.0
GRID,4,,0.1,0.1,0.0,7
CBAR,1,1,1,2,0.0,0.0,1.0
CBAR,2,1,2,3,0.0,0.0,1.0
PBAR,1,1,1.0-4,1.0-9,2.0-9,2.0-9
MAT1,1,7.0+10,,0.3,2700.0
ENDDATA
"""


def model_of_text(folder: Path, text: str) -> Model:
    file = folder / "deck.bdf"
    file.write_text(text)
    return read_model(file)


@pytest.fixture
def model(tmp_path: Path) -> Model:
    return model_of_text(tmp_path, DECK)


def finding(physics: str, nodes: list[int], direction: str, values: dict[str, float], **more: Any) -> dict[str, Any]:
    to = str(nodes[1]) if len(nodes) == 2 else "ground"
    parameters = {name: {"value": value, "unit": "-"} for name, value in values.items()}
    location = {"nodes": nodes, "to": more.pop("to", to), "direction": direction, "also_possible": [], **more}
    return {"physics": physics, "location": location, "parameters": parameters}


def cards(model: Model, *findings: dict[str, Any]) -> list[str]:
    return [line for line in deck_cards(model, {"findings": list(findings)}) if not line.startswith("$")]


def test_springs_and_dashpots_between_two_nodes_have_cards(model: Model) -> None:
    assert cards(
        model,
        finding("viscous_damper", [1, 3], "", {"c": 120.0}),
        finding("support_stiffness", [1, 3], "", {"k": 4.0e4}),
        finding("support_stiffness", [1, 3], "X", {"k": 5.0e4}),
        finding("viscous_damper", [2, 3], "Y", {"c": 3.0}),
    ) == [
        "CBUSH,3,2,1,3",
        "PBUSH,2,B,1.200000E+02",
        "CBUSH,5,3,1,3",
        "PBUSH,3,K,4.000000E+04",
        "CELAS2,7,5.000000E+04,1,1,3,1",
        "CDAMP2,8,3.000000E+00,2,2,3,2",
    ]


def test_a_law_in_each_of_several_connections_to_ground_has_cards_at_each(model: Model) -> None:
    def each(physics: str, values: dict[str, float], to: str = "ground") -> list[str]:
        return cards(model, finding(physics, [2, 3], "Y", values, elements=[8, 9], each=True, to=to))

    assert each("viscous_damper", {"c": 3.0}) == ["CDAMP2,3,3.000000E+00,2,2", "CDAMP2,4,3.000000E+00,3,2"]
    assert each("joint_stiffness", {"k": 5.0}) == ["CELAS2,3,5.000000E+00,2,2", "CELAS2,4,5.000000E+00,3,2"]
    relaxing = each("viscoelastic", {"k0": 1.0, "k1": 2.0, "tau": 3.0})
    assert [line for line in relaxing if line.startswith("SPOINT")] == ["SPOINT,5", "SPOINT,6"]
    # the other ends of connections between nodes are not told
    assert not each("viscous_damper", {"c": 3.0}, to="")
    assert not each("cubic_stiffness", {"k3": 3.0})


def test_what_no_card_holds_is_a_comment(model: Model) -> None:
    # node 4 tells its displacements in another system, and lies where node 3 does
    assert cards(model, finding("support_stiffness", [3, 4], "X", {"k": 1.0})) == []
    assert cards(model, finding("support_stiffness", [3, 4], "", {"k": 1.0})) == []
    assert cards(model, finding("cubic_stiffness", [1, 3], "", {"k3": 1.0})) == []


def test_a_place_without_a_name_is_one_line_of_comment(model: Model) -> None:
    """A line without a word stood behind it."""
    unnamed = finding("", [3], "Z", {})
    assert deck_cards(model, {"findings": [unnamed]}) == ["$ femend: unnamed at node 3 Z to ground"]
    of_class = {**unnamed, "class": "dissipative"}
    assert deck_cards(model, {"findings": [of_class]})[1:] == ["$ femend: dissipative"]


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (
            finding("joint_stiffness", [2], "RY", {"k": 120.0}, to="member to node 3"),
            ("member at node 2 in RY, at the end of the member to node 3, stiffness 120", "at the place of node 2"),
        ),
        (
            finding("joint_stiffness", [1, 3], "", {"factor": 0.1}, elements=[21]),
            ("between nodes 1 and 3, factor 0.1", "give elements 21 a property of their own with that factor"),
        ),
        (finding("joint_stiffness", [1, 3], "", {"factor": 0.1}), ("give the elements between nodes 1 and 3 a",)),
        (finding("cubic_stiffness", [3], "Z", {"k3": 1.0e9}), ("cubic stiffness at node 3 in Z", "hold no such law")),
        (finding("cubic_stiffness", [2], "RY", {"k3": 9.0}, to="member to node 3"), ("hold no such law",)),
        (finding("compliant_support", [1, 2, 3], "", {"k1": 5.0e6}), ("by an RBE2 to a node of its own",)),
        (finding("support_stiffness", [3, 4], "X", {"k": 1.0}), ("put it in by hand (CELAS2",)),
    ],
)
def test_what_no_card_holds_is_told(model: Model, found: dict[str, Any], words: tuple[str, ...]) -> None:
    """A comment alone is easily overlooked: the deck would be run as if what was found were in it."""
    beside = finding("support_stiffness", [3], "Z", {"k": 1.0})
    (said,) = cards_told(model, {"findings": [beside, found]})
    assert said.startswith("the updated deck does not contain what was found (")
    assert all(word in said for word in words), said


@pytest.mark.parametrize(
    "found",
    [
        finding("tuned_absorber", [3], "Z", {"m": 0.2, "k": 3.0, "c": 4.0}),
        # a load is no part of a deck, and there is nothing to put in of a place without a law
        finding("unmeasured_force", [3], "Z", {"rms": 4.0}),
        finding("", [3], "Z", {}),
        {**finding("cubic_stiffness", [3], "Z", {"k3": 4.0}), "class": "elastic force"},
    ],
)
def test_nothing_is_told_of_what_has_cards_or_needs_none(model: Model, found: dict[str, Any]) -> None:
    assert cards_told(model, {"findings": [found]}) == []


def test_springs_that_no_case_control_stands_on_are_told(tmp_path: Path) -> None:
    found = {"findings": [finding("compliant_support", [1], "X", {"k1": 5.0e6})]}
    held = DECK.replace("ENDDATA", "SPC1,1,123456,1\nENDDATA")
    (said,) = cards_told(model_of_text(tmp_path, held), found)
    assert "do nothing until case control selects SPC set 900001" in said
    assert cards_told(model_of_text(tmp_path, held.replace("BEGIN", "SPC = 1\nBEGIN", 1)), found) == []


def test_what_a_factor_is_of_is_said(model: Model) -> None:
    lines = deck_cards(model, {"findings": [finding("joint_stiffness", [1, 3], "", {"factor": 0.1}, elements=[21])]})
    assert lines == [
        "$ femend: joint_stiffness between nodes 1 and 3 (elements 21)",
        "$ femend: factor = 0.1 -",
    ]


def test_the_cards_make_the_model_that_was_found(model: Model, tmp_path: Path) -> None:
    added = cards(model, finding("support_stiffness", [1, 3], "", {"k": 4.0e4}))
    file = tmp_path / "with.bdf"
    file.write_text(DECK.replace("ENDDATA", "\n".join([*added, "ENDDATA"])))
    K, before = read_model(file).matrices()[0], model.matrices()[0]
    first, third = (6 * model.index(node) for node in (1, 3))
    line = [2**-0.5, 2**-0.5]
    change = (K - before).toarray()
    assert change[first, first] == pytest.approx(4.0e4 * line[0] ** 2)
    assert change[first, third + 1] == pytest.approx(-4.0e4 * line[0] * line[1])


def test_masses_are_written_as_the_deck_scales_those_on_its_cards(tmp_path: Path) -> None:
    grams = model_of_text(tmp_path, DECK.replace("2700.0", "2.7+6").replace("MAT1", "PARAM,WTMASS,1.-3\nMAT1"))
    assert cards(grams, finding("added_mass", [3], "Z", {"m": 0.2})) == ["CONM2,3,3,,2.000000E+02"]
    absorber = cards(grams, finding("tuned_absorber", [3], "Z", {"m": 0.2, "k": 3.0, "c": 4.0}))
    assert "CMASS2,3,2.000000E+02,5" in absorber


def receptance(model: Model, at: tuple[int, int], s: complex) -> complex:
    """Of a DOF to a force on it, with dashpots and loss factors, on the line `s`."""
    indptr, indices, k, m, c, h = model.fe.assemble()
    K, M, C, H = (csc_array((v, indices, indptr), shape=(model.fe.n_a,) * 2).toarray() for v in (k, m, c, h))
    row = model.transformation().tocsr()[[6 * model.index(at[0]) + at[1] - 1]].toarray()[0]
    return complex(row @ np.linalg.solve(K + s * C + s**2 * M + 1j * H, row))


@pytest.mark.parametrize(
    ("physics", "values", "stiffness"),
    [
        (
            "tuned_absorber",
            {"m": 0.2, "k": 5.0e4, "c": 9.0},
            lambda s: 0.2 * s**2 * (5.0e4 + 9.0 * s) / (0.2 * s**2 + 9.0 * s + 5.0e4),
        ),
        ("viscoelastic", {"k0": 2.0e4, "k1": 7.0e4, "tau": 3e-3}, lambda s: 2.0e4 + 7.0e4 * 3e-3 * s / (1 + 3e-3 * s)),
        ("viscoelastic", {"k0": 0.0, "k1": 7.0e4, "tau": 3e-3}, lambda s: 7.0e4 * 3e-3 * s / (1 + 3e-3 * s)),
        ("structural_damping", {"k": 3.0e4, "eta": 0.4}, lambda s: 3.0e4 * (1 + 0.4j)),
    ],
    ids=["absorber", "Zener", "Maxwell", "loss factor"],
)
def test_cards_of_laws_that_lose_energy_are_those_laws(
    tmp_path: Path, physics: str, values: dict[str, float], stiffness: Callable[[complex], complex]
) -> None:
    """A law kappa(s) to ground makes the receptance H into H / (1 + kappa H)."""
    held = DECK.replace("ENDDATA", "SPC1,1,123456,1\nENDDATA").replace("BEGIN", "SPC = 1\nBEGIN", 1)
    bare = model_of_text(tmp_path, held)
    written = cards(bare, finding(physics, [3], "Z", values))
    assert written
    with_it = model_of_text(tmp_path, held.replace("ENDDATA", "\n".join([*written, "ENDDATA"])))
    for freq in (11.0, 75.0, 300.0):
        s = 2j * np.pi * freq
        plain = receptance(bare, (3, 3), s)
        np.testing.assert_allclose(receptance(with_it, (3, 3), s), plain / (1 + stiffness(s) * plain), rtol=1e-6)


def test_two_laws_have_points_of_their_own(model: Model) -> None:
    absorber = {"m": 0.2, "k": 5.0e4, "c": 9.0}
    found = cards(
        model,
        finding("tuned_absorber", [3], "Z", absorber),
        finding("viscoelastic", [2, 3], "Y", {"k0": 1.0, "k1": 2.0, "tau": 3.0}),
        finding("structural_damping", [2, 3], "Y", {"k": 1.0, "eta": 0.5}),
    )
    assert [line for line in found if line.startswith("SPOINT")] == ["SPOINT,5", "SPOINT,6"]
    ids = [line.split(",")[1] for line in found if not line.startswith("SPOINT")]
    assert len(set(ids)) == len(ids) == 7
    assert found[-1].endswith(",2,2,3,2,5.000000E-01")
    # an oscillator hangs on one node
    assert not cards(model, finding("tuned_absorber", [2, 3], "Y", absorber))
