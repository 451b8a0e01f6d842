"""The bundled case of `femend demo`.

`study/` is what a diagnosis gets: the study, the deck and the recordings, simulated by another program on a finer mesh.
`held_out/` holds the recordings behind the study's `predict` roles, and `truth.json` what was concealed; the diagnosis
never sees these two.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.deciding.stages import STAGES
from femend.io import read_recording
from femend.report import words

__all__ = ["STUDY", "HeldOut", "concealed", "held_out_errors", "nrmse"]

_HERE = Path(__file__).parent
STUDY = _HERE / "study" / "study.toml"

Responses = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class HeldOut:
    """NRMSE of the predictions of one held-out recording at each stage; None where a stage predicted nothing."""

    recording: str
    nominal: float | None
    parameters: float | None
    final: float | None


def concealed(folder: Path = _HERE) -> str | None:
    """What was left out of the model, in words, from `folder`/truth.json; None where there is no such file."""
    path = folder / "truth.json"
    if not path.is_file():
        return None
    truth = json.loads(path.read_text(encoding="utf-8"))
    location = {key: truth[key] for key in ("nodes", "direction", "to") if key in truth}
    physics = str(truth["effect"])
    return f"{words.physics_name(physics)} {words.place_text(location, physics)}"


def held_out_errors(out: Path, folder: Path = _HERE / "held_out") -> list[HeldOut]:
    """How well the predictions below `out` meet the recordings in `folder`, one entry per recording."""
    found = []
    for path in sorted(folder.glob("*.uff")):
        recorded = responses(path)
        errors: dict[str, float | None] = {}
        for stage in STAGES:
            predicted = out / "predictions" / stage / path.name
            errors[stage] = nrmse(responses(predicted), recorded) if predicted.is_file() else None
        found.append(HeldOut(path.stem, **errors))
    return found


def responses(path: Path) -> Responses:
    """The response records of the universal file at `path`, (n_samples,) each, by quantity and DOF."""
    response = read_recording(path, role="predict").response
    if response is None:
        return {}
    return {f"{c.quantity} {c.dof}": y for c, y in zip(response.channels, response.values, strict=True)}


def nrmse(predicted: Responses, recorded: Responses) -> float:
    """Root of the summed squared error over all of `recorded`, divided by the root of the summed squared recording.

    A record that was not predicted, or is shorter, counts as zero there.

    >>> nrmse({"a": np.array([1.0, 0.0])}, {"a": np.array([1.0, 1.0]), "b": np.array([1.0, 1.0])})
    0.8660254037844386
    """
    error = power = 0.0
    for name, y in recorded.items():
        p = predicted.get(name, np.zeros(0))[: len(y)]
        error += float(((p - y[: len(p)]) ** 2).sum() + (y[len(p) :] ** 2).sum())
        power += float((y**2).sum())
    return float(np.sqrt(error / power)) if power > 0 else float("nan")
