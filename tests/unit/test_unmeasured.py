"""Forces nobody recorded: what those of several recordings have in common, and a harmonic one from end to end."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.loads import unmeasured
from femend.diagnose.loads.harmonic import ONSET, _waves
from femend.diagnose.loads.unmeasured import (
    NEARLY_ALL,
    _common,
    _from_outside,
    _mean_force,
    _nearly_all,
    _one_tone,
    plainly_unmeasured,
)
from femend.diagnose.locating.recovered import STANDS_OUT, _standing_out, _wiener
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

N, RECORDS = 2000, 3


def recovered(forces: list[NDArray[np.complex128]], index: list[NDArray[np.int64]]) -> Any:
    """Forces against the motion on the lines `index` of every record, seen alike on all of them."""
    record = SimpleNamespace(n=N, dt=1 / 500, frf=None)
    return cast(
        Any,
        SimpleNamespace(
            records=[record] * RECORDS,
            F=[-f[:, None] for f in forces],
            weight=[np.ones((len(f), 1)) for f in forces],
            index=index,
        ),
    )


def spectra(seed: int, n: int) -> NDArray[np.complex128]:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.standard_normal(n) + 1j * rng.standard_normal(n))


def test_the_same_force_is_found_in_all_recordings() -> None:
    index = np.arange(20, 420)
    same = spectra(0, 400)
    mean, alike, ratio = _mean_force(recovered([same] * RECORDS, [index] * RECORDS))
    np.testing.assert_allclose(alike, 1.0)
    np.testing.assert_allclose(ratio, 1.0)
    np.testing.assert_allclose(np.fft.rfft(mean)[index], same)


def test_frfs_have_no_force_in_common() -> None:
    """Of several hammer points there are several records, of as many lines each as there are frequencies."""
    given = recovered([spectra(0, 400)] * RECORDS, [np.arange(20, 420)] * RECORDS)
    assert _common(given)
    given.records[:] = [SimpleNamespace(n=N, dt=1 / 500, frf=object())] * RECORDS
    assert not _common(given)


@pytest.mark.filterwarnings("error")
def test_frfs_show_no_force_that_was_not_recorded() -> None:
    """Their forces are one on every line, which numpy has no correlation of."""
    record = SimpleNamespace(frf=object(), level=0.0, n=8, u=np.ones((1, 8)), y=np.ones((3, 8)))
    given = SimpleNamespace(
        split=SimpleNamespace(whole=SimpleNamespace(load=None, records=[record, record])),
        settings=SimpleNamespace(margin=40.0, consistent=1.25),
    )
    place = SimpleNamespace(place=SimpleNamespace(kind="ground", n_w=1), fit=SimpleNamespace(score=9.0), cost=1.0)
    assert not plainly_unmeasured(cast(Any, given), cast(Any, [place]))


@pytest.mark.parametrize(
    ("sizes", "lines", "noise", "tone"),
    [
        ((10.0, 10.2, 9.9), (200, 200, 200), 0.1, True),
        ((10.0, 30.0, 90.0), (200, 200, 200), 0.1, False),  # grows with the level, as what a motion makes
        ((10.0, 10.0, 10.0), (200, 230, 200), 0.1, False),
        ((10.0, 10.0, 10.0), (200, 200, 200), 1.0, False),
    ],
)
def test_a_tone_is_the_same_in_all_recordings_whatever_its_phase(
    sizes: tuple[float, ...], lines: tuple[int, ...], noise: float, tone: bool
) -> None:
    freq = np.arange(20, 420) / 4.0
    forces = [noise * spectra(i, 400) for i in range(RECORDS)]
    for i, (force, size, line) in enumerate(zip(forces, sizes, lines, strict=True)):
        force[line] += size * 4 * np.exp(2.0j * i)
    given = recovered(forces, [np.arange(20, 420)] * RECORDS)
    given.freq = [freq] * RECORDS
    assert _one_tone(given) is tone


def test_forces_of_their_own_have_nothing_in_common() -> None:
    index = np.arange(20, 420)
    own = [spectra(i, 400) for i in range(RECORDS)]
    _, alike, _ = _mean_force(recovered(own, [index] * RECORDS))
    assert max(alike) < 0.7


def test_lines_of_one_recording_alone_agree_with_nothing() -> None:
    """Of four hundred lines every recording keeps another third, and forty that are the same for all."""
    lines = np.arange(20, 420)
    common = lines[::10]
    index = [np.union1d(lines[i::RECORDS], common) for i in range(RECORDS)]
    own = [spectra(i, len(x)) for i, x in enumerate(index)]
    _, alike, _ = _mean_force(recovered(own, index))
    assert max(alike) < 0.7


@pytest.mark.parametrize(
    ("force", "outside"),
    [
        ("of its own in every recording", True),
        ("the same in all", True),
        ("friction", False),
        ("friction in the strongest alone", False),
        ("grows", False),
    ],
)
def test_a_force_from_outside_neither_grows_with_the_motion_nor_takes_from_it(force: str, outside: bool) -> None:
    rng, levels = np.random.default_rng(3), (1.5, 4.5, 10.0)
    motion = [level * rng.standard_normal((1, N)) for level in levels]
    own = [0.4 * rng.standard_normal((1, N)) for _ in levels]
    histories = {
        "of its own in every recording": own,
        "the same in all": [own[0]] * RECORDS,
        "friction": [0.4 * np.sign(v) for v in motion],
        "friction in the strongest alone": [*own[:2], 0.4 * np.sign(motion[2])],
        "grows": [level * f for level, f in zip(levels, own, strict=True)],
    }[force]
    index = np.arange(20, 420)
    shown = recovered([-np.fft.rfft(f[0])[index] for f in histories], [index] * RECORDS)
    shown.f, shown.v = histories, motion
    forces = [level * rng.standard_normal((1, N)) for level in levels]
    records = [SimpleNamespace(u=u, frf=None, level=u.std()) for u in forces]
    assert _from_outside(cast(Any, SimpleNamespace(records=records)), shown) is outside


def test_a_force_is_held_to_the_power_expected_of_it_as_far_as_the_sensors_leave_it_open() -> None:
    gram, force = np.full((3, 1, 1), 0.5 + 0j), np.array([[4.0 + 0j], [4.0], [4.0]])
    shown = gram[:, :, 0] * force
    found = _wiener(gram, shown, np.array([[1e12], [2.0], [1e-12]]))
    np.testing.assert_allclose(found, [[4.0], [2.0], [0.0]], atol=1e-9)
    # a line that stands out is seen as what it is once it is not held to its neighbours
    first = np.abs(_wiener(gram * 0.1, shown * 0.1, np.full((3, 1), 0.5))) ** 2
    assert (first < STANDS_OUT * 0.5).all()


def test_a_line_that_shows_far_more_than_noise_is_not_held_to_its_neighbours() -> None:
    """A prior far below what the sensors can see would leave next to nothing of a strong line."""
    gram, force = 1e-4, 3e4
    shown = np.full((40, 1), 1e-2, dtype=np.complex128)
    shown[17] = gram * force
    every = np.full((40, 1, 1), gram, dtype=np.complex128)
    spread = np.full((40, 1), 1.0)
    raised = _standing_out(every, shown, spread)
    assert raised[17, 0] == pytest.approx(force**2, rel=1e-6)
    np.testing.assert_array_equal(np.delete(raised, 17), 1.0)
    assert abs(_wiener(every, shown, spread)[17, 0]) < 1e-3 * force
    assert abs(_wiener(every, shown, raised)[17, 0]) == pytest.approx(force, rel=1e-3)
    # as much as the prior allows for is nothing that stands out
    expected = np.full((40, 1), np.sqrt(2 * gram), dtype=np.complex128)
    np.testing.assert_array_equal(_standing_out(every, expected, np.full((40, 1), 1 / gram)), 1 / gram)


def test_an_onset_dies_away_within_its_periods() -> None:
    freq, dt, n = 20.0, 1e-3, 8000
    every = _waves(freq, n, dt, 2 + 2 * len(ONSET))
    np.testing.assert_array_equal(every[:, :2], _waves(freq, n, dt, 2))
    late = int(12 * max(ONSET) / (freq * dt))
    assert np.abs(every[late:, 2:]).max() < 1e-5
    # a force that grows to its amplitude within two periods is nearer to steady and dying parts than to steady ones
    t = dt * np.arange(n)
    force = np.sin(2 * np.pi * freq * t) * np.clip(freq * t / 2, 0, 1)

    def left(columns: int) -> float:
        A = _waves(freq, n, dt, columns)
        return float(np.linalg.norm(force - A @ np.linalg.lstsq(A, force, rcond=None)[0]))

    assert left(every.shape[1]) < 0.2 * left(2)


@pytest.mark.parametrize(("left", "taken"), [(4.0, True), (20.0, False)])
def test_a_force_far_above_the_noise_may_leave_more_than_noise(left: float, taken: bool) -> None:
    def fit(score: float) -> Any:
        return cast(Any, SimpleNamespace(score=score))

    assert NEARLY_ALL < 1
    assert _nearly_all(fit(74.0), fit(left)) is taken
    assert not _nearly_all(None, fit(left))


def test_a_harmonic_force_is_tried_where_the_ground_explains_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion of the ground is free on every line, a harmonic force has three unknowns for all of them."""
    located = [SimpleNamespace(place=SimpleNamespace(kind=kind)) for kind in ("base", "pair", "ground", "ground")]
    monkeypatch.setattr(unmeasured, "_shown", lambda _, among: [(one, None) for one in among])
    monkeypatch.setattr(unmeasured, "_best_sine", lambda _, shown, __: [one.place.kind for one, _ in shown])
    given = SimpleNamespace(
        split=SimpleNamespace(whole=SimpleNamespace(load=None, records=[SimpleNamespace(frf=None)])), updated=None
    )
    assert unmeasured.find_unmeasured(cast(Any, given), cast(Any, located)) == ["ground", "ground"]
    everywhere = located[2:] + located[:2]
    assert unmeasured.find_unmeasured(cast(Any, given), cast(Any, everywhere)) == [o.place.kind for o in everywhere]


@pytest.mark.parametrize("freq", [61.3, 96.0])
def test_a_harmonic_force_that_begins_later_is_found(tmp_path: Path, freq: float) -> None:
    study = small_study.write_study(tmp_path, small_study.Truth((7.3e10, 6.8e10), sine=(8, freq, 0.6)))
    diagnose(study, tmp_path / "out")
    result = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "missing-physics"
    (finding,) = result["findings"]
    assert finding["physics"] == "unmeasured_force"
    assert finding["location"]["direction"] == "Z"
    told = {node for place in finding["location"].get("ambiguous", []) for node in place.get("nodes", place)}
    assert {7, 8, 9} & {*finding["location"]["nodes"], *told}
    assert finding["parameters"]["frequency"]["value"] == pytest.approx(freq, abs=0.3)
    assert finding["parameters"]["amplitude"]["value"] == pytest.approx(0.6, rel=0.15)
    low = next(row for row in result["fit"] if row["recording"] == "low")
    assert low["final"] < 0.8 * low["parameters"]
    assert low["final"] < 0.03
