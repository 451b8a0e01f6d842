"""Bushes and springs of a deck as places: a factor each, one for all of a property, and the pairs of their nodes."""

from __future__ import annotations

from pathlib import Path

from femend.model import Model, Parameter, read_model
from femend.model.places.connection_places import connection_places
from femend.model.places.places import find_places, topology

DECK = """BEGIN BULK
GRID,1,,0.0,0.0,0.0
GRID,2,,0.1,0.0,0.0
GRID,3,,0.2,0.0,0.0
GRID,11,,0.0,0.0,0.05
GRID,12,,0.1,0.0,0.05
GRID,13,,0.2,0.0,0.05
CBAR,1,1,1,2,0.0,0.0,1.0
CBAR,2,1,2,3,0.0,0.0,1.0
CBAR,11,1,11,12,0.0,0.0,1.0
CBAR,12,1,12,13,0.0,0.0,1.0
PBAR,1,1,1.0-4,1.0-9,2.0-9,2.0-9
MAT1,1,7.0+10,,0.3,2700.0
CBUSH,21,5,1,11,,,,0
CBUSH,22,5,3,13,,,,0
PBUSH,5,K,1.0+5,1.0+5,2.0+5,10.0,10.0,10.0
CBUSH,31,6,2,,,,,0
PBUSH,6,K,1.0+4,1.0+4,1.0+4,1.0,1.0,1.0
CELAS2,41,3.0+4,12,3
ENDDATA
"""


def model(tmp_path: Path, *parameters: Parameter) -> Model:
    file = tmp_path / "deck.bdf"
    file.write_text(DECK)
    return read_model(file, parameters=list(parameters))


def test_every_connection_and_all_of_a_property_have_a_factor(tmp_path: Path) -> None:
    read = model(tmp_path)
    factors = [p for p in find_places(read) if p.kind == "connection"]
    assert sorted((p.elements, p.nodes, p.to) for p in factors) == [
        ((21,), (1, 11), "11"),
        ((21, 22), (1, 3), ""),
        ((22,), (3, 13), "13"),
        ((31,), (2,), "ground"),
        ((41,), (12,), "ground"),
    ]
    assert all(p.scaled and p.n_own == 1 and p.n_w == 0 for p in factors)
    said = {p.elements: p.text for p in factors}
    assert said[21,] == "connection 21 between nodes 1 and 11"
    assert said[41,] == "connection 41 of node 12 to ground"
    assert said[21, 22] == "all 2 connections of property 5"


def test_what_a_parameter_scales_has_no_factor_beside_it(tmp_path: Path) -> None:
    read = model(tmp_path, Parameter("k", "k1", "elements", (41,)))
    factors = [p for p in find_places(read) if p.kind == "connection"]
    assert sorted(p.elements for p in factors) == [(21,), (21, 22), (22,), (31,)]
    assert {p.parameter for p in factors} == {None}


def test_the_nodes_of_a_connection_are_a_pair_along_their_line_and_the_axes(tmp_path: Path) -> None:
    read = model(tmp_path)
    held = topology(read).held
    pairs = [p for p in connection_places(read, held) if p.kind == "pair"]
    assert [(p.nodes, p.direction) for p in pairs] == [
        ((1, 11), ""), ((1, 11), "X"), ((1, 11), "Y"), ((3, 13), ""), ((3, 13), "X"), ((3, 13), "Y"),
    ]  # fmt: skip
    # those that are places already are not listed again
    assert not [p for p in connection_places(read, held, pairs) if p.kind == "pair"]
    every = find_places(read)
    seen = [(frozenset(p.nodes), p.direction) for p in every if p.kind == "pair"]
    assert len(seen) == len(set(seen))


MOUNTS = """CBUSH,51,7,1,,,,,0
PBUSH,7,K,2.0+4,,3.0+4
CBUSH,52,8,3,,,,,0
PBUSH,8,K,2.0+4,,3.0+4
ENDDATA
"""


