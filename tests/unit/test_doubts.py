"""Mistakes in units and directions are told from a model that is off by what no resonance elsewhere does."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from femend import FRF, Channel, Dof, Recording, TimeData, _core, functions_of, read_uff, write_uff
from femend.bench.doubting.doubted import doubted_levels
from femend.bench.doubting.doubted_faint import faint_shapes
from femend.cli import main
from femend.correlate import mac
from femend.correlate.doubts import exchange_doubts, level_doubts, sign_doubts, twice_doubts
from femend.correlate.exchanged import Exchange, Shapes, exchanged, put_right, turned
from femend.data import Test
from femend.errors import ModelError
from femend.model import read_model
from femend.model.cards.material_units import material_doubts

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from femend.estimate import pair_test
from femend.study import load_study
from femend.study.doubts.plausible import doubts_found
from femend.study.doubts.sound import deck_warnings
from femend.study.file.channels_sound import with_warnings

FREQ = np.linspace(5.0, 100.0, 300)
SHAPES = np.array([[0.4, 1.0, 0.9], [0.7, 0.3, -1.0], [0.9, -0.6, 0.2], [1.0, -1.0, 0.8]])
NAMES = ["4:+Z", "7:+Z", "10:+Z", "13:+Z"]


def frfs(modes: tuple[float, ...]) -> np.ndarray:
    """Accelerances (300, 4, 2) of three modes at four sensors, driven at the last two."""
    w, W = 2 * np.pi * FREQ[:, None], 2 * np.pi * np.array(modes)
    gain = -(w**2) / (W**2 - w**2 + 0.02j * W * w)
    return np.einsum("or,fr,ir->foi", SHAPES, gain, SHAPES[2:])


MODEL = frfs((12.0, 33.0, 71.0))
# a structure 15 % stiffer here and softer there
TEST = frfs((13.5, 30.0, 75.0))


def test_a_model_that_is_off_is_not_doubted() -> None:
    assert level_doubts(TEST, MODEL, NAMES) == []
    assert sign_doubts(TEST, MODEL, NAMES, NAMES[2:]) == []


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1 / 9.80665, ("g and m/s²", "0.102")), (1000.0, ("m and mm", "1000")), (6.0, ("check the unit",))],
)
def test_a_factor_on_all_responses_is_told_with_what_it_may_be(factor: float, words: tuple[str, ...]) -> None:
    (doubt,) = level_doubts(factor * TEST, MODEL, NAMES)
    assert (doubt.kind, doubt.channel) == ("level", "")
    assert all(word in doubt.text for word in words), doubt.text


def test_one_sensor_in_other_units_is_named() -> None:
    wrong = TEST * np.array([1, 9.80665, 1, 1])[:, None]
    (doubt,) = level_doubts(wrong, MODEL, NAMES)
    assert (doubt.kind, doubt.channel) == ("sensor level", "7:+Z")
    assert "g and m/s²" in doubt.text


def test_a_reversed_sensor_and_a_reversed_force_are_named() -> None:
    (doubt,) = sign_doubts(TEST * np.array([1, -1, 1, 1])[:, None], MODEL, NAMES, NAMES[2:])
    assert (doubt.kind, doubt.channel) == ("sensor sign", "7:+Z")
    (doubt,) = sign_doubts(TEST * np.array([1, -1]), MODEL, NAMES, NAMES[2:])
    assert (doubt.kind, doubt.channel) == ("force sign", "13:+Z")
    (doubt,) = sign_doubts(-TEST[:, :, :1], MODEL[:, :, :1], NAMES, NAMES[2:3])
    assert (doubt.kind, doubt.channel) == ("force sign", "10:+Z")


def test_of_two_sensors_each_is_held_against_the_model() -> None:
    two, model, names = TEST[:, :2], MODEL[:, :2], NAMES[:2]
    assert level_doubts(two, model, names) == sign_doubts(two, model, names, NAMES[2:]) == []
    for factor in (9.80665, 1e-3):
        (doubt,) = level_doubts(two * np.array([factor, 1])[:, None], model, names)
        assert (doubt.kind, doubt.channel) == ("sensor level", "4:+Z")
        assert doubt.factor == pytest.approx(factor)
        (doubt,) = level_doubts(two * factor, model, names)
        assert (doubt.kind, doubt.channel) == ("level", "")
    (doubt,) = sign_doubts(two * np.array([1, -1])[:, None], model, names, NAMES[2:])
    assert (doubt.kind, doubt.channel) == ("sensor sign", "7:+Z")
    assert doubt.text.endswith("else 4:+Z is, and the force with it")
    # of one sensor nothing but the whole is known
    assert [d.kind for d in sign_doubts(-TEST[:, :1, :1], MODEL[:, :1, :1], NAMES[:1], NAMES[2:3])] == ["force sign"]


def in_order(order: list[int], H: np.ndarray = TEST, sd: float = 0.0) -> list[tuple[int, int]]:
    """Sensors that look exchanged where those of `H` stand in another `order`, with noise of deviation `sd`."""
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), SHAPES, SHAPES[2:])
    noise = sd * np.random.default_rng(3).standard_normal((2, *H.shape))
    seen = (H + noise[0] + 1j * noise[1])[:, order]
    return [e.sensors for e in exchanged(seen, np.full(H.shape, sd), FREQ, model)]


def test_exchanged_sensors_are_found_by_shapes_though_resonances_are_off() -> None:
    assert in_order([0, 1, 2, 3]) == []
    assert in_order([0, 2, 1, 3]) == [(1, 2)]
    assert in_order([3, 1, 2, 0]) == [(0, 3)]
    assert in_order([0, 3, 2, 1], sd=0.05 * np.sqrt(np.mean(np.abs(TEST) ** 2))) == [(1, 3)]
    (doubt,) = exchange_doubts(exchanged_pair(), NAMES)
    assert (doubt.kind, doubt.channel) == ("exchanged", "7:+Z")
    assert "7:+Z and 10:+Z look exchanged" in doubt.text


def test_two_pairs_among_eight_sensors_are_found() -> None:
    shapes = np.random.default_rng(5).standard_normal((8, 3))
    H = np.einsum("or,fri->foi", shapes, np.linalg.pinv(SHAPES) @ TEST)
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), shapes, SHAPES[2:])
    found = exchanged(H[:, [4, 1, 6, 3, 0, 5, 2, 7]], np.zeros(H.shape), FREQ, model)
    assert sorted(e.sensors for e in found) == [(0, 4), (2, 6)]


@pytest.mark.parametrize("sensors", [(0,), (1,), (2,), (3,)])
def test_a_sensor_upside_down_is_told_by_shapes_where_phases_do_not(sensors: tuple[int, ...]) -> None:
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), SHAPES, SHAPES[2:])
    assert turned(TEST, np.zeros(TEST.shape), FREQ, model) == []
    wrong = TEST.copy()
    wrong[:, sensors] *= -1
    found = turned(wrong, np.zeros(TEST.shape), FREQ, model)
    assert tuple(i for i, _ in found) == sensors
    assert all(left < 0.5 for _, left in found)


def test_turned_sensors_are_not_told_of_two_sensors_or_noise() -> None:
    few = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), SHAPES[:2], SHAPES[2:])
    assert turned(-TEST[:, :2], np.zeros((300, 2, 2)), FREQ, few) == []
    model = replace(few, out=SHAPES)
    wrong = TEST * np.array([1, -1, 1, 1])[:, None]
    assert turned(wrong, np.abs(wrong), FREQ, model) == []


def test_three_sensors_exchanged_in_a_circle_are_told_with_who_shows_what() -> None:
    shapes = np.random.default_rng(5).standard_normal((8, 3))
    H = np.einsum("or,fri->foi", shapes, np.linalg.pinv(SHAPES) @ TEST)
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), shapes, SHAPES[2:])
    for seed in range(12):
        rng = np.random.default_rng(seed)
        a, b, c = (int(i) for i in rng.permutation(8)[:3])
        order = list(range(8))
        order[b], order[c], order[a] = a, b, c  # b shows what a should, c what b, a what c
        found = exchanged(H[:, order], np.zeros(H.shape), FREQ, model)
        assert [order[i] for i in put_right(8, found)] == list(range(8)), seed
        assert [len(one.sensors) for one in found] == [3]
    names = [f"{n}:+Z" for n in range(8)]
    (doubt,) = exchange_doubts([Exchange((1, 4, 6), 0.1)], names)
    assert doubt.order == ("1:+Z", "4:+Z", "6:+Z")
    assert "in a circle (1:+Z shows what 4:+Z should, 4:+Z shows what 6:+Z should, 6:+Z shows what 1:+Z" in doubt.text


def exchanged_pair() -> list:
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), SHAPES, SHAPES[2:])
    return exchanged(TEST[:, [0, 2, 1, 3]], np.zeros(TEST.shape), FREQ, model)


def test_no_exchange_stands_for_a_sensor_upside_down_or_in_other_units_nor_for_sensors_that_move_alike() -> None:
    for factor in (-1.0, 9.80665, 1e-3):
        assert in_order([0, 1, 2, 3], TEST * np.array([1, factor, 1, 1])[:, None]) == []
    alike = SHAPES.copy()
    alike[1] = 1.02 * alike[0]
    gain = np.linalg.lstsq(SHAPES, TEST[:, :, 0].T, rcond=None)[0].T
    H = np.einsum("or,fr->fo", alike, gain)[:, [1, 0, 2, 3], None]
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), alike, SHAPES[2:])
    assert exchanged(H, np.zeros(H.shape), FREQ, model) == []


def test_too_few_sensors_or_lines_or_noise_alone_tell_no_exchange() -> None:
    model = Shapes(np.array([12.0, 33.0, 71.0]), np.full(3, 0.01), SHAPES, SHAPES[2:])
    H = TEST[:, [0, 2, 1, 3]]
    assert exchanged(H[:11], np.zeros((11, 4, 2)), FREQ[:11], model) == []
    assert (
        exchanged(H[:, :2], np.zeros((300, 2, 2)), FREQ, Shapes(model.freq, model.zeta, SHAPES[:2], model.into)) == []
    )
    assert exchanged(H, np.abs(H), FREQ, model) == []


def test_values_in_the_noise_do_not_count() -> None:
    clear = np.zeros(TEST.shape, dtype=bool)
    clear[:5] = True
    assert level_doubts(1000 * TEST, MODEL, NAMES, clear) == []
    assert sign_doubts(-TEST, MODEL, NAMES, NAMES[2:], clear) == []


def test_planes_that_do_not_couple_are_no_mistake_of_units() -> None:
    # the second force moves the last two sensors alone; elsewhere the model has rounding, and the test noise
    plane = np.ones((4, 2))
    plane[2:, 0] = plane[:2, 1] = 0.0
    rng = np.random.default_rng(0)
    model = MODEL * np.where(plane > 0, 1.0, 1e-15)
    noise = 0.005 * np.abs(TEST).max() * (rng.standard_normal(TEST.shape) + 1j * rng.standard_normal(TEST.shape))
    assert level_doubts(TEST * plane + noise, model, NAMES) == []
    assert level_doubts(1000 * (TEST * plane + noise), model, NAMES)[0].text.startswith("the responses per force")


def test_a_sensor_that_shows_noise_alone_is_not_compared_with_a_model_that_moves_little() -> None:
    rng = np.random.default_rng(0)
    H = TEST.copy()
    H[:, 0] = 0.005 * np.abs(TEST).max() * (rng.standard_normal((300, 2)) + 1j * rng.standard_normal((300, 2)))
    outputs = tuple(Channel(Dof.parse(n), "acceleration", "m/s^2") for n in NAMES)
    inputs = tuple(Channel(Dof.parse(n), "force", "N") for n in NAMES[2:])
    test, model = (
        FRF("test", FREQ, values, outputs, inputs, "accelerance", "m/s^2/N")
        for values in (H, MODEL * np.array([1e-4, 1.0, 1.0, 1.0])[:, None])
    )
    assert level_doubts(H, model.H, NAMES)
    assert (
        doubted_levels([SimpleNamespace(measured=SimpleNamespace(name="test", frf=test), frf=model, scaled=())]) == []
    )


def test_a_sensor_that_moves_where_the_model_does_not_respond_is_told_so() -> None:
    model = MODEL * np.array([1.0, 1e-15, 1.0, 1.0])[:, None]
    (doubt,) = level_doubts(TEST, model, NAMES)
    assert (doubt.kind, doubt.channel, doubt.factor) == ("held", "7:+Z", None)
    assert "where the model does not respond to the force: check node and direction" in doubt.text
    assert level_doubts(TEST * np.array([1.0, 0.01, 1.0, 1.0])[:, None], model, NAMES) == []


@pytest.mark.parametrize(
    ("E", "rho", "units", "words"),
    [
        ("2.1+5", "7.85-9", "SI", ("modulus of 210000", "density of 7.85e-09", "in 'mm-t-s' all are those of solids")),
        ("2.1+11", "7850.", "mm-t-s", ("which is 2.1e+17 Pa", "7.85e+15 kg/m³", "in 'SI' all are")),
        ("2.1+5", "7850.", "mm-t-s", ("MAT1 1 has a density of 7850",)),
        # weights per volume, and kilograms beside mm and N
        ("1.+7", "0.1", "in-lbf-s", ("density of 0.1, which is 1070000 kg/m³", "needs PARAM,WTMASS,0.00259 in the")),
        ("2.1+11", "76985.", "SI", ("density of 76985", "taken as weights in N", "needs PARAM,WTMASS,0.102 in the")),
        ("2.1+5", "7.85-6", "mm-t-s", ("taken as kilograms", "needs PARAM,WTMASS,0.001 in the deck")),
    ],
)
def test_materials_of_no_solid_are_told(tmp_path: Path, E: str, rho: str, units: str, words: tuple[str, ...]) -> None:
    (tmp_path / "a.bdf").write_text(f"MAT1,1,{E},,.3,{rho}\nMAT1,2,{E},,.3\nGRID,1\n")
    (told,) = material_doubts(_core.Deck.read(str(tmp_path / "a.bdf")), units)
    assert all(word in told for word in words), told


@pytest.mark.parametrize(
    ("cards", "words"),
    [
        # a link without mass, drawn before what has some
        ("MAT1,1,2.1+8,,.3\nMAT1,2,2.1+5,,.3,7850.", "MAT1 2 has a density of 7850, which"),
        ("MAT1,1,2.1+11,,.3\nMAT1,2,7.+10,,.3,7850.", "MAT1 2 has a modulus of 7e+10, which is 7e+16 Pa and a density"),
        ("MAT1,1,2.1+11,,.3\nMAT1,2,,,.3,7850.", "MAT1 1 has a modulus of 2.1e+11, which is 2.1e+17 Pa; MAT1 2 has a"),
    ],
)
def test_values_are_told_of_the_material_that_has_them(tmp_path: Path, cards: str, words: str) -> None:
    (tmp_path / "a.bdf").write_text(f"{cards}\nGRID,1\n")
    (told,) = material_doubts(_core.Deck.read(str(tmp_path / "a.bdf")), "mm-t-s")
    assert words in told, told


def test_masses_that_are_made_masses_once_more_are_told(tmp_path: Path) -> None:
    """Aluminium in lbf s²/in⁴ under PARAM,WTMASS: 7 kg/m³ is below all solids. Steel has 20, which a foam may have, but
    no foam has its modulus; a foam has not."""
    for E, rho, words in (
        ("1.+7", "2.588-4", "density of 0.0002588 times PARAM,WTMASS 0.00259, which is 7.16 kg/m³"),
        ("2.9+7", "7.35-4", "which is 20.3 kg/m³: sound would run at 99.1 km/s"),
    ):
        (tmp_path / "a.bdf").write_text(f"PARAM,WTMASS,2.59-3\nMAT1,1,{E},,.3,{rho}\nGRID,1\n")
        (told,) = material_doubts(_core.Deck.read(str(tmp_path / "a.bdf")), "in-lbf-s")
        assert words in told
        assert "without PARAM,WTMASS all are those of solids" in told
    (tmp_path / "a.bdf").write_text("MAT1,1,2.+7,,.3,20.\nGRID,1\n")
    assert material_doubts(_core.Deck.read(str(tmp_path / "a.bdf")), "SI") == []


def test_materials_of_solids_and_a_stand_in_are_not_told(tmp_path: Path) -> None:
    (tmp_path / "a.bdf").write_text("MAT1,1,2.1+5,,.3,7.85-9\nMAT1,2,2.1+12,,.3,1.-20\nGRID,1\n")
    assert material_doubts(_core.Deck.read(str(tmp_path / "a.bdf")), "mm-t-s") == []
    (tmp_path / "b.bdf").write_text("PARAM,WTMASS,2.59-3\nMAT1,1,1.+7,,.3,0.1\nGRID,1\n")
    assert material_doubts(_core.Deck.read(str(tmp_path / "b.bdf")), "in-lbf-s") == []


def test_a_low_mac_of_a_shape_that_is_mostly_noise_is_told_so() -> None:
    """Two modes at thirty sensors; noise of 0.4 of the second is what its deviations say."""
    rng = np.random.default_rng(5)
    true = np.column_stack([np.ones(30), np.cos(np.linspace(0, 3 * np.pi, 30))])
    sd = np.array([0.01, 0.4 * np.sqrt(0.5)]) * np.ones((30, 1))
    shapes = true + sd * rng.standard_normal(true.shape)
    agree = mac(shapes, true)
    assert 0.8 < agree[1, 1] < 0.92

    def compared(shape_sd: Any, own: Any = agree) -> Any:
        rows = [SimpleNamespace(a=i, mac=own[i, i]) for i in (0, 1)]
        measured = SimpleNamespace(name="hammer", shape_sd=shape_sd, modes=SimpleNamespace(shapes=shapes))
        comparison = SimpleNamespace(mac=own, table=SimpleNamespace(rows=rows))
        return SimpleNamespace(
            measured=measured, comparison=comparison, n_test=2, test=SimpleNamespace(freq=[10.0, 20.0])
        )

    (told,) = faint_shapes([compared(sd)])
    share = re.search(r"the deviation of the shape of mode 2 at 20 Hz is (\d+) % of it", told)
    assert share is not None
    assert int(share[1]) == pytest.approx(38, abs=4)
    assert f"a MAC of {agree[1, 1]:.2f} says little of the model" in told
    # known well, not known how well, and agreeing all the same
    assert faint_shapes([compared(0.2 * sd)]) == faint_shapes([compared(None)]) == []
    assert faint_shapes([compared(sd, np.eye(2))]) == []


def doubts(folder: Path) -> list[str]:
    study = load_study(folder)
    model, test = read_model(study.model_file), study.read_recordings()
    return doubts_found(model, test, pair_test(test, model), study.damping_ratio).texts


def test_a_study_is_silent_until_a_sensor_is_turned(tmp_path: Path) -> None:
    small_study.write_study(tmp_path, small_study.Truth(more=("CELAS2,901,3.+3,9,3",)))
    assert doubts(tmp_path) == []
    for name in ("low", "high"):
        functions = list(read_uff(tmp_path / f"{name}.uff").functions)
        functions[2] = replace(functions[2], y=-functions[2].y)
        write_uff(tmp_path / f"{name}.uff", functions)
    (told,) = doubts(tmp_path)
    assert told.startswith("recording 'low': the sensor 7:+Z looks reversed")
    assert told.endswith("(so in 'high')")


def test_exchanged_channels_of_a_study_are_told_and_nothing_else(tmp_path: Path) -> None:
    small_study.write_study(tmp_path, small_study.Truth(more=("CELAS2,901,3.+3,9,3",)))
    for name in ("low", "high"):
        functions = list(read_uff(tmp_path / f"{name}.uff").functions)
        a, b = functions[1], functions[3]
        functions[1], functions[3] = replace(a, y=b.y), replace(b, y=a.y)
        write_uff(tmp_path / f"{name}.uff", functions)
    (told,) = doubts(tmp_path)
    assert told.startswith("recording 'low': the sensors ")
    assert "look exchanged" in told
    assert all(f"{small_study.SENSORS[i - 1]}:+Z" in told for i in (1, 3)), told


def test_a_body_that_is_free_in_some_ways_and_a_record_too_short_are_told(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(small_study.deck(held="123"))
    n = 120
    y = np.random.default_rng(2).standard_normal((4, n))
    data = small_study.recording("low", small_study.force(2.0, 1, n), y)
    write_uff(tmp_path / "low.uff", functions_of(data))
    (tmp_path / "study.toml").write_text(small_study.study_text({"low": "fit"}))
    told = doubts(tmp_path)
    assert told[0].startswith("the model moves freely in 1 way (1 mode of 0 Hz, of the 6 of a free body)")


def test_a_deck_without_densities_is_told_and_one_with_a_node_without_mass_not(tmp_path: Path) -> None:
    small_study.write_study(tmp_path, small_study.Truth())
    deck = tmp_path / "model.bdf"
    text = deck.read_text()
    deck.write_text(text.replace(",2700.", ",0.", 1))
    assert not any("carry no mass" in said for said in doubts(tmp_path))
    deck.write_text(text.replace(",2700.", ",0."))
    assert any(said.startswith("11 of the 12 nodes that move carry no mass") for said in doubts(tmp_path))


def test_what_was_doubtful_is_told_beside_an_error_of_the_diagnosis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ModelError("matrix is not positive definite")

    monkeypatch.setattr("femend.study.run.diagnose_records", fail)
    small_study.write_study(tmp_path, small_study.Truth())
    (tmp_path / "model.bdf").write_text((tmp_path / "model.bdf").read_text().replace(",2700.", ",2.7-9"))
    done = CliRunner().invoke(main, ["diagnose", str(tmp_path), "--out", str(tmp_path / "out"), "--quiet"])
    assert done.exit_code == 2
    assert done.stderr.startswith("error: matrix is not positive definite\nnote: in the units 'SI' no material")
    assert not (tmp_path / "out").exists()


def test_supports_that_nobody_selects_are_told_but_for_a_configuration_that_does(tmp_path: Path) -> None:
    small_study.write_study(tmp_path, small_study.Truth())
    (tmp_path / "model.bdf").write_text((tmp_path / "model.bdf").read_text().replace("SPC = 1\n", ""))
    deck = _core.Deck.read(str(tmp_path / "model.bdf"))
    (told,) = deck_warnings(load_study(tmp_path), deck)
    assert told.startswith("the deck has 2 SPC cards, but its case control selects no set")
    text = (tmp_path / "study.toml").read_text().replace('role = "fit"', 'role = "fit"\nconfiguration = "held"')
    (tmp_path / "study.toml").write_text(text + '[[configuration]]\nname = "held"\nspc = 1\n')
    assert deck_warnings(load_study(tmp_path), deck) == []


def test_an_acceleration_that_does_not_swing_about_zero_is_told() -> None:
    y = np.random.default_rng(4).standard_normal((4, 512))
    data = small_study.recording("low", small_study.force(2.0, 1, 512), y + np.array([[0.0], [9.8], [0.1], [0.0]]))
    (told,) = with_warnings(Recording("low", data)).warnings
    assert told.startswith("recording 'low': channel acceleration 7:+Z has a mean of 9.")
    assert "an error of 0.99 in this channel" in told


def test_a_force_with_a_mean_from_its_beginning_on_is_told() -> None:
    u, y = small_study.force(2.0, 1, 512), np.random.default_rng(4).standard_normal((4, 512))
    (told,) = with_warnings(Recording("low", small_study.recording("low", u - 5.0, y))).warnings
    assert told.startswith("recording 'low': channel force 13:+Z has a mean of -4.999 N from its beginning on")
    # one that sets in is no preload
    for late in (5.0 * (np.arange(512) > 100), np.where(np.abs(np.arange(512) - 300) < 5, 50.0, 0.0)):
        assert with_warnings(Recording("low", small_study.recording("low", u + late, y))).warnings == ()


def test_a_sensor_where_the_model_stands_still_and_responses_of_no_force_are_told(tmp_path: Path) -> None:
    path = small_study.write_study(tmp_path, small_study.Truth())
    test = load_study(path).read_recordings()
    model = read_model(tmp_path / "model.bdf")

    def told(channel: int, dof: Dof, noise: float = 0.0) -> list[str]:
        (low,) = (r for r in test if r.name == "low")
        values = low.time.values.copy()
        if noise:
            values[1:] = noise * np.random.default_rng(1).standard_normal(values[1:].shape)
        channels = list(low.time.channels)
        channels[channel] = replace(channels[channel], dof=dof)
        one = Test((replace(low, data=TimeData("low", low.time.dt, values, tuple(channels))),))
        return doubts_found(model, one, pair_test(one, model), 0.01).texts

    assert told(4, Dof(13, 3)) == []
    (still,) = told(4, Dof(13, 2))
    assert still.startswith(
        "recording 'low': the sensor 13:+Y shows 100 % of what the one that moves most does, where no"
    )
    (still,) = told(0, Dof(1, 3))
    assert still.startswith("recording 'low': the force 1:+Z acts where no mode of the model moves")
    (unrelated,) = told(4, Dof(13, 3), 1e-3)
    assert "the responses hardly follow from the force; check the table of channels" in unrelated


def test_what_is_doubtful_is_said_before_the_work_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ModelError("too late")

    monkeypatch.setattr("femend.study.run.diagnose_records", fail)
    small_study.write_study(tmp_path, small_study.Truth())
    (tmp_path / "model.bdf").write_text((tmp_path / "model.bdf").read_text().replace(",2700.", ",2.7-9"))
    done = CliRunner().invoke(main, ["diagnose", str(tmp_path), "--out", str(tmp_path / "out")])
    assert "warning: in the units 'SI' no material" in done.stderr.partition("error: too late")[0]


def test_two_sensors_at_one_place_that_differ_are_told() -> None:
    dofs = [Dof(4, 3), Dof(7, 3), Dof(10, 3), Dof(7, 3, -1)]
    (doubt,) = twice_doubts(TEST, dofs)
    assert (doubt.kind, doubt.channel) == ("twice", "7:+Z")
    again = TEST[:, [0, 1, 2, 1]] * np.array([1, 1, 1, -1.05])[:, None]
    assert twice_doubts(again, dofs) == []


@pytest.mark.parametrize("power", [-2, -1, 1, 2])
def test_a_quantity_mistaken_for_another_is_told_as_such(power: int) -> None:
    """Receptances in place of accelerances were told as "no unit does that, but a model that hardly moves there"."""
    wrong = TEST * ((2j * np.pi * FREQ) ** power)[:, None, None]
    (doubt,) = level_doubts(wrong, MODEL, NAMES, None, FREQ)
    assert (doubt.kind, doubt.channel, doubt.factor) == ("level", "", None)
    assert ("over omega" in doubt.text) is (power < 0)
    assert ("omega²" in doubt.text) is (abs(power) == 2)
    assert "correct the quantity" in doubt.text
    # of one sensor alone
    one = TEST.copy()
    one[:, 1] = wrong[:, 1]
    (doubt,) = level_doubts(one, MODEL, NAMES, None, FREQ)
    assert (doubt.kind, doubt.channel) == ("sensor level", "7:+Z")
    assert "correct the quantity" in doubt.text


def test_no_quantity_is_mistaken_for_a_unit_or_a_model_that_is_off() -> None:
    assert level_doubts(TEST, MODEL, NAMES, None, FREQ) == []
    assert "m and mm" in level_doubts(1000.0 * TEST, MODEL, NAMES, None, FREQ)[0].text
    for modes in ((10.0, 40.0, 60.0), (8.0, 50.0, 90.0), (18.0, 25.0, 99.0)):
        assert not any("quantity" in d.text for d in level_doubts(frfs(modes), MODEL, NAMES, None, FREQ))
