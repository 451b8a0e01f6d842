"""A force that nobody recorded, in one recording and not in another, told by its few lines."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.loads.own_lines import on_own_lines
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import NOISE, Truth, write_study

N, DT = 4000, 1 / 500
FREQ = np.fft.rfftfreq(N, DT)
INDEX = np.arange(20, 1200)


def recovered(
    forces: list[NDArray[np.float64]], motion: NDArray[np.float64], u: NDArray[np.float64], best: float | None = None
) -> Any:
    """Forces (n,) beside a motion (n,) and a recorded force (n,), seen alike on all lines, or by far best about the
    frequency `best`, Hz, and before them a recording at half the level in which next to nothing acts."""
    weight = np.ones(len(INDEX)) if best is None else 1 / (1e-4 + (FREQ[INDEX] - best) ** 2)
    quiet = 1e-3 * random(2, 3, 140)
    forces = [quiet, *forces]
    records = [
        SimpleNamespace(u=u[None], n=N, dt=DT, frf=None, level=level) for level in (1.0, *[2.0] * (len(forces) - 1))
    ]
    return cast(
        Any,
        SimpleNamespace(
            records=records,
            f=[f[None] for f in forces],
            F=[np.fft.rfft(f)[INDEX, None] for f in forces],
            D=[np.fft.rfft(motion)[INDEX, None] for _ in forces],
            weight=[weight[:, None] for _ in forces],
            index=[INDEX for _ in forces],
            freq=[FREQ[INDEX] for _ in forces],
        ),
    )


def random(seed: int, f1: float, f2: float) -> NDArray[np.float64]:
    line = np.random.default_rng(seed).standard_normal((2, len(FREQ)))
    x = np.fft.irfft(np.where((f1 < FREQ) & (f2 > FREQ), line[0] + 1j * line[1], 0), N)
    return np.asarray(x / x.std())


T = DT * np.arange(N)
STEPS = np.sin(2 * np.pi * 9.7 * T) + 0.4 * np.sin(2 * np.pi * 19.4 * T + 1) + 0.2 * np.sin(2 * np.pi * 29.1 * T + 2)
BROAD, TONE = random(1, 3, 140), np.sin(2 * np.pi * 40.0 * T)


@pytest.mark.parametrize(
    ("forces", "motion", "u", "acting"),
    [
        ([STEPS], BROAD, BROAD, [1]),
        # a spring or a contact moves as the place does
        ([BROAD, BROAD**3], BROAD, BROAD, []),
        ([np.maximum(BROAD - 1.0, 0.0)], BROAD, BROAD, []),
        # where the place moves on few lines so does what a law makes of it
        ([STEPS], STEPS, BROAD, []),
        # a tone's third harmonic is a law's
        ([np.sin(2 * np.pi * 120.0 * T)], TONE, TONE, []),
        # one recording shows what is no force of a few lines
        ([STEPS, BROAD], BROAD, BROAD, []),
    ],
    ids=["steps", "cubic", "contact", "narrow motion", "harmonic of a tone", "both"],
)
def test_a_force_on_a_few_lines_on_which_the_place_hardly_moves_is_from_outside(
    forces: list[NDArray[np.float64]], motion: NDArray[np.float64], u: NDArray[np.float64], acting: list[int]
) -> None:
    assert on_own_lines(recovered(forces, motion, u)) == acting


def test_a_spring_that_the_sensors_see_at_a_resonance_alone_is_none() -> None:
    assert on_own_lines(recovered([BROAD], BROAD, BROAD, best=60.0)) == []
    assert on_own_lines(recovered([STEPS], BROAD, BROAD, best=9.7)) == []
    # a force that stands where the sensors see nothing else
    assert on_own_lines(recovered([STEPS], random(3, 30, 140), BROAD, best=9.7)) == [1]


def test_what_follows_the_recorded_force_is_an_oscillator() -> None:
    """At its resonance an absorber acts on a few lines, on which it keeps the place from moving."""
    given = recovered([STEPS], BROAD, BROAD)
    weaker = recovered([0.5 * STEPS], BROAD, BROAD)
    given.f[0], given.F[0] = weaker.f[1], weaker.F[1]
    assert on_own_lines(given) == []
    given.records[0].level = 0.1  # as strong at a tenth of the level: it comes from elsewhere
    assert on_own_lines(given) == [0, 1]


def test_a_machine_that_ran_in_one_recording_is_told(tmp_path: Path) -> None:
    quiet, running = tmp_path / "quiet", tmp_path / "running"
    write_study(quiet, Truth((7.3e10, 6.8e10)))
    study = write_study(running, Truth((7.3e10, 6.8e10), sine=(7, 71.0, 3.0)))
    shutil.copy(quiet / "low.uff", running / "low.uff")
    found = diagnose(study)
    assert isinstance(found, StudyRun)
    (finding,) = found.result["findings"]
    assert finding["physics"] == "unmeasured_force"
    assert finding["location"]["nodes"] == [7]
    assert finding["parameters"]["frequency"]["value"] == pytest.approx(71.0, abs=0.5)
    # the model is that of the recording without it
    assert found.result["parameters"]["E_root"]["factor"] == pytest.approx(7.3 / 7, rel=0.02)
    assert "acts in high, and does not show in low" in found.result["advice"]
    # nothing is read off where it does not act
    final = {row["recording"]: row["final"] for row in found.result["fit"]}
    assert final["low"] < 1.3 * NOISE
