#!/usr/bin/env python3
"""How many recordings of generated sets are said to hum, as they are and with hum on one sensor:  hum.py SET [SET ...]

Seeds below 100 may set thresholds; the figures in `python/docs/recordings.md` are of others.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from femend.data import Recording, TimeData
from femend.study import load_study
from femend.study.file.channels_sound import with_warnings

# mains frequency a little off, and rms of the hum in that of its sensor
FREQ, LEVEL = 50.02, 0.1


def told(recording: Recording) -> bool:
    """Whether a recording is said to hum."""
    return any("hum of the mains" in w for w in with_warnings(recording).warnings)


def humming(recording: Recording, rng: np.random.Generator) -> Recording:
    """The recording with hum on one of its responses."""
    data = recording.time
    row = int(rng.choice([i for i in range(len(data.channels)) if i not in data.rows("force")]))
    t, values = data.dt * np.arange(data.values.shape[1]), data.values.copy()
    values[row] += np.sqrt(2) * LEVEL * values[row].std() * np.sin(2 * np.pi * FREQ * t + rng.uniform(0, 2 * np.pi))
    return replace(recording, data=TimeData(data.name, data.dt, values, data.channels, data.t0))


def main() -> None:
    """Print both counts."""
    rng, count, as_they_are, with_hum = np.random.default_rng(0), 0, 0, 0
    for study_file in sorted(p for folder in sys.argv[1:] for p in Path(folder).glob("b*/public/study.toml")):
        study = load_study(study_file)
        for one in study.recordings:
            if one.role == "predict" or one.excitation != "measured":
                continue
            recording = one.read(study.units)
            if not recording.is_time:
                continue
            count += 1
            as_they_are += told(recording)
            with_hum += told(humming(recording, rng))
    print(f"{count} recordings: {as_they_are} said to hum as they are, {with_hum} with {100 * LEVEL:g} % of hum")


if __name__ == "__main__":
    main()
