#!/usr/bin/env python3
"""How near the modes of recorded forces come to the truth:  identified_modes.py CASES...

Of every recording to be fitted the modes in the truth's band are identified as `femend correlate` does, and from FRFs
averaged over eighths of the record. Prints, by excitation, how many of the truth's modes in the band are found within
4 % in frequency, the median error of their frequencies, and the median of their damping over the truth's.
"""

from __future__ import annotations

import argparse
import json
import pathlib
from dataclasses import replace
from typing import Any

import numpy as np

from femend.bench.reading.measured import measured_modes
from femend.data import IdentifiedModes
from femend.errors import FemendError
from femend.modal import identify_modes
from femend.progress import SilentProgress
from femend.signal import estimate_frf
from femend.study import load_study
from femend.study.file.study import Study

# relative distance of frequencies within which a mode is that of the truth
NEAR = 0.04


def of_eighths(study: Study) -> list[IdentifiedModes]:
    """Modes of the recordings from FRFs averaged over eighths."""
    found = []
    for recording in study.read_recordings():
        if recording.role == "fit":
            frf = estimate_frf(recording.time).frf
            found.append(identify_modes(frf, study.correlation.band).modes)
    return found


def as_correlated(study: Study) -> list[IdentifiedModes]:
    """Modes of the recordings as `femend correlate` has them."""
    return [one.modes for one in measured_modes(study, SilentProgress())[0]]


class Tally:
    """Modes of the truth that were found, of all, with errors of frequency and damping over the truth's."""

    def __init__(self) -> None:
        self.found, self.of = 0, 0
        self.freq: list[float] = []
        self.zeta: list[float] = []

    def add(self, modes: IdentifiedModes, truth: dict[str, Any]) -> None:
        low, high = truth["band"]
        for freq, zeta in zip(truth["modes"], truth["zeta"], strict=True):
            if not low < freq < high:
                continue
            self.of += 1
            k = int(np.argmin(np.abs(modes.freq - freq))) if modes.n_modes else -1
            if k >= 0 and abs(modes.freq[k] / freq - 1) < NEAR:
                self.found += 1
                self.freq.append(abs(float(modes.freq[k]) / freq - 1))
                self.zeta.append(float(modes.zeta[k]) / zeta)

    def __str__(self) -> str:
        errors = f"frequency {100 * np.median(self.freq):.3f} % off, damping {np.median(self.zeta):.2f} of the truth's"
        return f"{self.found:4d} of {self.of} modes" + (f", {errors}" if self.found else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="+", type=pathlib.Path)
    tallies: dict[tuple[str, str], Tally] = {}
    for cases in parser.parse_args().cases:
        for path in sorted(cases.glob("*/public/study.toml")):
            truth = json.loads((path.parents[1] / "sealed" / "truth.json").read_text())
            study = load_study(path)
            fit = tuple(r for r in study.recordings if r.role == "fit")
            band = replace(study.correlation, band=tuple(truth["band"]))
            study = replace(study, recordings=fit, correlation=band)
            for how, modes_of in (("eighths", of_eighths), ("correlate", as_correlated)):
                tally = tallies.setdefault((truth["excitation"], how), Tally())
                try:
                    every = modes_of(study)
                except FemendError as error:
                    print(f"{path.parents[1].name}, {how}: {error}")
                    continue
                for modes in every:
                    tally.add(modes, truth)
    for (excitation, how), tally in sorted(tallies.items()):
        print(f"{excitation:10} {how:10} {tally}")


if __name__ == "__main__":
    main()
