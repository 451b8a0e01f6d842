"""Modes from responses alone: the excitation is broad and was not measured."""

from __future__ import annotations

from femend.modal.output_only.identify import identify_output_only
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.stabilisation import Stabilisation

__all__ = ["OutputOnlyModes", "Stabilisation", "identify_output_only"]
