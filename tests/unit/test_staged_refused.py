"""What a study in stages cannot fit is left out or refused in a sentence, and a picture never ends it."""

from __future__ import annotations

import logging
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.data import Recording, Rotating, Test
from femend.diagnose.staged import staged_data
from femend.diagnose.staged.loads import FEWEST_LINES, ods_lines_of
from femend.diagnose.staged.prepare import RunData, run_data
from femend.diagnose.staged.select import Rival, Round
from femend.diagnose.staged.settings import StagedSettings
from femend.diagnose.staged.words import _decisions, remark_on_run
from femend.errors import RecordingError
from femend.estimate.joint import ModesBlock
from femend.report.plots import paper_style
from femend.study.staged import content as staged_content
from femend.study.staged import pictures as staged_pictures
from femend.study.staged.content import _pictures
from femend.study.staged.doubts import runs_left
from femend.study.staged.result import _verdict

RATE = 256.0


def run(low: float, high: float, seconds: float = 40.0, name: str = "run") -> Recording:
    """A shaft from `low` to `high` rev/s, one pulse to a turn, whose order 1 a sensor shows."""
    t = np.arange(int(RATE * seconds)) / RATE
    turns = low * t + 0.5 * (high - low) / seconds * t**2
    speed = low + (high - low) / seconds * t
    values = [np.where(turns % 1 < 0.2, 5.0, 0.0), speed**2 * np.cos(2 * np.pi * turns)]
    channels = [Channel(None, "tacho", "V", "tacho"), Channel(Dof(1, 2), "acceleration", "m/s^2", "a")]
    rotating = Rotating("tacho", (7,), "X", 1)
    return Recording(name, TimeData(name, 1 / RATE, values, channels), excitation="rotating", rotating=rotating)


def test_held_speeds_are_left_out_in_one_sentence() -> None:
    data = staged_data(Test(tuple(run(f, f, name=f"h{f:g}") for f in (8.0, 12.0, 20.0))))
    assert data.configurations == ()
    (said,) = data.left_out
    assert said.startswith("recordings 'h8', 'h12', 'h20': the speed is held, at 8 to 20 rev/s")
    assert "at least, so that they are left out; record a run-up" in said
    assert said in data.warnings


def test_one_held_speed_may_be_another_channel() -> None:
    (said,) = staged_data(Test((run(12.0, 12.0),))).left_out
    assert said.startswith("recording 'run': the speed is held, at 12 rev/s")
    assert "so that it is left out; if it did run up, check that channel tacho (tacho) holds the tacho;" in said


def test_a_run_through_few_speeds_is_left_out_and_a_wide_one_is_not() -> None:
    data = staged_data(Test((run(10.0, 12.5, name="narrow"), run(5.0, 20.0, name="wide"))))
    assert [r.name for runs in data.runs.values() for r in runs] == ["wide"]
    (said,) = data.left_out
    assert said.startswith("recording 'narrow': 40.01 s from ")
    assert "at least 12); record a longer run over more speeds" in said
    assert "It is left out; if it did go through more speeds, check that channel " in said
    assert said.endswith(" holds the tacho, and the time axis")


def test_a_run_through_few_speeds_has_closer_lines() -> None:
    """From 10 to 13.5 rev/s there are 5 lines a hundredth of the speed apart: as many as are needed lie closer."""
    lines = ods_lines_of(run_data(run(10.0, 13.5)))
    assert FEWEST_LINES <= len(lines) <= FEWEST_LINES + 1
    wide: RunData = run_data(run(5.0, 20.0))
    assert np.diff(ods_lines_of(wide)) == pytest.approx(0.01 * wide.rev_per_s.max())


def test_modes_far_below_the_models_are_refused() -> None:
    """The model has no mode in its basis, as for frequencies a thousand times too low."""
    nothing = np.zeros((0,), dtype=complex)
    model: Any = SimpleNamespace(damped_modes=lambda p: (nothing, np.zeros((3, 0), dtype=complex)))
    one = np.ones((2, 1))
    block = ModesBlock("runup", model, np.array([-1e-3 + 0.11j]), one + 0j, one[0], one[0], one, np.ones((2, 3)))
    with pytest.raises(RecordingError, match=r"'runup': its 1 modes are at 0.01751 to 0.01751 Hz.*time \[ms\]"):
        block.pairs(np.zeros(0))


def rivals(plain: bool) -> Round:
    posterior: Any = None
    term: Any = SimpleNamespace()
    rows = [Rival("layer", "compliant_support", term, posterior, -10.0)]
    if plain:
        rows.append(Rival("nothing", "", None, posterior, -14.0))
    return Round(tuple(rows), None, 1.0, 1.0)


@pytest.mark.parametrize(
    ("decision", "said"),
    [
        (rivals(True), "nothing added: the best rival is layer (ln evidence +4)"),
        (rivals(False), "nothing added: the best rival is layer"),
    ],
)
def test_the_evidence_of_a_rival_is_never_no_number(decision: Round, said: str) -> None:
    assert _decisions([decision]) == (said,)


