"""What of a deck turns in a run."""

from __future__ import annotations

import numpy as np

from femend.bench.reading.runs import MeasuredRun
from femend.model.terms.rotors import Rotors
from femend.model.terms.spinning import SpinningPart

__all__ = ["turned_in"]


def turned_in(rotors: Rotors, run: MeasuredRun) -> tuple[SpinningPart, ...]:
    """The `rotors` of the deck as parts of the machine whose shaft's speed the `run` has, positive about the axis of
    its study by the right hand; none where no rotor lies along it."""
    return rotors.parts(np.eye(3)[run.axis])
