"""Pairs of a body (a lump that rigid elements or springs carry) and the members it faces."""

from __future__ import annotations

from pathlib import Path

from femend.model import Model, find_places, read_model
from femend.model.places.body_places import FACED, body_places, faced
from femend.model.places.places import held_rows

# a frame of two long beams and one across, 1.2 m by 0.5 m, its middle bars cut in two
POINTS = {
    1: (0, 0),
    2: (0.3, 0),
    3: (0.6, 0),
    4: (1.2, 0),
    11: (0, 0.5),
    12: (0.3, 0.5),
    13: (0.6, 0.5),
    14: (1.2, 0.5),
    21: (0.6, 0.25),
}
BARS = ((1, 2), (2, 3), (3, 4), (11, 12), (12, 13), (13, 14), (3, 21), (21, 13))


def frame(folder: Path, *cards: str) -> Model:
    held = ["SPC = 1"] if any(card.startswith("SPC1") for card in cards) else []
    lines = ["SOL 103", "CEND", *held, "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,2.-4,3.-8,3.-8,4.-8"]
    lines += [f"GRID,{n},,{x},{y},0." for n, (x, y) in POINTS.items()]
    lines += [f"CBAR,{i + 1},1,{a},{b},0.,0.,1." for i, (a, b) in enumerate(BARS)]
    path = folder / "frame.bdf"
    path.write_text("\n".join([*lines, *cards, "ENDDATA", ""]))
    return read_model(path)


PAYLOAD = ("GRID,60,,0.3,0.25,0.08", "CONM2,601,60,,1.2,0.03,0.,0.02")
CARRIED = (*PAYLOAD, "RBE2,501,60,123456,2,12")


def pairs(model: Model, node: int) -> set[tuple[int, str]]:
    return {(int(p.to), p.direction) for p in find_places(model) if p.kind == "pair" and p.nodes[0] == node}


def test_a_payload_faces_the_members_beside_it_but_not_what_carries_it(tmp_path: Path) -> None:
    found = pairs(frame(tmp_path, *CARRIED), 60)
    # the middle of the member across, where the deck has no joint, along the line and all axes
    assert {(21, ""), (21, "X"), (21, "Y"), (21, "Z")} <= found
    # the nearest nodes of the long ones move with it
    assert not {2, 12} & {to for to, _ in found}
    assert {to for to, _ in found} == {21, 1, 11, 3, 13}


def test_pairs_come_in_the_order_of_their_distance(tmp_path: Path) -> None:
    model = frame(tmp_path, *CARRIED)
    assert faced(model, [[1, 2, 3], [4, 3], [3, 21, 13]]) == [(60, 21), (60, 1), (60, 3)]
    assert faced(model, [[n] for n in POINTS])[:1] == [(60, 21)]
    assert len(faced(model, [[n] for n in POINTS])) == min(FACED, len(POINTS) - 2)
    assert faced(model, []) == []


def test_a_lump_on_a_beam_is_no_body(tmp_path: Path) -> None:
    """It is a joint, which is paired with the others anyway."""
    assert faced(frame(tmp_path, "CONM2,601,21,,1.2"), [list(POINTS)]) == []
    assert faced(frame(tmp_path), [list(POINTS)]) == []


def test_a_body_that_cannot_move_has_no_place_with_what_is_held(tmp_path: Path) -> None:
    model = frame(tmp_path, *PAYLOAD, "SPC1,1,123456,60,4")
    places = body_places(model, held_rows(model), [[4], [3, 21]])
    assert {p.nodes for p in places} == {(60, 21)}
    assert body_places(model, held_rows(model), [[4], [3, 21]], places) == []
