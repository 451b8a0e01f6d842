"""One sentence for one fault of many channels, and for what is told of many recordings alike."""

from __future__ import annotations

import json
import pickle

import numpy as np

from femend.data import Channel, Recording, Remark, TimeData
from femend.dof import Dof
from femend.study.doubts.gathered import gathered
from femend.study.file.channels_sound import with_warnings


def record(name: str, scale: dict[int, float], offset: float = 0.0) -> Recording:
    """Noise at six sensors, some of which hear a share of it."""
    rng = np.random.default_rng(len(name))
    values = rng.standard_normal((6, 2000)) + offset
    for row, share in scale.items():
        values[row] *= share
    channels = tuple(Channel(Dof(n, 3), "acceleration", "m/s^2", f"s{n}") for n in range(1, 7))
    return with_warnings(Recording(name, TimeData(name, 0.01, values, channels), excitation="ambient"))


def test_a_sensor_that_shows_nothing_is_told_once() -> None:
    """Two of them in four recordings were eight lines."""
    records = [record(name, {4: 1e-9 * (k + 1), 5: 3e-9}) for k, name in enumerate(("low", "mid", "high", "val"))]
    alone = [w for r in records for w in r.warnings]
    assert len(alone) == 8
    (told,) = gathered((r.name, w) for r in records for w in r.warnings)
    assert told.startswith("recording 'low': channel acceleration 5:+Z (s5) has an rms of ")
    assert told.endswith(
        "; the same of acceleration 6:+Z in 'low' and of acceleration 5:+Z, acceleration 6:+Z in 'mid', 'high', 'val'"
    )


def test_offsets_of_all_channels_are_one_sentence() -> None:
    found = record("dc", {}, offset=2.0).warnings
    assert len(found) == 6
    (told,) = gathered(("dc", w) for w in found)
    assert told.startswith("recording 'dc': channel acceleration 1:+Z (s1) has a mean of ")
    assert told.endswith(f"; the same of {', '.join(f'acceleration {n}:+Z' for n in range(2, 7))} in 'dc'")


def test_other_faults_and_other_sentences_stay_as_they_are() -> None:
    one = record("dc", {5: 1e-9}, offset=2.0)
    kinds = gathered(("dc", w) for w in one.warnings)
    assert len(kinds) == 2
    assert any("has an rms" in text for text in kinds)
    apart = [
        Remark("a", "holds 0 N on 30 samples (from 1 to 2 s)", "x (1)", "held in N"),
        "recording 'a': mode 1 at 12.3 Hz does not count: it has no mate",
        "recording 'a': mode 2 at 15.3 Hz does not count: it has no mate",
        "the deck has no unit",
        Remark("a", "holds a line of 50 Hz with 1 N rms", "y (2)", "hum in N"),
    ]
    assert gathered(("a", text) for text in apart) == apart


def test_stretches_of_one_channel_are_counted() -> None:
    held = [Remark("a", f"holds {k} N on 3{k} samples (from {k} to 2 s)", "x (1)", "held in N") for k in range(4)]
    assert gathered(("a", text) for text in held) == [f"{held[0]}; the same of x (3 times) in 'a'"]


def test_what_is_told_of_several_recordings_is_one_sentence() -> None:
    told = [(n, f"recording {n!r}: 1 blow in it") for n in ("a", "b, c", "it's")] + [("b", "the deck has no unit")]
    assert gathered(told) == ["recordings 'a', 'b, c', \"it's\": 1 blow in it", "the deck has no unit"]


def test_a_channel_may_be_called_anything() -> None:
    """Sentences were taken apart again: a label that holds the words of a fault was cut there."""
    told = [Remark("a", f"has an rms of {k}e-9", f"acceleration 5:+Z (has a {k})", "weak") for k in (1, 2)]
    assert gathered(("a", t) for t in told) == [f"{told[0]}; the same of acceleration 5:+Z in 'a'"]


def test_a_remark_stays_one_when_it_is_sent_elsewhere() -> None:
    one = Remark("a", "has an rms of 1e-9", "5:+Z", "weak")
    again = pickle.loads(pickle.dumps(one))
    assert (again, again.channel, again.fault, again.said) == (one, "5:+Z", "weak", "has an rms of 1e-9")
    assert json.dumps(one) == json.dumps(str(one))
