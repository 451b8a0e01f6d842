"""Decks of other programs, and of our own cases: each is read or refused with a reason; size and speed."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from femend.errors import DeckError
from femend.io.deck import read_deck

# cards, or faults, for which a deck of the collection is refused (punched results are no decks); any other is news
REASONS = {
    "PCOMP",
    "MAT10",
    "DMIG",
    "SEBULK",
    "EXTRN",
    "CQUADR",
    "replicates",
    "without a card",
    "cannot be read",
}
SUFFIXES = {".bdf", ".dat", ".blk", ".inc", ".asm", ".pch"}


def decks(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix in SUFFIXES)


def test_decks_of_the_collection_are_read_or_refused_for_a_known_reason(shared: Callable[[str], Path]) -> None:
    refused: dict[str, str] = {}
    read = 0
    for path in decks(shared("data/formats/nastran")):
        try:
            deck = read_deck(path)
            assert len(deck.elements()) >= 0
            assert deck.xyz.shape == (len(deck.node_ids), 3)
            read += 1
        except DeckError as error:
            refused[path.name] = f"{error.file}: {error}"
    assert not any(why.startswith("None") for why in refused.values())
    print(*(f"{name}: {why}" for name, why in refused.items()), sep="\n")
    unexplained = {name: why for name, why in refused.items() if not any(reason in why for reason in REASONS)}
    assert unexplained == {}
    assert read >= 10


def test_decks_of_the_cases_are_read(shared: Callable[[str], Path]) -> None:
    models = sorted(shared("cases").glob("*/public/model.bdf"))
    assert models
    for model in models:
        deck = read_deck(model)
        assert deck.case_control()["SPC"] == "1"
        assert len(deck.elements()) > 10
        assert deck.ignored() == {}


def test_counts_agree_with_pynastran(shared: Callable[[str], Path], pynastran_python: Path) -> None:
    script = (
        "import sys, json; from pyNastran.bdf.bdf import BDF\n"
        "m = BDF(debug=None); m.read_bdf(sys.argv[1], xref=True, punch=sys.argv[2] == '1')\n"
        "print('@' + json.dumps([{k: v for k, v in m.card_count.items()},"
        " {int(n): list(map(float, g.get_position())) for n, g in m.nodes.items()}]))"
    )
    compared = 0
    for path in decks(shared("data/formats/nastran")) + sorted(shared("cases").glob("*/public/model.bdf"))[:2]:
        try:
            deck = read_deck(path)
        except DeckError:
            continue
        punch = "0" if "SOL" in deck.case_control() else "1"
        command = [str(pynastran_python), "-c", script, str(path), punch]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        answer = [line for line in run.stdout.splitlines() if line.startswith("@")]
        if run.returncode or not answer:
            continue  # it refuses decks cut out of a larger whole
        counts, positions = json.loads(answer[-1][1:])
        ours = deck.card_counts() | deck.ignored()
        for card in (
            "GRID",
            "CBAR",
            "CBEAM",
            "CQUAD4",
            "CTRIA3",
            "CONM2",
            "CBUSH",
            "CELAS1",
            "MAT1",
            "PBAR",
            "CORD2R",
            "RBE2",
        ):
            assert ours.get(card, 0) == counts.get(card, 0), (path.name, card)
        xyz = dict(zip(deck.node_ids.tolist(), deck.xyz.tolist(), strict=True))
        for node, position in positions.items():
            assert xyz[int(node)] == pytest.approx(position, rel=1e-9, abs=1e-9), (path.name, node)
        compared += 1
    assert compared >= 5


def test_a_million_lines_are_read_in_two_seconds(tmp_path: Path) -> None:
    n = 700
    path = tmp_path / "large.bdf"
    with path.open("w") as file:
        file.write("SOL 103\nCEND\nBEGIN BULK\nMAT1,1,2.1+11,,.3,7850.\nPSHELL,1,1,.01,1\n")
        for i in range(n + 1):
            first = i * (n + 1) + 1
            file.writelines(
                f"GRID    {first + j:8d}        {i * 0.01:8.4f}{j * 0.01:8.4f}{0.0:8.4f}\n" for j in range(n + 1)
            )
        for i in range(n):
            a = [i * (n + 1) + j + 1 for j in range(n)]
            file.writelines(f"CQUAD4,{k},1,{k},{k + n + 1},{k + n + 2},{k + 1}\n" for k in a)
        file.writelines(f"$ {i}\n" for i in range(30_000))
        file.write("ENDDATA\n")
    start = time.process_time()  # not the clock on the wall: the machine may be busy with others
    deck = read_deck(path)
    seconds = time.process_time() - start
    assert deck.card_counts() == {"CQUAD4": n * n, "GRID": (n + 1) ** 2, "MAT1": 1, "PSHELL": 1}
    assert seconds <= 2.0
