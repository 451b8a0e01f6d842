"""A measured 4-storey frame updated from a study file, as an engineer would who writes no Python.

The modes of Georgia Tech's laboratory frame (structural-model-updating toolbox, GPL-3.0; not part of this project: the
script looks for `data/shear_frames` in the folder FEMEND_SHARED, else in `../shared` beside the project) are written as
a universal file beside a deck of four masses on four springs and a study.toml, and updated:

python python/examples/shear_frame_study.py FOLDER
femend update FOLDER --out FOLDER/results

Priors, bounds and deviations are those of `shear_frames.py`, which states the same problem in Python: both give the
same factors.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray
from shear_frames import FREQUENCY_SD, SHAPE_SD, SMALL_MASS, SMALL_STIFFNESS, data_folder

import femend as fe
from femend.data import IdentifiedModes
from femend.io import UniversalFile
from femend.io.uff import modes_55

STOREYS = 4
STUDY = """format = "femend-study/1"
title = "4-storey laboratory frame"
[model]
file = "model.bdf"
units = "in-lbf-s"
{parameters}
[[recording]]
name = "modes"
file = "modes.uff"
[updating]
freq_sd = {freq_sd}
shape_sd = {shape_sd}
"""
PARAMETER = """
[[parameter]]
name = "k{i}"
property = "k1"
property_id = {i}
prior_sd = 0.5
bounds = [0.0, 2.0]
"""


def deck() -> str:
    """Four masses in a row along X, each on a spring to the one before, the first to the ground."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK"]
    lines += [f"GRID,{n},,0.,0.,{10.0 * n:.1f}" for n in range(STOREYS + 1)][1:]
    lines += [f"PELAS,{i},{SMALL_STIFFNESS:.8e}" for i in range(1, STOREYS + 1)]
    lines.append("CELAS1,1,1,1,1")
    lines += [f"CELAS1,{i},{i},{i - 1},1,{i},1" for i in range(2, STOREYS + 1)]
    lines += [f"CONM2,{100 + n},{n},,{SMALL_MASS:.8e}" for n in range(1, STOREYS + 1)]
    return "\n".join([*lines, f"SPC1,1,23456,1,THRU,{STOREYS}", "ENDDATA", ""])


def write_modes(path: Path, freq: NDArray[np.float64], phi: NDArray[np.float64]) -> None:
    """The measured modes at the floors along X, without damping, as data sets 55."""
    dofs = tuple(fe.Dof(n, 1) for n in range(1, STOREYS + 1))
    modes = IdentifiedModes(dofs, 2j * np.pi * freq, phi.astype(np.complex128))
    fe.write_uff(path, UniversalFile(str(path), modes=tuple(modes_55(modes))))


def write_study(folder: Path, data: Path) -> Path:
    """Deck, modes and study in `folder` from the authors' `data`; the path of the study."""
    folder.mkdir(parents=True, exist_ok=True)
    measured = scipy.io.loadmat(data / "FourStoryStructure.mat")
    write_modes(folder / "modes.uff", measured["test_frequency"].ravel(), measured["test_mode"])
    (folder / "model.bdf").write_text(deck())
    parameters = "".join(PARAMETER.format(i=i) for i in range(1, STOREYS + 1))
    study = folder / "study.toml"
    study.write_text(STUDY.format(parameters=parameters, freq_sd=FREQUENCY_SD, shape_sd=SHAPE_SD))
    return study


def main(folder: str) -> None:
    """Writes the study and prints what it gives."""
    study = write_study(Path(folder), data_folder())
    print(fe.correlate_study(study), end="\n\n")
    print(fe.update_study(study, Path(folder) / "results"))


if __name__ == "__main__":
    main(sys.argv[1])
