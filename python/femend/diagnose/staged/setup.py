"""What all stages share: the deck without supports, its configurations, regions and springs, and the unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.staged.settings import StagedSettings
from femend.dof import Dof
from femend.estimate.joint import Posterior
from femend.model import Model, Pairing
from femend.model.idealisation import idealisation_terms
from femend.model.model import model_of
from femend.model.terms.bushes import BushGroup, bush_groups
from femend.model.terms.configured import ALPHA, BETA, ConfiguredModel, configure
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.spinning import SpinningPart
from femend.model.terms.supports import SupportRegion, held_rows, support_regions
from femend.model.terms.unknowns import Unknown, Unknowns

__all__ = ["ConfigurationSpec", "Setup", "carried", "setup_of"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ConfigurationSpec:
    """A configuration: its name, SPC set (None: the deck's own choice) and added masses."""

    name: str
    spc: int | None = None
    added_mass: tuple[tuple[int, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Setup:
    """The study as the stages see it; `g_rows` are DOFs where forces act or are measured, `f_max` Hz the band's end,
    `spinning` the parts of the deck that turn with the shaft of its runs, about the axis of these."""

    free: Model
    configurations: dict[str, ConfigurationSpec]
    regions: dict[str, tuple[SupportRegion, ...]]
    bushes: tuple[BushGroup, ...]
    idealised: tuple[LinearTerm, ...]
    pairing: Pairing
    f_max: float
    omega: float
    zeta: float
    g_rows: tuple[int, ...]
    settings: StagedSettings
    spinning: tuple[SpinningPart, ...] = ()

    def base(self) -> list[Unknown]:
        """Parameters and the structure's damping (half of it mass-, half stiffness-proportional at the band's
        middle)."""
        found = [Unknown(p.name, 1.0, sd=p.prior_sd) for p in self.free.parameters]
        zeta, omega = self.zeta, self.omega
        return [*found, Unknown(ALPHA, zeta * omega, unit="1/s"), Unknown(BETA, zeta / omega, unit="s")]

    def unknowns(self, terms: Sequence[LinearTerm], more: Sequence[Unknown] = ()) -> Unknowns:
        """Unknowns of the model with `terms`, independent, and `more`."""
        return Unknowns.of([*self.base(), *(u for t in terms for u in t.unknowns), *more])

    def model(self, configuration: str, unknowns: Unknowns, terms: Sequence[LinearTerm]) -> ConfiguredModel:
        """The small model of a configuration with those of the `terms` that exist in it."""
        spec = self.configurations[configuration]
        return configure(
            configuration,
            self.free,
            unknowns,
            terms,
            spc=spec.spc,
            added_mass=spec.added_mass,
            f_max=self.f_max,
            g_rows=self.g_rows,
            spinning=self.spinning,
        )

    def row(self, sensor: Dof) -> tuple[int, float]:
        """Row of the g-set and sign of a sensor's DOF, through the pairing."""
        pair = self.pairing[sensor]
        return self.free.row(pair.dof), float(pair.dof.sign)

    def rows(self, model: ConfiguredModel, sensors: Sequence[Dof]) -> FloatArray:
        """Rows (n, r) of a configuration's basis at sensors, with their signs."""
        found = [self.row(d) for d in sensors]
        return model.rows([f[0] for f in found], np.array([f[1] for f in found]))

    def drift(self, names: Sequence[str], loose: bool = False) -> FloatArray:
        """1-sigma (n,) by which unknowns may differ between stages; with `loose` parameters may be anything."""
        s = self.settings
        parameters = {p.name for p in self.free.parameters}
        found = [
            s.drift_damping if n in (ALPHA, BETA) else s.drift if n in parameters else s.drift_idealised for n in names
        ]
        if loose:
            found = [s.loose if n in parameters else d for n, d in zip(names, found, strict=True)]
        return np.array(found)


def carried(setup: Setup, unknowns: Unknowns, before: Posterior | None, loose: bool = False) -> Unknowns:
    """`unknowns` with what the stage `before` settled as the prior of those it knew, widened by the drift."""
    if before is None:
        return unknowns
    known = [n for n in before.unknowns.names if n in unknowns.names]
    old = [before.unknowns.index(n) for n in known]
    at = [unknowns.index(n) for n in known]
    covariance = before.covariance[np.ix_(old, old)] + np.diag(setup.drift(known, loose) ** 2)
    mean, precision = unknowns.mean.copy(), unknowns.precision.copy()
    mean[at] = before.p[old]
    precision[np.ix_(at, at)] = np.linalg.inv(covariance)
    return unknowns.with_posterior(mean, precision)


def setup_of(
    free: Model,
    configurations: Sequence[ConfigurationSpec],
    pairing: Pairing,
    *,
    band: tuple[float, float],
    zeta: float,
    g_rows: Sequence[int],
    settings: StagedSettings | None = None,
    spinning: Sequence[SpinningPart] = (),
) -> Setup:
    """Finds the regions that each configuration holds, the springs, and what the deck idealises."""
    regions = {}
    for spec in configurations:
        held = model_of(free.deck, units=free.units, spc=spec.spc)
        regions[spec.name] = support_regions(free, held_rows(free, held))
    moving = _moving_mass(free, configurations[0])
    return Setup(
        free,
        {c.name: c for c in configurations},
        regions,
        bush_groups(free),
        idealisation_terms(free, moving),
        pairing,
        band[1],
        2 * np.pi * float(np.sqrt(band[0] * band[1])),
        zeta,
        tuple(sorted(set(int(g) for g in g_rows))),
        settings or StagedSettings(),
        tuple(spinning),
    )


def _moving_mass(free: Model, spec: ConfigurationSpec) -> float:
    """Mass that moves where the supports hold: the rigid-body mass of the DOFs that stay, per direction on average."""
    held = model_of(free.deck, units=free.units, spc=spec.spc)
    _, M = held.matrices()
    total = 0.0
    for c in range(3):
        rigid = np.zeros(int(held.fe.n_a))
        rigid[np.asarray(held.fe.dof_components) == c + 1] = 1.0
        total += float(rigid @ (M @ rigid)) / 3.0
    return total
