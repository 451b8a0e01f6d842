"""Checking what a study says of a rotor's excitation."""

from __future__ import annotations

import cmath
import math

from femend.data import Rotating
from femend.study.file.check import Check
from femend.study.file.schema import RotatingTable

__all__ = ["rotating_of"]


def rotating_of(check: Check, table: RotatingTable, key: str) -> Rotating:
    """``[recording.rotating]`` of the recording at `key`; raises StudyError, naming the key, for an axis, a number of
    pulses or a sense that is none, for no bearing, and for an unbalance without a node or a size of its own, or without
    a pulse to which its phase refers."""
    check.one_of(f"{key}.axis", table.axis, ("X", "Y", "Z"))
    if not table.pulses_per_revolution > 0:
        raise check.fail(f"{key}.pulses_per_revolution", "must be positive")
    if table.pulses_per_revolution != round(table.pulses_per_revolution):
        raise check.fail(
            f"{key}.pulses_per_revolution",
            f"{table.pulses_per_revolution:g} is no whole number: a tacho on another shaft, or of less than a pulse a "
            "turn, does not tell where this one stands; record a tacho on this shaft",
        )
    if not table.nodes:
        raise check.fail(f"{key}.nodes", "names no bearing node; unbalance must act somewhere")
    if table.sense not in (None, 1, -1):
        raise check.fail(f"{key}.sense", f"{table.sense} is neither 1 (the right hand about the axis) nor -1")
    known: list[tuple[int, complex]] = []
    for i, one in enumerate(table.unbalance):
        own = f"{key}.unbalance[{i}]"
        if not (math.isfinite(one.m_r) and one.m_r > 0):
            raise check.fail(
                f"{own}.m_r", f"{one.m_r:g} is not above 0; a mass times its distance from the shaft's axis"
            )
        if not math.isfinite(one.phase_deg):
            raise check.fail(f"{own}.phase_deg", f"{one.phase_deg:g} is no angle in degrees")
        if one.node in [node for node, _ in known]:
            raise check.fail(f"{own}.node", f"node {one.node} has an unbalance already; add both as vectors")
        known.append((one.node, cmath.rect(one.m_r, math.radians(one.phase_deg))))
    if known and table.pulses_per_revolution != 1:
        raise check.fail(
            f"{key}.unbalance",
            f"its phases are against one pulse of a revolution, and the tacho gives {table.pulses_per_revolution:g}; "
            "leave it out, or record a tacho with one pulse",
        )
    return Rotating(
        table.tacho, tuple(table.nodes), table.axis, table.pulses_per_revolution, tuple(known), table.sense or 0
    )