def test_connections_that_are_alike_have_a_law_together_along_each_axis_they_resist(tmp_path: Path) -> None:
    file = tmp_path / "deck.bdf"
    file.write_text(DECK.replace("ENDDATA\n", MOUNTS))
    read = read_model(file)
    together = [p for p in find_places(read) if p.kind == "bushes"]
    # two of one property, and two whose properties have the same stiffness, which resist along X and Z alone
    assert [(p.elements, p.nodes, p.direction, p.to) for p in together] == [
        ((21, 22), (1, 3), "X", ""), ((21, 22), (1, 3), "Y", ""), ((21, 22), (1, 3), "Z", ""),
        ((51, 52), (1, 3), "X", "ground"), ((51, 52), (1, 3), "Z", "ground"),
    ]  # fmt: skip
    between, grounded = together[2], together[4]
    assert grounded.text == "all 2 connections as stiff as 51, Z"
    row = {node: 6 * read.index(node) + 2 for node in (1, 3, 11, 13)}
    assert [dict(zip(r, v)) for r, v in zip(grounded.g_rows, grounded.g_values)] == [{row[1]: 1.0}, {row[3]: 1.0}]
    # between two nodes it is the second's motion against the first's
    assert [dict(zip(r, v)) for r, v in zip(between.g_rows, between.g_values)] == [
        {row[1]: -1.0, row[11]: 1.0}, {row[3]: -1.0, row[13]: 1.0},
    ]  # fmt: skip
    assert not any(p.part for p in together)
    # and they may all be softer or stiffer
    assert (51, 52) in [p.elements for p in find_places(read) if p.kind == "connection"]


def test_of_many_springs_those_that_are_alike_are_told_as_they_stand(tmp_path: Path) -> None:
    """Whatever stands between them in the deck; one between two nodes is none of those to ground."""
    springs = {51: ("3.0+4", 1, 3), 52: ("3.0+3", 2, 3), 53: ("3.0+4", 3, 1), 54: ("3.0+3", 3, 3), 55: ("3.0+4", 11, 3)}
    cards = "".join(f"CELAS2,{eid},{k},{node},{c}\n" for eid, (k, node, c) in springs.items())
    file = tmp_path / "deck.bdf"
    file.write_text(DECK.replace("ENDDATA\n", f"{cards}CELAS2,56,3.0+4,1,3,13,3\nENDDATA\n"))
    several = [p for p in find_places(read_model(file)) if p.kind == "connection" and len(p.elements) > 1]
    assert [(p.elements, p.text) for p in several] == [
        ((21, 22), "all 2 connections of property 5"),
        ((41, 51, 53, 55), "all 4 connections as stiff as 41"),
        ((52, 54), "all 2 connections as stiff as 52"),
    ]


def test_mounts_of_single_springs_have_a_law_together_along_each_axis(tmp_path: Path) -> None:
    """Of one property or of one stiffness, in whatever directions; four mounts of two springs are more than a law takes
    together, and along an axis they are not."""
    nodes = (1, 3, 11, 13)
    across = "".join(f"CELAS1,{60 + n},9,{n},2\nCELAS1,{80 + n},9,{n},3\n" for n in nodes)
    along = "".join(f"CELAS2,{100 + n},7.0+4,{n},1\n" for n in nodes)
    file = tmp_path / "deck.bdf"
    file.write_text(DECK.replace("ENDDATA\n", f"{across}{along}PELAS,9,2.0+4\nENDDATA\n"))
    together = [p for p in find_places(read_model(file)) if p.kind == "bushes" and p.to == "ground"]
    assert [(p.elements, p.direction, p.text) for p in together] == [
        ((61, 63, 71, 73), "Y", "4 of the 8 connections of property 9, Y"),
        ((81, 83, 91, 93), "Z", "4 of the 8 connections of property 9, Z"),
        ((101, 103, 111, 113), "X", "all 4 connections as stiff as 101, X"),
    ]
    assert all(p.nodes == nodes for p in together)
