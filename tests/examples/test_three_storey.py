"""The three-storey frame: a model from stated dimensions is updated on measured FRFs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from femend import FRF
from femend.model import read_model

EXAMPLE = "python/examples/three_storey"
# natural frequencies of the chain the frame's makers state, and the peaks of the measured FRFs, Hz
STATED, MEASURED = (7.11, 19.93, 28.80), (6.50, 17.47, 26.50)
VERDICTS = {"consistent", "parameters-only", "missing-physics", "located-not-named", "undetermined"}


def test_the_deck_is_the_one_its_script_writes(project_root: Path, script: Callable[[str], ModuleType]) -> None:
    written = (project_root / EXAMPLE / "model.bdf").read_text(encoding="ascii")
    assert script("three_storey/make_model").deck() == written


def test_the_deck_has_the_stated_frequencies(project_root: Path) -> None:
    K, M = read_model(project_root / EXAMPLE / "model.bdf").matrices()
    squares = np.linalg.eigvals(np.linalg.solve(M.toarray(), K.toarray())).real
    found = np.sqrt(np.sort(squares)) / (2 * np.pi)
    assert found == pytest.approx(STATED, abs=0.006)  # stated to two decimals


def test_the_updated_model_has_the_measured_frequencies(
    script: Callable[[str], ModuleType], shared: Callable[[str], Path], tmp_path: Path
) -> None:
    example = script("three_storey/three_storey")
    finished = example.run(shared("data/three_storey"), tmp_path / "out")
    deck, fitted = example.updated_frequencies(finished)
    assert np.abs(fitted / MEASURED - 1).max() < 0.01
    # the deck by itself lacks the frequency factors, 0.5 % a mode a priori, and comes less close
    assert np.abs(deck / MEASURED - 1).max() < 0.03
    assert np.abs(deck / MEASURED - 1).max() < 0.5 * np.abs(np.array(STATED) / MEASURED - 1).max()
    assert example.measured_peaks(finished, fitted) == pytest.approx(MEASURED, abs=1 / 32)
    assert finished.result["verdict"] in VERDICTS
    (fit,) = finished.result["fit"]
    # a chain of three storeys with its parameters alone explains all but a tenth of the recording; noise is 1 %
    assert fit["parameters"] < 0.1 < 1.0 < fit["nominal"]
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Frequency response accelerance 30:+X / 10:+X" in report
    predicted = finished.predictions[0].as_data("parameters")
    assert isinstance(predicted, FRF)
    assert predicted.H.shape == (4096, 3, 1)
