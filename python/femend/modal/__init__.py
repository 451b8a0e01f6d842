"""Modal tests: FRFs to poles, shapes and modal masses, each with how well it is known."""

from __future__ import annotations

from femend.modal.plscf import PoleTable, plscf_poles

__all__ = ["PoleTable", "plscf_poles"]
