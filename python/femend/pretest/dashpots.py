"""What a planned test would tell of dashpots: the modes' damping ratios, and where the phases of a shape differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from femend.errors import PretestError
from femend.estimate.updating import affine_matrices, modal_system
from femend.model import Model
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.unknowns import Unknown, Unknowns
from femend.pretest.information import PlannedTest, planned_test

__all__ = ["OWN_DAMPING", "JointTest", "Plan", "dashpot_test"]

FloatArray = NDArray[np.float64]

# the unknown that stands for the structure's own damping, the same share in every mode
OWN_DAMPING = "damping of the structure"
# 1-sigma of its logarithm: within a factor of e of what the study says
LEVEL_SD = 1.0


class Plan(Protocol):
    """What a planned test has to say of its unknowns, whatever it measures."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""

    @property
    def prior(self) -> FloatArray:
        """Precision of p before the test (n, n)."""

    @property
    def size(self) -> FloatArray:
        """A span of p (n,)."""

    def information(self, rows: ArrayLike, *, prior: bool = True) -> FloatArray:
        """Expected information on p (n, n) of a test with sensors at `rows`."""


@dataclass(frozen=True, eq=False)
class JointTest:
    """Plans of one test that share no unknown: what `first` and `second` say stands side by side.

    To first order about an undamped model masses and springs change frequencies and real shapes alone, dashpots damping
    ratios and imaginary parts alone.
    """

    first: PlannedTest
    second: PlannedTest

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, those of `first` first."""
        return (*self.first.names, *self.second.names)

    @property
    def prior(self) -> FloatArray:
        """Precision of p before the test (n, n)."""
        return np.asarray(block_diag(self.first.prior, self.second.prior))

    @property
    def size(self) -> FloatArray:
        """A span of p (n,)."""
        return np.concatenate([self.first.size, self.second.size])

    def information(self, rows: ArrayLike, *, prior: bool = True) -> FloatArray:
        """Expected information (n, n) of a test with sensors at `rows`; raises PretestError for rows that are no
        places."""
        parts = [part.information(rows, prior=prior) for part in (self.first, self.second)]
        return np.asarray(block_diag(*parts))


def dashpot_test(
    model: Model,
    dashpots: Sequence[LinearTerm],
    seen: Any,
    n_modes: int,
    *,
    modes: Sequence[int],
    zeta: float,
    damping_sd: float = 0.2,
    shape_sd: ArrayLike = 0.05,
) -> PlannedTest:
    """The plan of a modal test for `dashpots` (terms that act on C) on a deck seen at the rows `seen` (n_places, n).

    Of mode r, mass-normalised with omega_r, a matrix C changes the damping ratio by phi_r' C phi_r / (2 omega_r) and
    gives the shape the imaginary part sum over s of omega_r (phi_s' C phi_r) / (omega_r^2 - omega_s^2) phi_s (Woodhouse
    1998, J. Sound Vib. 215, 547-569): what a stiffness i omega_r C would do, first order in C. So modes have to lie
    further apart than C shifts them. The test tells ratios to the share `damping_sd` of the structure's own `zeta`, by
    which these differ from mode to mode too, and shapes to `shape_sd` of each mode's largest motion, at an unknown
    phase. The level of the own damping is an unknown too (`OWN_DAMPING`), within a factor of e. `modes` are numbers
    from 0 of the lowest `n_modes`.

    Raises PretestError for a term without a dashpot, a mode at 0 Hz, and a `zeta` or deviation that is not above 0.
    """
    from scipy.sparse import csc_array

    for name, value in (("zeta", zeta), ("damping_sd", damping_sd)):
        if not (np.isfinite(value) and value > 0):
            raise PretestError(f"{name} is {value:g}; what a dashpot adds is told against a damping ratio above 0")
    T, parts = model.transformation(), {}
    for term in dashpots:
        own = [p for p in term.parts if p.kind == "C" and p.powers]
        if not own:
            raise PretestError(f"{term.name} has no dashpot; give it to candidate_matrices")
        parts[term.name] = sum((term.scale_of(p) * csc_array(T.T @ p.matrix @ T) for p in own), start=0.0)
    K, M = model.matrices()
    system = modal_system(affine_matrices(parts, M, K_fixed=K), seen, n_modes)
    unknowns = Unknowns.of([Unknown(name, 1.0, False, 0.0, 1.0) for name in parts])
    # of a stiffness C: d freq over freq with a deviation of 1, and the shapes
    as_springs = planned_test(system, unknowns, modes=modes, freq_sd=1.0, shape_sd=shape_sd)
    if not (as_springs.freq > 0).all():
        raise PretestError("a target mode is at 0 Hz and has no damping ratio; plan for elastic modes")
    omega = 2 * np.pi * as_springs.freq
    level = np.full((omega.size, 1), 1.0 / damping_sd)
    ratios = omega[:, None] * as_springs.frequencies / (damping_sd * zeta)
    shapes = omega[:, None] * as_springs.shapes
    return replace(
        as_springs,
        names=(*as_springs.names, OWN_DAMPING),
        prior=np.asarray(block_diag(as_springs.prior, np.array([[1.0 / LEVEL_SD**2]]))),
        size=np.append(as_springs.size, LEVEL_SD),
        frequencies=np.hstack([ratios, level]),
        shapes=np.concatenate([shapes, np.zeros((*shapes.shape[:2], 1))], axis=2),
    )
