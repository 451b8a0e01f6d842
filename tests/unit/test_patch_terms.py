"""Cards of what was found between two nodes, and the elements that a factor is of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from femend.model import Model, read_model
from femend.study.patch import deck_cards

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


@pytest.fixture
def model(tmp_path: Path) -> Model:
    file = tmp_path / "deck.bdf"
    file.write_text(DECK)
    return read_model(file)


def finding(physics: str, nodes: list[int], direction: str, values: dict[str, float], **more: Any) -> dict[str, Any]:
    to = str(nodes[1]) if len(nodes) == 2 else "ground"
    parameters = {name: {"value": value, "unit": "-"} for name, value in values.items()}
    location = {"nodes": nodes, "to": to, "direction": direction, "also_possible": [], **more}
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


def test_what_no_card_holds_is_a_comment(model: Model) -> None:
    # node 4 tells its displacements in another system, and lies where node 3 does
    assert cards(model, finding("support_stiffness", [3, 4], "X", {"k": 1.0})) == []
    assert cards(model, finding("support_stiffness", [3, 4], "", {"k": 1.0})) == []
    assert cards(model, finding("cubic_stiffness", [1, 3], "", {"k3": 1.0})) == []


def test_what_a_factor_is_of_is_said(model: Model) -> None:
    lines = deck_cards(model, {"findings": [finding("joint_stiffness", [1, 3], "", {"factor": 0.1}, elements=[21])]})
    assert lines == [
        "$ femend: joint_stiffness at node 1, 3 to 3 (elements 21)",
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
