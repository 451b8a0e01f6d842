"""What a staged study must not call settled: a rival that explains the modes better and yet too little to be named, and
a place of which not all others were tried."""

from __future__ import annotations

import numpy as np

from femend.diagnose.staged import Flow, Setup
from femend.diagnose.staged.places import places_tried
from femend.diagnose.staged.select import Rival, Round
from femend.diagnose.staged.settings import StagedSettings
from femend.diagnose.staged.stages import Stage
from femend.numerals import plain

__all__ = ["clear_rival", "places_left"]

# ln evidence above the best without a term from which on nothing may be said to be missing no more: odds of twelve to
# one; and by how many times the deviation of a frequency and the form of the model a mode has to be off beside it
CLEARLY, OFF = 2.5, 3.0
# what is tried at nodes
AT_NODES = ("added_mass", "support_stiffness")
# MAC from which on a mode of the model is the identified one
SAME = 0.8


def clear_rival(flow: Flow, settings: StagedSettings) -> str:
    """That a term explains identified modes clearly better than parameters do, where one of them is far off: the term,
    its share and the mode, and what to record; nothing where it is not so."""
    for stage in flow.stages:
        if stage.run is not None or not stage.rounds or not stage.table:
            continue
        best, off = _rival(stage.rounds[-1]), _far_off(stage, settings)
        if best is None or off is None:
            continue
        rival, above = best
        freq, error, times = off
        return (
            f"{rival.label} would explain the modes of {', '.join(stage.recordings)} better than parameters alone (ln "
            f"evidence {plain(above, 2, signed=True)}, {plain(100 * rival.probability, 2)} % of all that was tried), "
            f"which is too little to name it, and the mode at {plain(freq, 3)} Hz is "
            f"{plain(100 * error, 2, signed=True)} % off, {plain(times, 2)} times what its deviation and the form of "
            "the model allow: look there, and "
            "record longer, with more sensors around that place, or a hammer test with its force"
        )
    return ""


def _rival(decision: Round) -> tuple[Rival, float] | None:
    """The best rival with a term where it was not taken and is clearly above the best without, and by how much."""
    without = [r.score for r in decision.rivals if r.term is None]
    best = max(decision.rivals, key=lambda r: r.score)
    if decision.taken is not None or best.term is None or not without or best.score - max(without) < CLEARLY:
        return None
    return best, best.score - max(without)


def _far_off(stage: Stage, settings: StagedSettings) -> tuple[float, float, float] | None:
    """Frequency (Hz) of the mode that is farthest off of those the model has, its relative error, and in how many
    deviations; None where none is `OFF` of them."""
    found = [
        (freq, model / freq - 1, abs(model - freq) / float(np.hypot(sd, settings.model_freq * freq)))
        for freq, _, model, _, mac, sd in stage.table
        if mac >= SAME
    ]
    worst = max(found, key=lambda row: row[2], default=None)
    return None if worst is None or worst[2] < OFF else worst


def places_left(setup: Setup, flow: Flow) -> str:
    """That a mass or spring was not tried at every node of the model, where one is named and it was not."""
    named = [(t, c) for t, _ in flow.named if t.physics in AT_NODES for c in (t.configurations or setup.configurations)]
    for term, configuration in named:
        own, tried, n = places_tried(setup, configuration, [pair.sensor for pair in setup.pairing])
        if len(tried) < n:
            return (
                f"{term.label or term.name}: it was tried at the {len(own)} nodes with sensors and at {len(tried)} of "
                f"{n} others, spread over the structure; it may be at a node between them"
            )
    return ""
