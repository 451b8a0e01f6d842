"""Levenberg-Marquardt through a closed loop: derivatives over laws along the simulation, over models by linearisation.

A change of the model's unknowns hardly changes how the law works; so for their derivatives the law is a spring and a
dashpot that follow its force best, and what is left of its force stays as it was. That needs no simulation. Friction
that sticks and slips may be changed so much all the same that these lead nowhere; then all go along the simulation.

A law, the spring beside it and the model's own stiffness make up for one another: what is known of them is a narrow,
bent valley, along which straight steps hardly get on. Steps that gain less than they should are bent along it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.closed_loop import History, Loop, Modal, squares
from femend.diagnose.fitting.linearised import linearised_columns
from femend.diagnose.fitting.tangents import tangent_columns
from femend.errors import ModelError
from femend.estimate.lines import TEMPERING

__all__ = ["Descent", "Reached"]

FloatArray = NDArray[np.float64]
L = TypeVar("L", bound=Loop)

SMALL = 1e-6
LARGEST_STEP = 0.7
# fall of the cost below which a step is not worth its simulation: this, and this share of it times the cost
WORTH = 1e-2
# multiples of the damping that are tried, together those in one line, and its factor where they lead down
TRIED = (((1.0, 0.1),), ((30.0, 10.0), (1000.0, 300.0)))
# share of the gain foreseen below which a step is bent, and the change by that, against the step, up to which it is
# (Transtrum and Sethna 2012, eq. 15)
FORESEEN, BENT = 0.75, 0.75
# unknowns from which simulated derivatives are carried on from step to step, and made anew where that leads no further
MANY = 8


@dataclass(frozen=True, eq=False)
class Reached:
    """Where a descent is: unknowns z (p, then x), residual, histories, cost, Gauss-Newton matrix over what is free, and
    the share of the cost that the last step took away."""

    z: FloatArray
    e: FloatArray
    histories: list[History]
    cost: float
    H: FloatArray | None = None
    fell: float = 1.0


@dataclass(frozen=True, eq=False)
class Descent(Generic[L]):
    """Minimises tempered squares plus prior over the law's unknowns x and, with `everything`, the model's p."""

    loop: L
    mean: FloatArray
    sd: FloatArray
    n_p: int
    everything: bool

    @classmethod
    def around(cls, loop: L, x: FloatArray, everything: bool) -> Descent[L]:
        """Priors of the model, and of the law around `x`."""
        mean, sd = loop.problem.prior(loop.joint.reduced)
        law_mean, law_sd = loop.prior(x)
        both = np.concatenate([mean, law_mean]), np.concatenate([sd, law_sd])
        return cls(loop, *both, len(mean), everything)

    def on(self, loop: L, everything: bool | None = None) -> Descent[L]:
        """The same priors on another window, or with more of the unknowns free."""
        return replace(self, loop=loop, everything=self.everything if everything is None else everything)

    @property
    def free(self) -> NDArray[np.int64]:
        """Positions of the unknowns that move."""
        return np.arange(0 if self.everything else self.n_p, len(self.mean))

    def split(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Unknowns of the model and of the law in `z` (n_p + n_x,)."""
        return z[: self.n_p], z[self.n_p :]

    def at(self, *points: FloatArray) -> list[Reached]:
        """Residuals and costs at points; infinite where a simulation failed."""
        residuals, histories = self.loop.residuals([self.split(z) for z in points])
        return [Reached(z, e, h, self.cost(z, e)) for z, e, h in zip(points, residuals, histories, strict=True)]

    def cost(self, z: FloatArray, e: FloatArray) -> float:
        """Prior of the unknowns `z` plus tempered squares of the residual `e`."""
        value = float((((z - self.mean) / self.sd) ** 2).sum()) + TEMPERING * squares(e)
        return value if np.isfinite(value) else np.inf

    @np.errstate(over="ignore", invalid="ignore")  # what is beyond numbers is refused: costs, derivatives, steps
    def run(self, z: FloatArray, iterations: int, thorough: bool = False) -> Reached | None:
        """The end of the descent from z; None where the start cannot be simulated. With `thorough`, it goes on with
        exact derivatives alone from where linearised ones lead no further down."""
        (now,) = self.at(z)
        if not np.isfinite(now.cost):
            return None
        damping, exactly = 1e-3, not self.everything
        J: FloatArray | None = None
        carried = False
        made = 0
        while True:
            if J is None:
                if made == iterations:
                    break
                J, carried, made = self.jacobian(now, exactly), False, made + 1
            H, g = self._normal(now, J)
            if not (np.isfinite(H).all() and np.isfinite(g).all()):
                break  # the motion there depends on the unknowns beyond what numbers can hold
            now = replace(now, H=H)
            reached = self._tried(now, J, H, g, damping)
            there, taken = (now, 1.0) if reached is None else reached
            gained = now.cost - there.cost
            little = gained < _worth(now.cost)
            if little and carried:
                now, J = replace(there, H=H), None  # derivatives of where it was may be to blame
                continue
            if reached is None:
                now = replace(now, fell=0.0)
                damping *= 1e4
                made += 1
                if damping > 1e6:
                    if exactly or not thorough:
                        break
                    exactly, damping, J = True, 1e-3, None
                elif made >= iterations:
                    break
                continue
            before, now = now, replace(there, H=H, fell=gained / now.cost)
            damping = max(damping * taken, 1e-8)
            if little:
                if exactly or not thorough:
                    break
                exactly = True
            carried = exactly and J.shape[1] > MANY and not little
            J = self._carried(J, before, now) if carried else None
        return now

    def _normal(self, now: Reached, J: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gauss-Newton matrix and gradient of half the cost over what is free, with derivatives J of the residual."""
        H = TEMPERING * (J.T @ J) + np.diag(1 / self.sd[self.free] ** 2)
        return H, TEMPERING * (J.T @ now.e) + ((now.z - self.mean) / self.sd**2)[self.free]

    def _carried(self, J: FloatArray, before: Reached, now: Reached) -> FloatArray:
        """Derivatives carried on over a step, changed by as little as what the step showed asks for (Broyden 1965,
        eq. 4.5, in units of the priors)."""
        step = (now.z - before.z)[self.free]
        scaled = step / self.sd[self.free] ** 2
        return np.asarray(J + np.outer(now.e - before.e - J @ step, scaled / (step @ scaled)))

    def _tried(
        self, now: Reached, J: FloatArray, H: FloatArray, g: FloatArray, damping: float
    ) -> tuple[Reached, float] | None:
        """Where a step leads, and the factor on the damping after it; two shorter steps are tried where the whole one
        does not lead down, and None is returned where these do not either. Steps that gain less than foreseen are tried
        bent too; those that are not foreseen to gain what counts are not simulated."""
        for of_line in TRIED:
            damped = [H + damping * factor * np.diag(np.diag(H)) for factor, _ in of_line]
            steps = [np.clip(_solved(A, -g), -LARGEST_STEP, LARGEST_STEP) for A in damped]
            told = [i for i, step in enumerate(steps) if _foreseen(step, H, g) >= _worth(now.cost)]
            if not told:
                continue
            factors, damped, steps = [of_line[i] for i in told], [damped[i] for i in told], [steps[i] for i in told]
            reached = self._beyond(now, steps)
            bends = [self._bent(now, *tried, J, H, g) for tried in zip(reached, damped, steps, strict=True)]
            bent = [(i, step) for i, step in enumerate(bends) if step is not None]
            for (i, _), there in zip(bent, self._beyond(now, [step for _, step in bent]), strict=True):
                reached[i] = min(reached[i], there, key=lambda r: r.cost)
            best = int(np.argmin([r.cost for r in reached]))
            if reached[best].cost < now.cost:
                return reached[best], factors[best][1]
        return None

    def _beyond(self, now: Reached, steps: list[FloatArray]) -> list[Reached]:
        """Where steps over the free unknowns lead."""
        trials = [now.z.copy() for _ in steps]
        for trial, step in zip(trials, steps, strict=True):
            trial[self.free] += step
        return self.at(*trials) if trials else []

    def _bent(
        self, now: Reached, there: Reached, A: FloatArray, step: FloatArray, J: FloatArray, H: FloatArray, g: FloatArray
    ) -> FloatArray | None:
        """A step of the damped matrix A bent by how far the residual it led to is from the one foreseen (geodesic
        acceleration, Transtrum and Sethna 2012, eq. 6, its second derivative taken over the whole step); None where it
        gained as foreseen, or would be bent too far."""
        if now.cost - there.cost >= FORESEEN * _foreseen(step, H, g) or not np.isfinite(there.cost):
            return None
        bend = -TEMPERING * _solved(A, J.T @ (there.e - now.e - J @ step))
        return np.asarray(step + bend) if self._length(bend) < BENT * self._length(step) else None

    def _length(self, step: FloatArray) -> float:
        """Length of a step over the free unknowns in units of their priors."""
        return float(np.linalg.norm(step / self.sd[self.free]))

    def jacobian(self, now: Reached, exactly: bool = False) -> FloatArray:
        """Derivatives (n_residual, n_free) of the residual: along the simulation over x, by linearisation over p or,
        where wanted, `exactly` too."""
        p, x = self.split(now.z)
        here = self.loop.problem.system(self.loop.joint.reduced).modal(p)
        moved = [_beside(self.loop, p, i) for i in range(len(p))] if self.everything and exactly else []
        over_p, over_x = tangent_columns(self.loop, here, x, moved)
        J = np.array(over_p + over_x).T.reshape(len(now.e), -1)
        if self.everything and not exactly:
            J = np.hstack([linearised_columns(self.loop, p, x, now.histories), J])
        return np.where(np.isfinite(J), J, 0.0)


def _worth(cost: float) -> float:
    """Fall of a cost that is worth a step."""
    return WORTH * (1 + WORTH * cost)


def _foreseen(step: FloatArray, H: FloatArray, g: FloatArray) -> float:
    """Fall of the cost that half its gradient `g` (n,) and matrix `H` (n, n) foretell for a step (n,)."""
    return -float(2 * g @ step + step @ H @ step)


def _solved(A: FloatArray, b: FloatArray) -> FloatArray:
    """x of A x = b for a positive definite A (n, n), in units in which its diagonal is one: a motion that hangs on one
    unknown without measure leaves nothing of the others' priors otherwise. The shortest where rounding leaves many, and
    NaN, from which nothing is foreseen, where A is beyond what numbers hold."""
    if not np.isfinite(A).all():
        return np.full(len(b), np.nan)
    size = np.sqrt(np.diag(A))
    scaled, right = A / np.outer(size, size), b / size
    try:
        x = np.linalg.solve(scaled, right)
    except np.linalg.LinAlgError:
        x = np.linalg.lstsq(scaled, right, rcond=None)[0]
    return np.asarray(x / size, dtype=np.float64)


def _beside(loop: Loop, p: FloatArray, i: int) -> tuple[Modal, float]:
    """Modes of the model with unknown i moved, and by how much; inwards at the edge of what has any, and not at all in
    a corner."""
    system = loop.problem.system(loop.joint.reduced)
    for step in (SMALL, -SMALL):
        q = p.copy()
        q[i] += step
        try:
            return system.modal(q), step
        except ModelError:
            continue
    return system.modal(p), 1.0
