"""What every deck simplifies, as unknowns that are always there."""

from __future__ import annotations

from pathlib import Path

import pytest

from femend.model import Parameter, read_model
from femend.model.idealisation import idealisation_terms

DECK = """SOL 103
CEND
BEGIN BULK
GRID,1,,0.,0.,0.,,123456
GRID,2,,1.,0.,0.
CBAR,1,1,1,2,0.,0.,1.
PBAR,1,1,1.-4,1.-9,2.-9,3.-9
MAT1,1,7.+10,,0.33,2700.
CONM2,7,2,,2.5,0.,0.,0.
,1.5-3,,{i22},,,4.0E-3
ENDDATA
"""


@pytest.mark.parametrize(
    ("i22", "expected"),
    [("2.5-3", {"I11": 1.5e-3, "I22": 2.5e-3, "I33": 4e-3}), ("", {"I11": 1.5e-3, "I33": 4e-3})],
)
def test_an_inertia_is_read_in_every_form_of_a_nastran_real(
    tmp_path: Path, i22: str, expected: dict[str, float]
) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(DECK.format(i22=i22))
    model = read_model(path, parameters=[Parameter("lump", "m", "mass", (7,), 0.05)])
    (term,) = idealisation_terms(model, 1.0)
    axes = [unknown.name.rsplit(" ", 1)[1] for unknown in term.unknowns]
    # a part with its factor, and the same without one taken away
    values = [float(part.matrix.data[0]) for part in term.parts[::2]]
    assert dict(zip(axes, values, strict=True)) == pytest.approx(expected)
