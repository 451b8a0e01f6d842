"""What a stage says in words: what it explains, what it leaves, what its recordings cannot see."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femend.diagnose.staged.prepare import FrfData
from femend.diagnose.staged.select import Round
from femend.diagnose.staged.setup import Setup
from femend.dof import COMPONENTS
from femend.estimate.joint import Posterior
from femend.model.terms.linear_terms import LinearTerm
from femend.numerals import plain

if TYPE_CHECKING:
    from femend.diagnose.staged.loads import RunResult

__all__ = ["remark_on_frfs", "remark_on_modes", "remark_on_run", "unseen_modes"]

# a mode that contributes less than this share of the strongest one to every FRF is not seen by the test
UNSEEN = 0.01


def _decisions(rounds: Sequence[Round]) -> tuple[str, ...]:
    said = []
    for decision in rounds:
        best = decision.rivals[0]
        if decision.taken is not None:
            following = next((r for r in decision.rivals[1:]), None)
            against = (
                f", ln evidence {plain(best.score - following.score, 3)} above {following.label}" if following else ""
            )
            said.append(f"added: {decision.taken.label}{against}")
        elif decision.refused:
            said.append(f"nothing added: {best.label} explains the shapes better, but too little of the run's samples")
        else:
            said.append(f"nothing added: the best rival is {best.label}{_above(decision)}")
    return tuple(said)


def _above(decision: Round) -> str:
    """By how much the best rival is better than none, in words; nothing where none is not among those that are kept."""
    without = [r.score for r in decision.rivals if r.term is None]
    if not without:
        return ""
    return f" (ln evidence {plain(decision.rivals[0].score - max(without), 3, signed=True)})"


def remark_on_frfs(left: float, noise: float, rounds: Sequence[Round]) -> tuple[str, ...]:
    """Share of the FRFs left, and the decisions."""
    clear = "as far as their noise allows" if left < 1.5 * noise else "and more than their noise"
    return (
        *_decisions(rounds),
        f"{plain(100 * left, 2)} % of the FRFs stay unexplained, {clear} ({plain(100 * noise, 2)} %)",
    )


def remark_on_modes(rows: Sequence[tuple[float, ...]], left: float, rounds: Sequence[Round]) -> tuple[str, ...]:
    """Errors of frequencies and shapes, and the decisions."""
    said = [*_decisions(rounds)]
    worst = max(rows, key=lambda r: abs(r[2] / r[0] - 1))
    said.append(
        f"{len(rows)} modes: frequencies {plain(100 * left, 2)} % off in the middle, at most "
        f"{plain(100 * (worst[2] / worst[0] - 1), 2, signed=True)} % (at {plain(worst[0])} Hz), least MAC "
        f"{min(r[4] for r in rows):.3f}"
    )
    return tuple(said)


def remark_on_run(result: RunResult, rounds: Sequence[Round] = ()) -> tuple[str, ...]:
    """The decisions, force law, unbalances, correlation, what stays."""
    n, sd = result.exponent
    U, phase = result.unbalances()
    reliable = result.after.freq[result.after.reliable]
    where = f"{plain(reliable.min(), 3)} to {plain(reliable.max(), 3)} Hz" if reliable.size else "nowhere"
    grow = "bearing forces grow with speed to a power that is not told"
    if np.isfinite(n) and np.isfinite(sd):
        grow = f"bearing forces grow with speed to the power {n:.2f} +- {sd:.2f}"
    said = [
        *_decisions(rounds),
        f"{grow}; reliable on {reliable.size} of {len(result.after.freq)} lines, {where}",
    ]
    n_run, reference = result.data.power
    there = "" if n_run == 2.0 else f", as at {plain(reference)} rev/s (the force grows with Omega^{plain(n_run, 3)})"
    said += [
        f"unbalance at {node}: {plain(u)} at {np.degrees(a):.1f} degrees against the tacho{there}"
        for node, u, a in zip(result.unbalance.nodes, U, phase, strict=True)
    ]
    if result.choice is not None:
        parts = result.choice.parts
        wrong = [part for part in result.choice.left_out if part.reason != "adds nothing"]
        said.append(
            f"sensors and bands: {len(parts) - len(wrong)} of {len(parts)} are credible and above the noise; "
            f"{sum(part.used for part in parts)} of them hold 99 % of what the run tells"
        )
        said += [f"not used: {text}" for text in result.choice.report() if "adds nothing" not in text]
    if result.laws is not None:
        free = result.laws["power"]
        what = {"unbalance": "m r Omega^2", "power": f"Omega^{free.exponent:.2f}", "free": "none with this structure"}
        named = "not decided" if result.laws.best is None else what[result.laws.best]
        said.append(
            f"law of the bearing forces: {named} ({result.laws.reason}); a free power takes {free.exponent:.3f} +- "
            f"{plain(free.sd, 2)}; unseen sensors are predicted to "
            + ", ".join(f"{plain(100 * law.unseen, 2)} % ({what[law.name]})" for law in result.laws.laws)
        )
    value, name = result.correlation
    apart = "can be told apart" if value < 0.95 else "can hardly be told apart"
    said.append(f"unbalance and structure {apart}: largest correlation {value:.2f}, with {name}")
    said.append(
        "the record begins with the machine running"
        if result.onset is None
        else f"the record begins at rest, the force sets in over {plain(result.onset, 2)} s"
    )
    said.append(f"{plain(100 * result.error, 2)} % of the run stays unexplained")
    return tuple(said)


def unseen_modes(
    setup: Setup, configuration: str, terms: Sequence[LinearTerm], posterior: Posterior, frfs: Sequence[FrfData]
) -> tuple[str, ...]:
    """Modes of the model inside the band that no FRF of the test can show, with their frequency."""
    model = setup.model(configuration, posterior.unknowns, terms)
    omega, phi = model.modes(posterior.p)
    freq = omega / (2 * np.pi)
    low, high = min(f.freq[0] for f in frfs), max(f.freq[-1] for f in frfs)
    seen = np.zeros(len(freq))
    for f in frfs:
        out, into = np.abs(setup.rows(model, f.outputs) @ phi), np.abs(setup.rows(model, f.inputs) @ phi)
        seen = np.maximum(seen, out.max(axis=0) * into.max(axis=0))
    inside = (freq > low) & (freq < high)
    said = []
    for i in np.flatnonzero(inside & (seen < UNSEEN * seen[inside].max(initial=0.0))):
        largest = int(np.argmax(np.abs(model.V @ phi[:, i])))
        node, component = int(model.model.node_ids[largest // 6]), COMPONENTS[largest % 6]
        said.append(
            f"the model has a mode at {plain(freq[i])} Hz (largest in {component} at node {node}) that this test "
            "cannot see: no measured pair of DOFs takes part in it; its frequency rests on the model alone"
        )
    return tuple(said)
