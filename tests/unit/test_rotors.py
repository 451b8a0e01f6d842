"""Rotors that a deck declares: cards of MSC and Siemens, senses and speeds, what is wrong with them, and what turns."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy.sparse import csc_array

from femend import _core, complex_frf
from femend.analysis.model_modes import model_modes
from femend.analysis.turning_modal_frf import modal_gyroscopic, turning_modal_frf
from femend.cli import main
from femend.dof import Dof
from femend.model import read_model
from femend.model.terms.configured import ALPHA, BETA, configure
from femend.model.terms.rotors import Rotors, deck_rotors
from femend.model.terms.spinning import gyroscopic
from femend.model.terms.unknowns import Unknown, Unknowns

sys.path.insert(0, str(Path(__file__).parents[1]))
from operating_models import channels
from turning_models import PARAMETERS, SENSORS, rotor

SHAFT = (*range(1, 9), 40, 41)
ONE = "ROTORG,7,1,THRU,9\nRSPINR,7,1,9,RPM,1.\n"


def deck(folder: Path, cards: str, control: str = "") -> Path:
    """The overhung rotor with more `cards`, and more case `control`."""
    rotor(folder)
    path = folder / "rotor.bdf"
    text = path.read_text().replace("ENDDATA", f"{cards}ENDDATA")
    path.write_text(text.replace("SPC = 1", f"SPC = 1\n{control}"))
    return path


def read(folder: Path, cards: str, control: str = "") -> Rotors:
    return deck_rotors(_core.Deck.read(str(deck(folder, cards, control))))


def test_a_line_of_grids_turns_with_its_beams_and_masses(tmp_path: Path) -> None:
    found = read(tmp_path, ONE)
    assert not found.warnings
    (one,) = found.rotors
    assert (one.number, one.axis, one.ratio, one.elements) == (7, (1.0, 0.0, 0.0), 1.0, SHAFT)
    (along,), (against,) = found.parts((2.0, 0.0, 0.0)), found.parts((-1.0, 0.0, 0.0))
    assert (along.axis, along.elements, along.ratio, against.ratio) == (one.axis, SHAFT, 1.0, -1.0)
    assert found.parts() == (along,)
    assert found.parts((0.0, 1.0, 0.0)) == ()
    backward = read(tmp_path, ONE.replace("1,9,RPM", "9,1,RPM"))
    assert backward.rotors[0].axis == (-1.0, 0.0, 0.0)


def test_grids_are_listed_or_counted_in_steps(tmp_path: Path) -> None:
    # of two grids with one between them no beam is left, of the disc's end its masses are
    found = read(tmp_path, "ROTORG,7,7,THRU,9,BY,2\nRSPINR,7,7,9,FREQ,2.\n")
    assert found.rotors[0].elements == (40, 41)
    assert read(tmp_path, "ROTORG,7,1,2,3,4,5,6,7\n,8,9\nRSPINR,7,1,9,FREQ,2.\n").rotors[0].elements == SHAFT


def test_speeds_are_those_of_the_reference_rotor(tmp_path: Path) -> None:
    two = "ROTORG,1,1,THRU,4\nROTORG,2,6,THRU,9\nRSPINR,1,1,4,RPM,11\nRSPINR,2,9,6,FREQ,12\n"
    tables = "DDVAL,11,600.,1200.,1800.\nDDVAL,12,25.,50.,75.\n"
    found = read(tmp_path, f"{two}{tables}RGYRO,5,ASYNC,1,RPM,,,900.\n")
    assert not found.warnings
    assert [(r.number, r.ratio) for r in found.rotors] == [(1, 1.0), (2, pytest.approx(2.5))]
    # the second turns against the first, whose speed is counted about -X here
    assert [p.ratio for p in found.parts((-1.0, 0.0, 0.0))] == [-1.0, pytest.approx(-2.5)]
    assert found.rotors[1].axis == (-1.0, 0.0, 0.0)
    other = read(tmp_path, f"{two}{tables}RGYRO,4,ASYNC,1,RPM\nRGYRO,5,ASYNC,2,RPM\n", "RGYRO = 5")
    assert [(r.number, r.ratio) for r in other.rotors] == [(2, 1.0), (1, pytest.approx(0.4))]
    counted = read(tmp_path, f"{two}DDVAL,11,600.,THRU,1800.,BY,600.\nDDVAL,12,25.,50.,75.\nRGYRO,5,ASYNC,1,RPM\n")
    assert counted.rotors[1].ratio == pytest.approx(2.5)
    bent = read(tmp_path, f"{two}DDVAL,11,600.,1200.,1800.\nDDVAL,12,25.,50.,90.\nRGYRO,5,ASYNC,1,RPM\n")
    assert "rotor 2: its speeds are not in proportion to those of rotor 1" in bent.warnings[0]


def test_rotors_of_siemens(tmp_path: Path) -> None:
    cards = (
        "CORD2R,3,,0.,0.,0.,-1.,0.,0.,\n,0.,1.,0.\nROTORG,1,1,THRU,4\nROTORG,2,6,THRU,9\n"
        "ROTORD,9,0.,100.,10,FIX,-1.,RPM,HZ\n,NO,1.-6,1,1\n,1,1,1.,3,0.,0.,1\n,2,2,-3.,3,0.,0.,1\n"
    )
    found = read(tmp_path, cards, "RMETHOD = 9")
    assert not found.warnings
    assert [(r.number, r.axis, r.ratio) for r in found.rotors] == [
        (1, (-1.0, 0.0, 0.0), 1.0),
        (2, (-1.0, 0.0, 0.0), -3.0),
    ]
    assert [p.ratio for p in found.parts((1.0, 0.0, 0.0))] == [-1.0, 3.0]
    assert "nothing turns" in read(tmp_path, cards, "RMETHOD = 8").warnings[0]


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        ("ROTORG,7,1,THRU,9\n", "no card tells the sense in which it turns (RSPINR, ROTORD); from grid 1 to 9"),
        ("ROTORG,7,1,77\nRSPINR,7,1,9,RPM,1.\n", "names grids that are not there (77); it is taken at rest"),
        ("GRID,50,,0.4,0.3,0.\nROTORG,7,1,50,9\nRSPINR,7,1,9,RPM,1.\n", "grid 50 is 0.2 off; it is taken at rest"),
        ("GRID,51,,0.,0.,0.\nROTORG,7,1,THRU,9\nRSPINR,7,1,51,RPM,1.\n", "lie at one place; it is taken at rest"),
        ("ROTORG,7,1,4\nRSPINR,7,1,4,RPM,1.\n", "no beam and no concentrated mass stands on the 2 grids of rotor 7"),
        ("GRID,50,,0.,0.3,0.\nROTORG,7,1,THRU,9\nRSPINR,7,1,50,RPM,1.\n", "given 90° from the line of its grids"),
        ("ROTORG,7,9\n", "one place has no direction, and no card says one (RSPINR); it is taken at rest"),
        ("ROTORG,7,1,x\n", "ROTORG 7: '1 x' … is no list of grids, and is left out"),
        (
            "ROTORG,1,1,THRU,4\nROTORG,2,6,THRU,9\nRSPINR,1,1,4,RPM,9.\nRSPINR,2,6,9,RPM,99\n",
            "rotor 2: its speed (RPM 99) is not read",
        ),
        (
            "ROTORG,1,1,THRU,4\nROTORG,2,6,THRU,9\nRSPINR,1,1,4,RPM,9.\nRSPINR,2,6,9,RPM,9.\n",
            "does not say which of the rotors 1, 2 is that of reference (RGYRO): speeds are those of rotor 1",
        ),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, cards: str, said: str) -> None:
    assert said in "\n".join(read(tmp_path, cards).warnings)


def run(path: Path, *args: str) -> Result:
    return CliRunner().invoke(main, ["modes", str(path), *args])


def test_modes_over_the_speed(tmp_path: Path) -> None:
    path = deck(tmp_path, ONE)
    done = run(path, "--rpm", "0,1500,3800", "--n", "4")
    assert done.exit_code == 0, done.output
    assert "rotor 7: 10 elements turn about (1, 0, 0)" in done.output
    rows = [line.split() for line in done.output.splitlines() if line.lstrip()[:1].isdigit()]
    hz = np.array([[float(c) for c in row[1:4]] for row in rows])
    np.testing.assert_allclose(hz[0::2, 0], hz[1::2, 0], rtol=1e-5)  # both planes alike at rest
    assert [row[4] for row in rows] == ["backward", "forward"] * 2
    assert (np.diff(hz[1::2]) > 0).all()
    assert (np.diff(hz[0::2]) < 0).all()
    assert "critical speeds of order 1 up to 3800 1/min: 1204 1/min (20.07 Hz, backward), 1319 1/min" in done.output


def test_modes_without_a_rotor_or_speeds(tmp_path: Path) -> None:
    path = deck(tmp_path, "")
    assert "nothing of the deck turns; a rotor is declared by ROTORG" in run(path, "--rpm", "1000").output
    assert "is no list of speeds in 1/min; write --rpm 0,1500,3000" in run(path, "--rpm", "fast").output
    assert "one of them is above 0" in run(path, "--rpm", "0").output


def test_frfs_in_modes_at_rest_are_those_of_complex_modes(tmp_path: Path) -> None:
    """Undamped bearings and 1 % in every mode against a light enough damping of the whole: away from resonances."""
    model = read_model(deck(tmp_path, ONE), parameters=PARAMETERS)
    parts = deck_rotors(model.deck).parts((1.0, 0.0, 0.0))
    still = {"c": 1e-9, "E": 1.1}
    modes = model_modes(model, n_modes=40, factors=still)
    freq = np.array([9.0, 15.0, 28.0, 60.0])
    G = modal_gyroscopic(model, modes, parts, still)
    for speed in (150.0, -350.0):
        H = turning_modal_frf(modes, G, freq, np.full(4, speed), SENSORS[:4], SENSORS[4:6])
        wanted = complex_frf(
            model,
            freq,
            channels(SENSORS[:4]),
            channels(SENSORS[4:6]),
            n_modes=30,
            speed=speed,
            parts=parts,
            factors=still,
        ).H
        np.testing.assert_allclose(H, wanted, atol=2e-3 * np.abs(wanted).max())
    with pytest.raises(ValueError, match="the modes have no DOF 99:"):
        turning_modal_frf(modes, G, freq, 1.0, [Dof(99, 2)], SENSORS[:1])


def test_a_small_model_turns_as_the_deck_does(tmp_path: Path) -> None:
    """At factors on the disc's inertia and the modulus, against the matrix of the whole model in the same basis."""
    model = read_model(deck(tmp_path, ONE), parameters=PARAMETERS[:3])
    parts = deck_rotors(model.deck).parts((1.0, 0.0, 0.0))
    unknowns = Unknowns.of(
        [*(Unknown(p.name, 1.0, sd=p.prior_sd) for p in PARAMETERS[:3]), Unknown(ALPHA, 0.1), Unknown(BETA, 1e-5)]
    )
    small = configure("run", model, unknowns, [], spc=None, f_max=100.0, g_rows=[model.row(SENSORS[0])], spinning=parts)
    assert small.spins
    p = unknowns.mean.copy()
    p[unknowns.index("J disc")], p[unknowns.index("E")] = np.log(1.4), np.log(0.9)
    factors = np.array([0.9, 1.4, 1.0])
    s, speed = 2j * np.pi * np.array([20.0, 40.0]), np.array([300.0, -200.0])
    found = small.turning_stiffness(p, s, speed)
    indptr, indices = model.fe.assemble()[:2]
    G = csc_array((gyroscopic(model, parts, factors), indices, indptr), shape=(model.fe.n_a,) * 2)
    T = model.transformation()
    V = np.linalg.lstsq(T.toarray(), small.V, rcond=None)[0]
    for k in range(2):
        np.testing.assert_allclose(found[k], s[k] * speed[k] * (V.T @ (G @ V)), atol=1e-8 * np.abs(found[k]).max())
    step = 1e-5
    for i, weight, matrix in small.turning_changes(p, s, speed):
        e = step * np.eye(len(p))[i]
        slope = (small.turning_stiffness(p + e, s, speed) - small.turning_stiffness(p - e, s, speed)) / (2 * step)
        np.testing.assert_allclose(slope, weight[:, None, None] * matrix, atol=1e-6 * np.abs(found).max())
