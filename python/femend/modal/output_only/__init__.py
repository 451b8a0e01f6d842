"""Modes from responses alone: the excitation is broad and was not measured."""

from __future__ import annotations

from femend.modal.output_only.harmonics import Harmonic, find_harmonics, remove_harmonics
from femend.modal.output_only.identify import METHODS, identify_output_only
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.setups import MergedModes, merge_setups
from femend.modal.output_only.stabilisation import Stabilisation

__all__ = [
    "METHODS",
    "Harmonic",
    "MergedModes",
    "OutputOnlyModes",
    "Stabilisation",
    "find_harmonics",
    "identify_output_only",
    "merge_setups",
    "remove_harmonics",
]
