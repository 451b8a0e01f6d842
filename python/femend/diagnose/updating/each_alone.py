"""Recordings that the updated model explains one by one and not together: the structure was not the same in them.

A frame is softer on a warm day, a tank is filled, a bolt is tightened between two runs. Each recording is then that of
a linear structure which the model explains, with factors of its own; fitted together they leave what looks like
something missing that depends on the level. A law at one place is told from it by the recording that shows it most: no
linear model reaches the noise of that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import Fit
from femend.numerals import plain

__all__ = ["explained_one_by_one", "fitted_one_by_one", "moved_most", "unlike"]

FloatArray = NDArray[np.float64]


def unlike(start: UpdatedModel, settings: Settings) -> str:
    """What is said of recordings that are not those of one structure; empty where they may be.

    They are not where the updated model is far from the noise of all together and explains each by itself.
    """
    records = start.problem.records
    timed = all(r.frf is None and r.driven for r in records)
    if len(records) < 2 or not timed or start.problem.load is not None or start.null.score <= settings.far:
        return ""
    fits = explained_one_by_one(start, settings)
    return "" if fits is None else _told(start, fits)


def explained_one_by_one(start: UpdatedModel, settings: Settings) -> list[Fit] | None:
    """The updated model fitted to each of its records alone; None where it does not explain one of them to the noise
    within its priors."""
    return fitted_one_by_one(start, lambda fit: fit.score <= settings.consistent and not settings.strains(fit.prior))


def fitted_one_by_one(start: UpdatedModel, good: Callable[[Fit], bool] = lambda fit: True) -> list[Fit] | None:
    """The updated model fitted to each of its records alone; None where it breaks down on one of them, or that fit is
    not `good`."""
    null, fits = start.null, []
    for record in start.problem.records:
        (fit,) = start.problem.on([record]).fit([null.hypothesis], [(null.p, np.zeros(0))])
        if fit is None or not good(fit):
            return None
        fits.append(fit)
    return fits


def _told(start: UpdatedModel, fits: Sequence[Fit]) -> str:
    """The mode and the parameters that differ most between the records, and what to do."""
    return (
        "each fit recording by itself is explained by the updated model to the noise, all of them together are not: "
        f"{moved_most(start, fits)}. The structure was not the same in them (temperature, fill, supports, bolts that "
        "were loosened or tightened between), or it changes with the level as a whole and not at one place. Record a "
        "level twice, first and last, to tell the two apart; recordings of one state make a study"
    )


def moved_most(start: UpdatedModel, fits: Sequence[Fit]) -> str:
    """The resonance that differs most between fits to each record alone, with the user's parameters in them."""
    problem, names = start.problem, [r.name for r in start.problem.records]
    omega, zeta = _modes(start, fits)
    inside = (omega.min(axis=0) >= 2 * np.pi * problem.band[0]) & (omega.max(axis=0) <= 2 * np.pi * problem.band[1])
    # a resonance is apart by how many of its widths it moved, or by how much wider it became
    apart = np.log(omega.max(axis=0) / omega.min(axis=0)) / zeta.mean(axis=0) + np.log(zeta.max(0) / zeta.min(0))
    mode = int(np.argmax(np.where(inside, apart, -1.0)))
    freq = _listed([f"{plain(w / (2 * np.pi), 4)} Hz" for w in omega[:, mode]], names)
    damping = ", ".join(f"{plain(100 * z, 2)} %" for z in zeta[:, mode])
    parameters = [f"{name} {', '.join(_percent(float(fit.p[i])) for fit in fits)}" for i, name in _parameters(start)]
    own = f"; parameters in the same order: {'; '.join(parameters)}" if parameters else ""
    return f"one resonance is at {freq} (damping {damping}{own})"


def _modes(start: UpdatedModel, fits: Sequence[Fit]) -> tuple[FloatArray, FloatArray]:
    """omega (rad/s) and damping ratios of the modes with unknowns of their own, (n_records, n_modes)."""
    reduced, n = start.null.hypothesis.reduced, start.problem.n_tuned
    modal = [start.problem.modes(reduced, fit.p)[:2] for fit in fits]
    return np.array([w[:n] for w, _ in modal]), np.array([z[:n] for _, z in modal])


def _parameters(start: UpdatedModel) -> list[tuple[int, str]]:
    """Numbers and names of the user's parameters among the unknowns."""
    return [(i, parameter.name) for i, parameter in enumerate(start.reduced.model.parameters)]


def _percent(ln_factor: float) -> str:
    """A factor, given by its logarithm, as what it is above or below 1."""
    off = 100 * float(np.expm1(ln_factor))
    return f"{'+' if off >= 0 else '−'}{plain(abs(off), 2)} %"


def _listed(values: Sequence[str], names: Sequence[str]) -> str:
    """Values with the recording of each."""
    each = [f"{value} in {name}" for value, name in zip(values, names, strict=True)]
    return ", ".join(each[:-1]) + f" and {each[-1]}"
