"""What a run leaves: terms that act with the speed, and those that only its operating shapes show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.staged.candidates import rivals, speed_rivals
from femend.diagnose.staged.loads import RunResult, ods_width, predicted_ods, shapes_block, unbalance_scale
from femend.diagnose.staged.places import elsewhere
from femend.diagnose.staged.select import Round, select_terms
from femend.diagnose.staged.setup import Setup
from femend.estimate.joint import OdsFrf, Posterior, ods_frf, unbalance_unknowns
from femend.model.terms.linear_terms import LinearTerm

__all__ = ["terms_of_run"]

# squares per value of the operating shapes, in noise and form, from which on something is looked for: 0.27 and 0.32 on
# rigs that lack nothing (calibration seed 41 of `tests/blind/rotor_cases.py`), 0.53 and more where something acts
LOOK = 0.5


def terms_of_run(
    setup: Setup,
    configuration: str,
    result: RunResult,
    terms: Sequence[LinearTerm],
    before: Posterior | None,
    fit: Callable[..., RunResult],
    *,
    only_here: bool,
) -> tuple[list[LinearTerm], RunResult, list[Round]]:
    """Terms with which the operating shapes of a run are explained, where `result` without them leaves more than noise.

    Rivals are those of every stage and those that act with the speed. They are held against each other on the shapes
    over frequency, each with the unbalances free; `fit(terms=terms, start=p)` fits the run itself with the one taken,
    from where the shapes put it, and the term stays only if the samples of the run are explained better too. Returns
    the terms, the run's result with them, and the decisions.
    """
    chosen, rounds = list(terms), []
    for _ in range(setup.settings.rounds):
        shapes = _held_shapes(setup, result)
        if _left(setup, result, shapes) < LOOK:
            break
        found = _one_more(setup, configuration, result, shapes, chosen, before, only_here)
        rounds += found[2]
        if len(found[0]) == len(chosen):
            break
        grown = fit(terms=found[0], start=found[1].p)
        if not _better(setup, result, grown):
            rounds[-1] = replace(rounds[-1], taken=None, refused=True)
            break
        chosen, result = found[0], grown
    return chosen, result, rounds


def _one_more(
    setup: Setup,
    configuration: str,
    result: RunResult,
    shapes: OdsFrf,
    terms: Sequence[LinearTerm],
    before: Posterior | None,
    only_here: bool,
) -> tuple[list[LinearTerm], Posterior, list[Round]]:
    """Terms with the best rival behind them where it is better than none, the posterior, and the decision."""
    data = result.data
    top = 2 * np.pi * float(data.rev_per_s.max())
    return select_terms(
        setup, configuration, terms, before,
        lambda model: [shapes_block(setup, data, model, shapes, result.unbalance, setup.settings.weight_frf)],
        lambda taken: (
            *rivals(setup, configuration, data.sensors, taken, only_here=only_here),
            *speed_rivals(setup, data.nodes, data.axis, top, taken),
        ),
        more=unbalance_unknowns(result.unbalance, unbalance_scale(setup, data), data.step),
        start=result.posterior, rounds=1,
        elsewhere=lambda taken: elsewhere(setup, configuration, data.sensors, taken, only_here=only_here),
    )  # fmt: skip


def _better(setup: Setup, without: RunResult, grown: RunResult) -> bool:
    """Does the term explain samples of the run too, and the share asked for of what they leave above the noise? At a
    wrong place a term takes a little of everything."""
    s, name = setup.settings, without.data.name
    before, after = (result.posterior.squares[name] for result in (without, grown))
    sd = without.data.block(setup, without.model, without.unbalance).sd
    noise = s.weight_run * float(((without.data.noise[:, None] / sd) ** 2).sum())
    return before - after > max(s.drop * before, s.share * (before - noise))


def _held_shapes(setup: Setup, result: RunResult) -> OdsFrf:
    """The run's operating shapes as they were had every line been held at its own speed.

    What the fitted model says of the run, taken through the same estimate, over what it says of held lines is what
    the sweep and the estimate do to shapes.
    """
    data, shapes, model = result.data, result.shapes, result.model
    estimated = ods_frf(data.run, result.predicted, shapes.freq, ods_width(data)).Y
    held = predicted_ods(setup, data, model, result.posterior.p, result.unbalance, shapes.freq)
    return replace(shapes, Y=shapes.Y - estimated + held)


def _left(setup: Setup, result: RunResult, shapes: OdsFrf) -> float:
    """Squares per value that the fitted run leaves of its operating shapes."""
    block = shapes_block(setup, result.data, result.model, shapes, result.unbalance)
    return block.gauss_newton(result.posterior.p, False)[0] / block.n_values
