"""One channel of a recording: where it measures, what, and in which unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.dof import Dof

__all__ = ["Channel"]


@dataclass(frozen=True, slots=True)
class Channel:
    """Label of one row of recorded values.

    `dof` is the sensor's node and signed direction (None for a tacho or any other scalar), `quantity` one of
    displacement, velocity, acceleration, force, strain, tacho, voltage, pressure, unknown; `unit` the unit of the
    values as they are held; `name` the channel's name and `label` the free text of its record (the id line of a
    universal file).
    """

    dof: Dof | None
    quantity: str
    unit: str
    name: str = ""
    label: str = ""

    @property
    def text(self) -> str:
        """The channel as a message names it: ``acceleration 12:+Z (top)``."""
        place = f" {self.dof}" if self.dof is not None else ""
        name = f" ({self.name})" if self.name else f" ({self.label})" if self.label else ""
        return f"{self.quantity}{place}{name}"

    def answers_to(self, text: str) -> bool:
        """True where `text` is the channel's name or DOF, or begins its name or its label."""
        return text in (self.name, str(self.dof)) or self.name.startswith(text) or self.label.startswith(text)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "dof": None if self.dof is None else str(self.dof),
            "quantity": self.quantity,
            "unit": self.unit,
            "name": self.name,
            "label": self.label,
        }
