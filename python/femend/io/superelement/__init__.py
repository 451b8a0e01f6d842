"""Superelements given by reduced matrices: from OUTPUT4 and a DOF map to DMIG cards that a deck includes."""

from __future__ import annotations

from femend.io.superelement.cards import case_control, dmig_cards, superelement_cards, write_superelement
from femend.io.superelement.dof_map import read_dof_map
from femend.io.superelement.matrices import RigidCheck, Superelement, read_superelement

__all__ = [
    "RigidCheck",
    "Superelement",
    "case_control",
    "dmig_cards",
    "read_dof_map",
    "read_superelement",
    "superelement_cards",
    "write_superelement",
]