def test_a_picture_that_cannot_be_drawn_is_left_out_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(run: Any) -> None:
        raise ValueError("noverlap must be less than nperseg.")

    monkeypatch.setattr(staged_pictures, "PICTURES", {"waterfall": ("Run-up (Campbell): recorded", broken)})
    finished: Any = SimpleNamespace(result={"warnings": ["before"]})
    assert _pictures(finished) == ()
    (before, said) = finished.result["warnings"]
    assert before == "before"
    assert said == (
        'the picture "Run-up (Campbell)" could not be drawn and is left out of the report (ValueError: noverlap must '
        "be less than nperseg.); nothing else depends on it"
    )
    assert staged_content.not_drawn is staged_pictures.not_drawn


@pytest.mark.parametrize(("samples", "drawn"), [(120, True), (40, False), (4000, True)])
def test_the_picture_of_a_short_run(samples: int, drawn: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    data = run_data(run(5.0, 20.0))
    short = replace(data, y=data.y[:, :samples], rev_per_s=data.rev_per_s[:samples])
    result = SimpleNamespace(data=short, predicted=short.y)
    finished: Any = SimpleNamespace(final=SimpleNamespace(runs=[("as modelled", result)]))
    monkeypatch.setattr(staged_pictures, "_shapes", lambda run, name: (None, np.array([60j]), None))
    assert (staged_pictures.campbell(finished) is not None) == drawn


def test_missing_fonts_are_no_matter(caplog: pytest.LogCaptureFixture) -> None:
    with paper_style():
        logging.getLogger("matplotlib.font_manager").warning("findfont: Font family 'x' not found.")
    assert caplog.text == ""


def staged(unexplained: float, noise: float) -> Any:
    """What is left of a study with one run, after its modes were read off it."""
    return SimpleNamespace(
        stages=[
            SimpleNamespace(name="output-only modes", recordings=("runup",), run=None, configuration="as modelled"),
            SimpleNamespace(
                recordings=("runup",), run=1, configuration="as modelled", unexplained=unexplained, noise=noise
            ),
        ],
        unseen=(),
        beside="",
        runs=(),
    )


def told_of(flow: Any, *, warnings: tuple[str, ...] = (), modes: tuple[str, ...] = ("runup",)) -> tuple[str, str]:
    data: Any = SimpleNamespace(
        runs={"as modelled": [SimpleNamespace(name="runup")]},
        output_only={"as modelled": [SimpleNamespace(name=name) for name in modes]},
        warnings=warnings,
    )
    setup: Any = None
    return _verdict(setup, data, flow, [])


def test_what_a_run_leaves_beyond_its_noise_and_the_form_of_the_model_is_told() -> None:
    said = runs_left(staged(0.13, 0.012), StagedSettings())
    assert said.startswith("13 % of runup stays unexplained, 4 times what its noise (1.2 %)")
    assert runs_left(staged(0.07, 0.012), StagedSettings()) == ""
    assert runs_left(staged(0.13, 0.1), StagedSettings()) == ""


def test_ambient_vibration_is_asked_for_where_there_is_none() -> None:
    verdict, advice = told_of(staged(0.81, 0.01))
    assert verdict == "undetermined"
    assert advice.startswith("81 % of runup stays unexplained: check pulses_per_revolution, axis and nodes of its")
    assert advice.endswith("if they are right, record some minutes of ambient vibration in the same configuration")


def test_ambient_vibration_that_is_there_is_not_asked_for() -> None:
    advice = told_of(staged(0.81, 0.01), modes=("ambient",))[1]
    assert advice.startswith("81 % of runup stays unexplained, though ambient vibration was recorded: check pulses_per")
    assert "record" not in advice.replace("recorded", "").replace("[recording.", "")


def test_a_wrong_number_of_pulses_is_corrected_first() -> None:
    said = "recording 'runup': its channels hold ... is pulses_per_revolution = 1 instead of 2?"
    advice = told_of(staged(1.0, 0.01), warnings=(said,))[1]
    assert advice.endswith("first correct pulses_per_revolution of its [recording.rotating] (see the warnings) and run "
                           "again")  # fmt: skip


def test_a_run_of_noise_alone_is_not_consistent() -> None:
    verdict, advice = told_of(staged(0.99, 0.95))
    assert verdict == "undetermined"
    assert advice.startswith("95 % of runup is no response to the speeds it goes through")


@pytest.mark.parametrize(
    ("exponent", "said"),
    [
        ((float("nan"),) * 2, "to a power that is not told; reliable on 0 of"),
        ((2.04, 0.1), "to the power 2.04 +- 0.10;"),
    ],
)
def test_a_power_of_the_speed_is_never_no_number(exponent: tuple[float, float], said: str) -> None:
    nothing = np.zeros(0)
    result: Any = SimpleNamespace(
        exponent=exponent, unbalances=lambda: (nothing, nothing), correlation=(0.1, "E"), onset=None, error=0.9,
        after=SimpleNamespace(freq=np.arange(8.0), reliable=np.zeros(8, dtype=bool)), choice=None, laws=None,
        data=SimpleNamespace(power=(2.0, 1.0)), unbalance=SimpleNamespace(nodes=()),
    )  # fmt: skip
    text = remark_on_run(result)
    assert said in text[0]
    assert "nan" not in " ".join(text)
