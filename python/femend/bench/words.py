"""How everything ends that the commands say on the terminal: what to doubt, and what to do."""

from __future__ import annotations

from typing import Any

__all__ = ["ends"]


def ends(result: dict[str, Any]) -> list[str]:
    """Warnings and advice."""
    said = [f"warning   {w}" for w in result["warnings"]]
    return [*said, f"advice    {result['advice']}"] if result["advice"] else said
