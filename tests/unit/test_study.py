"""The study file: the contract is read, and what breaks it is named by file and key."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, functions_of, load_study, write_uff
from femend.errors import RecordingError, StudyError

GOOD = """
format = "femend-study/1"
title  = "rig on its mounts"
[model]
file  = "model.bdf"
units = "mm-t-s"
[damping]
ratio = 0.02
[[parameter]]
name     = "E_columns"
property = "E"
material = 1
prior_sd = 0.2
bounds   = [0.5, 2.0]
[[parameter]]
name = "stubs"
property = "A"
elements = [3, 4]
[[configuration]]
name = "clamped"
spc  = 1
added_mass = [{ node = 12, m = 0.2 }]
note = "plate"
[[recording]]
name = "high"
file = "high.uff"
configuration = "clamped"
[[recording]]
name = "runup"
file = "run/up.csv"
role = "predict"
excitation = "rotating"
[recording.rotating]
tacho  = "tacho"
nodes  = [511, 512]
axis   = "X"
[[recording.channel]]
source    = 1
node      = 12
direction = "+Z"
quantity  = "acceleration"
unit      = "g"
[[recording.channel]]
source    = "tacho"
quantity  = "tacho"
unit      = "V"
"""


@pytest.fixture
def put(tmp_path: Path) -> Callable[[str], Path]:
    (tmp_path / "model.bdf").write_text("BEGIN BULK\nENDDATA\n")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "up.csv").write_text("time,a,tacho\n0,1,0\n0.5,2,5\n1.0,3,0\n")
    channels = (Channel(Dof(1, 1), "force", "N"), Channel(Dof(2, 1), "acceleration", "m/s^2"))
    write_uff(
        tmp_path / "high.uff", functions_of(TimeData("high", 0.01, np.tile(np.linspace(1.0, 2.0, 8), (2, 1)), channels))
    )

    def write(text: str) -> Path:
        path = tmp_path / "study.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_everything_of_the_contract_is_read(put: Callable[[str], Path]) -> None:
    path = put(GOOD)
    study = load_study(path)
    assert (study.title, study.units, study.damping_ratio) == ("rig on its mounts", "mm-t-s", 0.02)
    assert study.model_file == (path.parent / "model.bdf").resolve()
    first, second = study.parameters
    assert (first.name, first.property, first.target, first.ids) == ("E_columns", "E", "material", (1,))
    assert (first.prior_sd, first.bounds) == (0.2, (0.5, 2.0))
    assert (second.target, second.ids, second.prior_sd, second.bounds) == ("elements", (3, 4), 0.10, None)
    clamped = study.configuration("clamped")
    assert (clamped.spc, clamped.added_mass, clamped.note) == (1, ((12, 0.2),), "plate")
    assert study.configuration("as modelled").spc is None
    high, runup = study.recordings
    assert (high.role, high.excitation, high.configuration) == ("fit", "measured", "clamped")
    assert (runup.role, runup.configuration) == ("predict", "as modelled")
    assert runup.rotating is not None
    assert (runup.rotating.nodes, runup.rotating.pulses_per_revolution) == ((511, 512), 1.0)
    assert [str(c.dof) for c in runup.channels] == ["12:+Z", "None"]
    assert load_study(path.parent).recordings == study.recordings


def test_recordings_come_in_the_units_of_the_model(put: Callable[[str], Path]) -> None:
    test = load_study(put(GOOD)).read_recordings()
    assert test["high"].time.channels[1].unit == "mm/s^2"
    np.testing.assert_allclose(test["high"].time.values[:, 0], [1.0, 1000.0])
    np.testing.assert_allclose(test["runup"].time.values[0], 9806.65 * np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(test["runup"].tacho, [0.0, 5.0, 0.0])


def test_defaults(put: Callable[[str], Path]) -> None:
    text = 'format = "femend-study/1"\n[model]\nfile = "model.bdf"\n[[recording]]\nname = "a"\nfile = "high.uff"\n'
    study = load_study(put(text))
    assert (study.units, study.damping_ratio, study.parameters, study.configurations) == ("SI", 0.01, (), ())
    assert study.title == study.file.parent.name


def test_studies_of_the_cases(shared: Callable[[str], Path]) -> None:
    paths = sorted(shared("cases").glob("*/public/study.toml"))
    assert paths
    for path in paths:
        study = load_study(path)
        test = study.read_recordings()
        assert len(test) == len(study.recordings)
        assert test.sensors
    rig = load_study(shared("cases/rig/public")).read_recordings()
    assert rig["runup"].tacho is not None
    assert rig["ema_hammer"].frf.kind == "accelerance"
    assert rig["ema_hammer"].frf.H.shape == (961, 1, 24)


@pytest.mark.parametrize(
    ("old", "new", "key", "part"),
    [
        # unknown keys, with the nearest known one
        ("prior_sd = 0.2", "priorsd = 0.2", "parameter[0].priorsd", "did you mean 'prior_sd'?"),
        ('title  = "rig', 'titel  = "rig', "titel", "did you mean 'title'?"),
        ('tacho  = "tacho"', 'tachometer  = "tacho"', "recording[1].rotating.tachometer", "did you mean 'tacho'?"),
        ("m = 0.2", "mass = 0.2", "configuration[0].added_mass[0].mass", "known are node, m"),
        ("direction =", "dirrection =", "recording[1].channel[0].dirrection", "did you mean 'direction'?"),
        # types and missing keys
        ("material = 1", 'material = "12"', "parameter[0].material", "'12' is not a whole number; write it as 12"),
        ("material = 1", 'material = "steel"', "parameter[0].material", "'steel' is not a whole number; write it as 3"),
        ('property = "E"', "", "parameter[0]", "the key 'property' is missing; add it"),
        ("ratio = 0.02", 'ratio = "2 %"', "damping.ratio", "'2 %' is not a number; write it as 0.02, without quotes"),
        ("prior_sd = 0.2", 'prior_sd = "0,2"', "parameter[0].prior_sd", "'0,2' is not a number; write it as 0.2"),
        ("prior_sd = 0.2", 'prior_sd = "ten"', "parameter[0].prior_sd", "'ten' is not a number"),
        ('title  = "rig', 'title  = 3 # "rig', "title", '3 is not text; write it as "text", in quotes'),
        ("elements = [3, 4]", "elements = 3", "parameter[1].elements", "3 is not a list; write it as [1, 2]"),
        ("elements = [3, 4]", "elements = [3, true]", "parameter[1].elements[1]", "true is not a whole number"),
        # values
        ("femend-study/1", "femend-study/2", "format", "is not 'femend-study/1'"),
        ('"mm-t-s"', '"mm-kg-s"', "model.units", "did you mean 'mm-t-s'?"),
        ('"mm-t-s"', '"si"', "model.units", "did you mean 'SI'?"),
        ("ratio = 0.02", "ratio = 2.0", "damping.ratio", "2 is not between 0 and 1"),
        ("prior_sd = 0.2", "prior_sd = 0.0", "parameter[0].prior_sd", "0 is not positive"),
        ("prior_sd = 0.2", "prior_sd = -0.1", "parameter[0].prior_sd", "-0.1 is not positive"),
        ("prior_sd = 0.2", "prior_sd = nan", "parameter[0].prior_sd", "nan is not positive"),
        (
            'property = "A"\nelements = [3, 4]',
            'property = "E"\nmaterial = 1',
            "parameter[1]",
            "parameters 'E_columns' and 'stubs' are both a factor on E of material 1",
        ),
        ("[0.5, 2.0]", "[2.0, 0.5]", "parameter[0].bounds", "lower < upper"),
        ("[0.5, 2.0]", "[0.5]", "parameter[0].bounds", "lower < upper"),
        ("[0.5, 2.0]", "[1.5, 2.0]", "parameter[0].bounds", "leaves out the deck's own value"),
        ("material = 1", "material = 1\nmass = 3", "parameter[0]", "2 targets (material, mass)"),
        ("material = 1\n", "", "parameter[0]", "no target; give exactly one of"),
        ('property = "E"', 'property = "Rho"', "parameter[0].property", "did you mean 'rho'?"),
        (
            'property = "E"',
            'property = "k3"',
            "parameter[0].property",
            "no property of material, but of property_id; give",
        ),
        ("elements = [3, 4]", "elements = []", "parameter[1].elements", "is empty"),
        ('"stubs"', '"E_columns"', "parameter.name", "2 [[parameter]] are named 'E_columns'"),
        ('name = "runup"', 'name = "high"', "recording.name", "2 [[recording]] are named 'high'"),
        ('role = "predict"', 'role = "fitt"', "recording[1].role", "did you mean 'fit'?"),
        ('excitation = "rotating"', 'excitation = "rotor"', "recording[1].excitation", "none of measured, unknown"),
        ('excitation = "rotating"', 'excitation = "ambient"', "recording[1].rotating", "only excitation"),
        ('configuration = "clamped"', 'configuration = "clampt"', "recording[0].configuration", "'clamped'?"),
        ('axis   = "X"', 'axis   = "U"', "recording[1].rotating.axis", "none of X, Y, Z"),
        ("nodes  = [511, 512]", "nodes  = []", "recording[1].rotating.nodes", "no bearing node"),
        (
            'axis   = "X"',
            'axis   = "X"\npulses_per_revolution = 2.5',
            "recording[1].rotating.pulses_per_revolution",
            "2.5 is no whole number: a tacho on another shaft",
        ),
        ("m = 0.2", "m = -0.2", "configuration[0].added_mass[0].m", "not a positive mass"),
        ('"+Z"', '"Q"', "recording[1].channel[0].direction", "none of X Y Z"),
        ('unit      = "g"', 'unit      = "mm"', "recording[1].channel[0].unit", "does not measure acceleration"),
        ('unit      = "g"', 'unit      = "mm/s"', "recording[1].channel[0].unit", "does not measure acceleration"),
        ('unit      = "g"', 'unit      = "bananas"', "recording[1].channel[0].unit", "'bananas' is unknown"),
        ('"acceleration"', '"aceleration"', "recording[1].channel[0].quantity", "did you mean 'acceleration'?"),
        ("node      = 12\n", "", "recording[1].channel[0].node", "is missing"),
        ("source    = 1\n", "", "recording[1].channel[0].source", "is missing"),
        # files
        ('"model.bdf"', '"modell.bdf"', "model.file", "modell.bdf does not exist; did you mean 'model.bdf'?"),
        ('"high.uff"', '"hihg.uff"', "recording[0].file", "did you mean 'high.uff'?"),
        ('"high.uff"', '"run"', "recording[0].file", "is a folder, not a file"),
    ],
)
def test_broken_contract(put: Callable[[str], Path], old: str, new: str, key: str, part: str) -> None:
    assert old in GOOD
    path = put(GOOD.replace(old, new, 1))
    with pytest.raises(StudyError) as caught:
        load_study(path)
    assert caught.value.key == key
    assert str(path) in str(caught.value)
    assert part in str(caught.value)


def test_a_study_needs_something_to_fit(put: Callable[[str], Path]) -> None:
    head = 'format = "femend-study/1"\n[model]\nfile = "model.bdf"\n'
    with pytest.raises(StudyError, match=r"no \[\[recording\]\]; a diagnosis"):
        load_study(put(head))
    with pytest.raises(StudyError, match=r"no \[\[recording\]\] has role = \"fit\"; a diagnosis needs"):
        load_study(put(head + '[[recording]]\nname = "a"\nfile = "high.uff"\nrole = "validate"\n'))


def test_syntax_error_and_missing_file(put: Callable[[str], Path], tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"is not valid TOML: .*line 2"):
        load_study(put('format = "femend-study/1"\ntitle = rig\n'))
    (tmp_path / "latin.toml").write_bytes('title = "Träger"'.encode("latin-1"))
    with pytest.raises(StudyError, match="not UTF-8"):
        load_study(tmp_path / "latin.toml")
    with pytest.raises(FileNotFoundError, match=r"no study file .*gone\.toml"):
        load_study(tmp_path / "gone.toml")


def test_a_broken_recording_says_which_study_wanted_it(put: Callable[[str], Path], tmp_path: Path) -> None:
    study = load_study(put(GOOD))
    channels = (Channel(Dof(2, 1), "acceleration", "m/s^2"),)
    write_uff(tmp_path / "high.uff", functions_of(TimeData("high", 0.01, np.ones((1, 8)), channels)))
    with pytest.raises(RecordingError, match="none of its 1 channels is a force") as caught:
        study.read_recordings()
    assert any("[[recording]] 'high'" in note for note in caught.value.__notes__)
