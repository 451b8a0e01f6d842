"""A finished plan of a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.bench.planning.explanations import Explanations
from femend.bench.planning.places import Targets
from femend.bench.planning.pretest_words import pretest_text
from femend.dof import Dof
from femend.model import Model
from femend.pretest import ExciterChoice, MassLoading, Placement, PlannedTest, VirtualTest
from femend.study.file.study import Study

__all__ = ["Plan", "PretestRun"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Plan:
    """What was planned: `targets`, all `places` with the `placement` among them, `others` by the other methods (None
    where one does not apply), the `planned` test (None without parameters), where to excite (`driven`, rows of the
    places `drives`), the driving-point residues of these, relative to each mode's largest, what the sensors' mass does,
    and which `explanations` it tells apart (None where the study asks for none)."""

    targets: Targets
    places: tuple[Dof, ...]
    placement: Placement
    others: dict[str, Placement]
    planned: PlannedTest | None
    drives: tuple[Dof, ...]
    driven: ExciterChoice
    residues: FloatArray
    loading: MassLoading | None
    explanations: Explanations | None = None

    @property
    def sensors(self) -> tuple[Dof, ...]:
        """The chosen sensors, those already placed among them."""
        return self.placement.dofs(self.places)

    @property
    def exciters(self) -> tuple[Dof, ...]:
        """Where to excite, in the order of choice."""
        return tuple(self.drives[i] for i in self.driven.rows)


@dataclass(frozen=True, eq=False, repr=False)
class PretestRun:
    """A finished plan of a test: `study`, `model`, the `plan`, its rehearsal on the model (`virtual`, None where it
    was not asked for or not possible), and the `result` as it is written."""

    study: Study
    model: Model
    plan: Plan
    virtual: VirtualTest | None
    result: dict[str, Any]

    def __repr__(self) -> str:
        return pretest_text(self.result)
