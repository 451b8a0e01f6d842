"""Modes of 0 Hz are told apart: a free body's, and a mechanism's with who moves in it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend.analysis.model_modes import model_modes
from femend.cli import main
from femend.io.superelement import Superelement, superelement_cards
from femend.model import Model, read_model
from femend.model.reduced.rigid_motion import ZeroModes, count_zero, rigid_motions, zero_modes
from femend.study.doubts.plausible import _free

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

HEAD = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,.33,2700."]
BAR = "PBAR,1,1,3.3-4,3.3-9,2.5-8,1.0-8"


def chain(pins: dict[int, str], held: str = "") -> list[str]:
    """Nine bars in space along a slanted line, of which some have a pinned end; `held` cards beside."""
    lines = [*HEAD, BAR, "CORD2R,5,,0.,0.,0.,.3,.4,.8", ",1.,0.,.2"]
    lines += [f"GRID,{n},,{0.1 * n:.2f},{0.03 * n:.2f},{0.02 * n * n:.3f},{5 if n % 2 else 0}" for n in range(1, 11)]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,0.,1.,,+{n}\n+{n},{pins.get(n, '')}" for n in range(1, 10)]
    return [*lines, held, "ENDDATA", ""]


def solved(folder: Path, lines: list[str]) -> tuple[Model, ZeroModes]:
    # a set that is selected has to be there
    held = any(line.startswith("SPC1,1,") for line in lines)
    (folder / "a.bdf").write_text("\n".join(line for line in lines if held or line != "SPC = 1"))
    model = read_model(folder / "a.bdf")
    modes = model_modes(model, n_modes=20)
    n = int((modes.freq < 1e-6 * modes.freq[-1]).sum())
    return model, zero_modes(model, np.real(modes.phi[:, :n]))


def test_a_body_in_space_is_free_in_six_ways_and_nothing_is_told(tmp_path: Path) -> None:
    model, found = solved(tmp_path, chain({}))
    assert found == ZeroModes(6, 0)
    assert _free(model, model_modes(model)) == []
    # motions of a rigid body take no force
    K, _ = model.matrices()
    R = rigid_motions(model)
    assert np.abs(K @ R).max() < 1e-9 * np.abs(K).max()


def test_six_modes_of_a_pinned_chain_are_a_mechanism_and_who_moves_is_named(tmp_path: Path) -> None:
    # three hinges about two axes each, held at one end: six modes of 0 Hz, none of a rigid body
    model, found = solved(tmp_path, chain({7: "56", 8: "56", 9: "56"}, "SPC1,1,123456,1"))
    assert (found.rigid, found.mechanism) == (0, 6)
    assert found.nodes == (8, 9, 10)
    assert found.elements == (8, 9)
    (told,) = _free(model, model_modes(model, n_modes=20))
    assert "6 ways (6 modes of 0 Hz, 6 of them a mechanism" in told
    assert "nodes 8, 9, 10 that move (elements 8, 9)" in told


def test_the_command_tells_a_mechanism_of_six_ways_and_a_free_body(tmp_path: Path) -> None:
    for name, lines in (("held", chain({7: "56", 8: "56", 9: "56"}, "SPC1,1,123456,1")), ("free", chain({}))):
        text = "\n".join(line for line in lines if name == "held" or line != "SPC = 1")
        (tmp_path / f"{name}.bdf").write_text(text)
    said = [CliRunner().invoke(main, ["modes", str(tmp_path / f"{name}.bdf")]).output for name in ("held", "free")]
    assert "6 of them a mechanism" in said[0]
    assert "6 modes of a free body" in said[1]


def test_a_free_body_with_a_hinge_has_one_way_more(tmp_path: Path) -> None:
    _, found = solved(tmp_path, chain({8: "5"}))
    assert (found.rigid, found.mechanism) == (6, 1)
    assert found.nodes in ((9, 10), (10,))


def test_a_lost_support_is_no_mechanism(tmp_path: Path) -> None:
    model, found = solved(tmp_path, chain({}, "SPC1,1,123,1"))
    assert (found.rigid, found.mechanism) == (3, 0)
    assert "3 ways (3 modes of 0 Hz, of the 6 of a free body)" in _free(model, model_modes(model))[0]


def test_a_bar_that_turns_about_itself_is_a_mechanism(tmp_path: Path) -> None:
    _, found = solved(tmp_path, chain({9: "4"}, "SPC1,1,123456,1"))
    assert (found.rigid, found.mechanism, found.nodes) == (0, 1, (10,))


@pytest.mark.parametrize("held", ["", "SPC1,1,2,1,2"])
def test_solids_have_no_rotations_to_compare(tmp_path: Path, held: str) -> None:
    lines = [*HEAD, "PSOLID,1,1"]
    for n in range(12):
        lines.append(f"GRID,{n + 1},,{0.1 * (n // 4):.1f},{0.1 * (n % 4 in (1, 2)):.1f},{0.1 * (n % 4 in (2, 3)):.1f}")
    lines += ["CHEXA,1,1,1,2,3,4,5,6\n,7,8", "CHEXA,2,1,5,6,7,8,9,10\n,11,12", held, "ENDDATA", ""]
    _, found = solved(tmp_path, lines)
    assert (found.rigid, found.mechanism) == ((5 if held else 6), 0)


def test_a_plane_model_moves_in_its_plane(tmp_path: Path) -> None:
    _, found = solved(tmp_path, small_study.deck().replace("SPC1,1,123456,1\n", "SPC1,1,246,1\n").split("\n"))
    assert (found.rigid, found.mechanism) == (3, 0)


@pytest.mark.parametrize("node", ["GRID,100,,.5,900.,0.,,123456", "GRID,100,,.5,900.,0."])
@pytest.mark.parametrize("names_it", [True, False])
def test_a_held_node_that_nothing_connects_says_nothing_of_a_free_body(
    tmp_path: Path, node: str, names_it: bool
) -> None:
    lines = chain({}, node)
    if names_it:
        lines = [line.replace("0.,0.,1.,,", "100,,,,") if line.startswith("CBAR,5,") else line for line in lines]
        assert any("100,,,," in line for line in lines)
    _, found = solved(tmp_path, lines)
    assert found == ZeroModes(6, 0)


def test_a_held_end_of_an_element_counts_though_it_does_not_move(tmp_path: Path) -> None:
    # the bar between the clamp and the hinge shows that the rest does not move as the whole
    _, found = solved(tmp_path, chain({1: ",456"}, "SPC1,1,123456,1"))
    # about the axis of that bar the clamp sees no difference
    assert (found.rigid, found.mechanism, found.nodes) == (1, 2, tuple(range(2, 11)))


@pytest.mark.parametrize("hinge", [3, 5, 8])
def test_it_is_the_side_that_is_not_clamped_that_moves(tmp_path: Path, hinge: int) -> None:
    # three ways about a ball joint at the far end of bar `hinge`, also where more nodes move than stand still
    _, found = solved(tmp_path, chain({hinge: ",456"}, "SPC1,1,123456,1"))
    assert (found.rigid, found.mechanism) == (0, 3)
    assert found.nodes == tuple(range(hinge + 1, 11))
    assert found.elements == tuple(range(hinge + 1, 10))


def test_turning_about_an_axis_through_the_clamp_is_no_motion_of_the_whole(tmp_path: Path) -> None:
    lines = [*HEAD, BAR, *(f"GRID,{n},,{0.1 * n:.1f},0.,0." for n in range(1, 12))]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,1.,0.,,+{n}\n+{n},{',456' if n == 5 else ''}" for n in range(1, 11)]
    _, found = solved(tmp_path, [*lines, "SPC1,1,123456,1", "ENDDATA", ""])
    assert (found.rigid, found.mechanism, found.nodes) == (0, 3, tuple(range(6, 12)))


def condensed(folder: Path, *extra: str) -> Path:
    """A free bar of 42 MN/m along and 8400 N/m across as a part condensed to its ends: across, it has the rounding of
    what it is along."""
    across, along, ulps = 8400.0, 4.2e7, 20 * np.finfo(np.float64).eps
    bend = across * np.array([[2, 1, -2, 1], [1, 2 / 3, -1, 1 / 3], [-2, -1, 2, -1], [1, 1 / 3, -1, 2 / 3]])
    K = np.zeros((12, 12))
    for pair, k in (((0, 6), along), ((3, 9), 400.0)):
        K[np.ix_(pair, pair)] += k * np.array([[1, -1], [-1, 1]])
    turned = np.array([1, -1, 1, -1])
    K[np.ix_((1, 5, 7, 11), (1, 5, 7, 11))] += bend
    K[np.ix_((2, 4, 8, 10), (2, 4, 8, 10))] += bend * np.outer(turned, turned)
    K[1, 1] += ulps * along
    K[2, 2] += ulps * along
    part = Superelement(tuple((n, c) for n in (1, 2) for c in range(1, 7)), K)
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", *superelement_cards(part, "S1"), *extra]
    cards += [f"CONM2,{n},{n},,2.,,,,,+{n}\n+{n},.01,,.1,,,.1" for n in (1, 2)]
    path = folder / "part.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "K2GG = KS1", "BEGIN BULK", *cards, "ENDDATA", ""]))
    return path


def test_a_condensed_part_is_free_as_far_as_its_rounding_tells(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["modes", str(condensed(tmp_path)), "--n", "8"])
    assert "\n6 modes of a free body\n" in done.output, done.output
    assert "moves freely" not in done.output


def test_what_a_soft_spring_holds_is_not_of_0_hz(tmp_path: Path) -> None:
    # twice 1e-4 N/m on 4 kg is 0.001 Hz, and omega^2 eighty times what the rounding of 42 MN/m comes to
    model = read_model(condensed(tmp_path, *(f"CELAS2,1{n}{c},1.-4,{n},{c}" for n in (1, 2) for c in (1, 2, 3))))
    modes = model_modes(model, n_modes=12)
    assert 0 < modes.freq[2] < 2e-3
    assert count_zero(model, model.matrices()[0], modes.freq, np.real(modes.phi)) == 1  # it turns about its axis


def test_a_heavy_end_of_a_bar_that_weighs_nothing_is_held(tmp_path: Path) -> None:
    # 1e-6 of the highest frequency computed, which that of the bar's own mass is, and no mode of 0 Hz
    lines = [line.replace("2700.", "1.-7") for line in chain({}, "SPC1,1,123456,1")]
    (tmp_path / "a.bdf").write_text("\n".join([*lines[:-2], "CONM2,50,10,,8.", "ENDDATA", ""]))
    model = read_model(tmp_path / "a.bdf")
    modes = model_modes(model, n_modes=20)
    assert 0.1 < modes.freq[0] < 1e-6 * modes.freq[-1]
    assert _free(model, modes) == []


@pytest.mark.parametrize("n", [1, 4, 6])
def test_as_few_modes_as_were_asked_for_say_nothing_of_a_support(tmp_path: Path, n: int) -> None:
    (tmp_path / "a.bdf").write_text("\n".join(line for line in chain({}) if line != "SPC = 1"))
    said = CliRunner().invoke(main, ["modes", str(tmp_path / "a.bdf"), "--n", str(n)]).output
    assert "missing" not in said
    assert f"asked for {'are' if n > 1 else 'is'} of 0 Hz (a free body has 6): ask for more, as by --n {n + 10}" in said
