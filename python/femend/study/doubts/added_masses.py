"""Masses of a study that outweigh the structure, as those in another unit than the deck's do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femend.model import Model
from femend.numerals import plain
from femend.units import unit_system

if TYPE_CHECKING:
    from femend.study.file.study import Study

__all__ = ["added_mass_doubts", "planned_mass_doubts"]

# times the mass of the deck that nobody adds for a test; sensors that weigh as much as the structure are none
OUTWEIGHS, SENSORS = 5.0, 1.0


def added_mass_doubts(study: Study, model: Model) -> list[str]:
    """A sentence for each configuration of a `study` whose added masses are several times that of its deck; `model` is
    the deck in any of them."""
    own = model.total_mass - sum(m for _, m in model.added_mass)
    unit, told = unit_system(study.units).mass_text, []
    for one in study.configurations:
        added = sum(m for _, m in one.added_mass)
        if own > 0 and added > OUTWEIGHS * own:
            told.append(
                f"configuration {one.name!r} adds {plain(added, 3)} {unit}, {plain(added / own, 2)} times the mass of "
                f"the deck ({plain(own, 3)} {unit}): added_mass is in the deck's unit of mass, which is {unit} for "
                f"{study.units!r}"
            )
    return told


def planned_mass_doubts(study: Study, model: Model) -> list[str]:
    """A sentence for the sensors of a planned test, together, and one for each mass to be told from other explanations,
    that weigh more than what is tested, the deck of `model`, or several times that."""
    own = model.total_mass - sum(m for _, m in model.added_mass)
    if own <= 0:
        return []
    unit, p = unit_system(study.units).mass_text, study.pretest
    sensors = f"sensor_mass: {p.sensors} sensors of {plain(p.sensor_mass)} {unit} each weigh"
    planned = [(sensors, p.sensors * p.sensor_mass, SENSORS)]
    planned += [
        (f"distinguish[{i}]: {plain(c.size)} {unit} at node {c.node} is", c.size, OUTWEIGHS)
        for i, c in enumerate(p.distinguish)
        if c.physics == "added_mass"
    ]
    return [
        f"[pretest] {what} {plain(m / own, 2)} times the mass of the deck ({plain(own, 3)} {unit}): masses are in the "
        f"deck's unit, which is {unit} for {study.units!r}"
        for what, m, most in planned
        if m > most * own
    ]
