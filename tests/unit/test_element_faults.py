"""Models that cannot be solved: each is refused with the element or DOF by name, from the deck on."""

from __future__ import annotations

from pathlib import Path

import pytest

from femend.analysis.model_modes import model_modes
from femend.errors import DeckError, FemendError, ModelError, SingularModelError
from femend.model import read_model

MATERIAL = ["MAT1,1,2.1+11,,0.3,7850.", "PBAR,1,1,6.-4,5.-8,5.-8,1.-7"]
LINE = [*MATERIAL, *(f"GRID,{i},,{i}.,0.,0." for i in range(1, 5)), "CBAR,1,1,1,2,0.,1.,0.", "SPC1,1,123456,1"]
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CUBE = [*MATERIAL, "PSOLID,2,1", *(f"GRID,{i + 1},,{x}.,{y}.,{z}." for i, (x, y, z) in enumerate(CORNERS))]
SHELL = [*CUBE, "PSHELL,3,1,.01,1,,1"]


def solve(folder: Path, cards: list[str]) -> None:
    file = folder / "model.bdf"
    held = ["SPC = 1"] if any(card.startswith("SPC") for card in cards) else []
    direct = ["K2GG = KX"] if any(card.startswith("DMIG") for card in cards) else []
    file.write_text("\n".join(["SOL 103", "CEND", *held, *direct, "MPC = 1", "BEGIN BULK", *cards, "ENDDATA", ""]))
    model_modes(read_model(file), n_modes=3)


MPC = "MPC,1,9,1,1.,9,2,-1."  # keeps the selected set defined where the case is about something else


@pytest.mark.parametrize(
    ("cards", "error", "words"),
    [
        ([*CUBE, "CHEXA,7,2,5,6,7,8,1,2", "+,3,4"], ModelError, ("CHEXA 7", "Jacobian")),
        ([*CUBE, "CPYRAM,7,2,4,3,2,1,5"], ModelError, ("CPYRAM 7", "Jacobian")),
        ([*CUBE, "CTETRA,7,2,1,3,2,5"], ModelError, ("CTETRA 7", "Jacobian")),
        ([*SHELL, "CTRIA3,7,3,1,2,3", "+,,,0.,.01,.01"], ModelError, ("CTRIA3 7", "thickness")),
        ([*CUBE, "PSHELL,3,1,0.", "CQUAD4,7,3,1,2,3,4"], ModelError, ("CQUAD4 7", "thickness 0")),
        ([*CUBE, "CTRIA3,7,5,1,2,3"], DeckError, ("CTRIA3 7", "property 5 is not defined")),
        ([*CUBE, "CTRIA3,7,2,1,2,3"], DeckError, ("CTRIA3 7", "PSOLID", "PCOMP")),
        ([*CUBE, "PCOMP,3", "+,6,.1", "CTRIA3,7,3,1,2,3"], DeckError, ("PCOMP 3", "material 6")),
        (
            [*LINE, "CBAR,2,1,2,3,0.,1.,0.", "MPC,1,2,2,1.,3,2,-1.", "MPC,1,3,2,1.,2,2,-2."],
            ModelError,
            ("circle", "MPC 1"),
        ),
        (
            [*LINE, "CBAR,2,1,2,3,0.,1.,0.", "MPC,1,3,2,1.,2,2,-1.", "RBE2,8,2,123456,3"],
            ModelError,
            ("DOF 3:2", "dependent twice", "RBE2 8", "MPC 1"),
        ),
        (
            [*LINE, "MPC,1,2,1,1.,2,2,0.5", "CELAS2,9,100.,3,1,4,1"],
            SingularModelError,
            ("without stiffness and without mass", "4:+X"),
        ),
        ([*LINE, "CONM2,9,2,,-900."], ModelError, ("mass of the model is below nothing", "2:+Y", "CONM2 9", "-900.")),
        ([*LINE, "CONM2,9,2,,1.,,,,,", "+,-9."], ModelError, ("mass of the model is below nothing", "2:+RX")),
        ([*LINE, "CONM1,9,2,0,1.,20.,1."], ModelError, ("mass of the model is below nothing", "2:+X", "2:+Y")),
        ([*LINE, "CELAS2,9,-1.+9,2,2"], ModelError, ("negative in 1 way", "CELAS2 9", "-1.+9")),
        (
            [*LINE, "GRID,8,,9.", "CELAS2,8,1.+6,8,2,2,2", "CELAS2,9,-1.+6,8,2"],
            ModelError,
            ("negative in 1 way", "CELAS2 9", "-1.+6"),
        ),
        ([*LINE, "PARAM,WTMASS,-1."], DeckError, ("WTMASS = -1", "above 0")),
        (  # a multiplier that ties node 2 to ground, without a diagonal term of its own
            [*LINE, "SPOINT,100", "DMIG,KX,0,6,1,0", "DMIG,KX,100,0,,2,2,1.+6"],
            ModelError,
            ("negative in 1 way",),
        ),
        ([*LINE, "CSUPER,1,,2"], DeckError, ("CSUPER", "superelements are not read")),
        ([*LINE, "CYJOIN,1,C,1"], DeckError, ("CYJOIN", "cyclic")),
    ],
)
def test_a_fault_is_told_with_its_element_or_dof(
    tmp_path: Path, cards: list[str], error: type[FemendError], words: tuple[str, ...]
) -> None:
    if not any(card.startswith("MPC") for card in cards):
        cards = [*cards, "GRID,9,,5.,5.,5.", MPC]
    with pytest.raises(error) as caught:
        solve(tmp_path, cards)
    for word in words:
        assert word in str(caught.value)
