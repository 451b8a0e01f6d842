"""Parameters without anything to act on are refused in the user's words, with the ids that there are."""

from __future__ import annotations

from pathlib import Path

import pytest

from femend.errors import ModelError
from femend.model import Parameter, read_model

DECK = """SOL 103
CEND
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
CQUAD4,11,5,1,2,3,4
PSHELL,5,1,.01,1
CELAS2,12,1.+5,1,3
CBUSH,13,50,2,3,0.,0.,1.
PBUSH,50,K,1.+6,1.+6,1.+6,1.+3,1.+3,1.+3
CONM2,21,3,,.5
MAT1,1,7.+10,,.3,2700.
MAT1,4,2.+11,,.3,7800.
SPC1,1,123456,1
ENDDATA
"""


@pytest.mark.parametrize(
    ("parameter", "said"),
    [
        (("E", "material", 7), "'x': no element uses material 7 (nearest ids 4, 1); correct the id"),
        (("E", "material", 4), "'x': material 4 is in the deck, but its factor acts on no element; correct the id"),
        (("k1", "property_id", 99), "'x': no element uses property 99 (nearest id 50); correct the id"),
        (("E", "elements", 14), "'x': the deck has no element 14 (nearest ids 13, 12, 11); correct the id"),
        (("m", "mass", 2), "'x': the deck has no mass element 2 (nearest id 21); correct the id"),
        (("E", "material_id", 1), 'target "material_id" is unknown; use material, property_id, elements or mass'),
        (("t", "property_id", 50), "'x': its factor changes nothing: t of property 50 has no part in K, M or C"),
    ],
)
def test_the_message_names_parameter_ids_and_property_as_written(
    tmp_path: Path, parameter: tuple[str, str, int], said: str
) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(DECK)
    quantity, target, wanted = parameter
    known = Parameter("E", "E", "material", (1,), 0.1)
    with pytest.raises(ModelError) as refused:
        read_model(path, parameters=[known, Parameter("x", quantity, target, (wanted,), 0.1)])
    assert said in str(refused.value)
