"""Silence where more than noise is left is told with what is left."""

from __future__ import annotations

from typing import Any

import pytest

from femend.study.result import _left_over


def row(name: str, floor: float | None, left: float | None, role: str = "fit") -> dict[str, Any]:
    return {"recording": name, "role": role, "noise_floor": floor, "parameters": left}


@pytest.mark.parametrize("verdict", ["consistent", "parameters-only"])
def test_the_worst_recording_is_told(verdict: str) -> None:
    rows = [row("low", 0.02, 0.022), row("high", 0.02, 0.05), row("held", 0.01, 0.3, "validate")]
    said = _left_over(verdict, rows)
    assert "2.5 times the noise of high" in said
    assert "refine the mesh" in said


def test_nothing_is_said_of_noise_or_beside_findings() -> None:
    near = [row("low", 0.02, 0.022), row("high", 0.02, 0.029)]
    assert _left_over("parameters-only", near) == ""
    assert _left_over("missing-physics", [row("high", 0.02, 0.5)]) == ""
    assert _left_over("consistent", [row("high", None, 0.5), row("low", 0.02, None)]) == ""
