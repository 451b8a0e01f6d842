"""A real frame: FRFs measured on a three-storey laboratory frame update a model built from its stated dimensions.

The recordings are not part of this project. The script looks for `data/three_storey/Experimental_drive_floor1.csv`
(complex accelerance of floors 1 to 3, force at floor 1, 1/32 Hz) in the folder FEMEND_SHARED, else in `../shared`
beside the project. Run it as `python three_storey.py [folder for the results]`.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

HERE = Path(__file__).resolve().parent
FILE = "Experimental_drive_floor1.csv"


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or HERE.parents[2].parent / "shared")
    folder = root / "data" / "three_storey"
    if not (folder / FILE).is_file():
        raise FileNotFoundError(f"{folder / FILE} is not there; FEMEND_SHARED names the folder above data/three_storey")
    return folder


def run(data: Path, out: Path | None) -> StudyRun:
    """Puts the study together in a temporary folder, runs it and writes its results to `out`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(HERE / "model.bdf", folder)
        study = (HERE / "study.toml").read_text(encoding="utf-8")
        (folder / "study.toml").write_text(study.replace(FILE, (data / FILE).as_posix()), encoding="utf-8")
        return diagnose(folder / "study.toml", out)


def measured_peaks(finished: StudyRun, model: NDArray[np.float64]) -> NDArray[np.float64]:
    """The measured peak (Hz) nearest to each natural frequency: highest sum of magnitudes within 15 %."""
    frf = finished.test[0].frf
    size = np.abs(frf.H).sum(axis=(1, 2))
    near = [np.abs(frf.freq - f) < 0.15 * f for f in model]
    return np.array([frf.freq[n][np.argmax(size[n])] for n in near])


def updated_frequencies(finished: StudyRun) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Natural frequencies (Hz) of the deck with its parameters updated, and of the fit: with the frequency factors
    (1 ± 0.5 % a mode a priori) that stand for what no parameter describes."""
    null, reduced = finished.diagnosis.null, finished.diagnosis.reduced
    own = null.p.copy()
    own[len(reduced.names) :] = finished.diagnosis.nominal[1][len(reduced.names) :]
    system = finished.diagnosis.problem.system(reduced)
    return np.sort(system.modal(own)[0])[:3] / (2 * np.pi), np.sort(system.modal(null.p)[0])[:3] / (2 * np.pi)


def main() -> None:
    """Prints measured and updated frequencies, the parameters and the verdict."""
    finished = run(data_folder(), Path(sys.argv[1]) if len(sys.argv) > 1 else None)
    deck, fitted = updated_frequencies(finished)
    print("measured   as drawn    updated deck    fitted  [Hz]")
    drawn = finished.diagnosis.reduced.freq[:3]
    for row in zip(measured_peaks(finished, fitted), drawn, deck, fitted, strict=True):
        print("{:8.2f}   {:8.2f}   {:8.2f}        {:8.2f}".format(*row))
    for name, value in finished.result["parameters"].items():
        print(f"{name}: factor {value['factor']} ± {value['sd']}")
    for fit in finished.result["fit"]:
        print(f"{fit['recording']}: error {fit['nominal']} as drawn, {fit['parameters']} updated, {fit['final']} final")
    print(f"verdict: {finished.result['verdict']}")
    for finding in finished.result["findings"]:
        print(f"  {finding['physics']} at {finding['location']}, probability {finding['probability']}")


if __name__ == "__main__":
    main()
