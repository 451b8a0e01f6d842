"""One concealed case of a self-test: drawn from seed and number alone, simulated, and written to a folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData
from femend.errors import ConvergenceError
from femend.io import functions_of, write_uff
from femend.io.atomic import write_atomic
from femend.model.places.places import Place, find_places
from femend.selftest.effects import Effect, Here, Spot, Unsuitable, available, draw_effect
from femend.selftest.integrate import ModalTruth, integrate
from femend.selftest.laws import Law
from femend.selftest.plan import Plan, Replay, file_name, study_text
from femend.selftest.truth import Drawn, Truth, changed, channels, draw, modes_of, pick
from femend.selftest.update import Update
from femend.selftest.visible import visible_beside

__all__ = ["CONTROLS", "Case", "label_of", "make_case", "places_of", "write_case"]

FloatArray = NDArray[np.float64]

CONTROLS = ("exact", "parameters", "model_form")
VISIBLE = (3.0, 40.0)  # times the noise, at the recording that shows the effect most
BEYOND = 1.5  # times the noise: what an update should leave of it ...
CARELESS, HIDDEN = 0.15, 4  # ... but in this share of the cases, and where so many draws were all hidden
LOUDEST = 0.8  # share of the motion beyond which nothing is drawn, sensors in units of their noise
FORCE_NOISE = 0.004  # of a force channel's RMS
STEPS_PER_CYCLE, STEPS_ROUGH = 18.0, 8  # time steps per cycle of the band's end; least per sample where a law has kinks
TRIES, REDRAWS = 6, 12


@dataclass(frozen=True, eq=False)
class Case:
    """A case: its label, the responses (n_out, n) by recording without noise, and the truth to be told afterwards."""

    label: str
    responses: dict[str, FloatArray]
    truth: dict[str, Any]


def places_of(plan: Plan) -> dict[str, list[Place]]:
    """The places of the user's model where something may be left out, by kind; to ground only where things attach."""
    out: dict[str, list[Place]] = {}
    for place in find_places(plan.model):
        if not place.unlikely:
            out.setdefault(place.kind, []).append(place)
    return out


def label_of(places: dict[str, list[Place]], seed: int, index: int) -> str:
    """What case `index` (from 0) of a seed conceals: an effect, or "none:" and the kind of control.

    Cases come in shuffled blocks that hold every effect once and half as many controls.
    """
    names = available(places)
    size = len(names) + len(names) // 2
    block = index // size
    rng = np.random.default_rng([seed, 77, block])
    controls = [f"none:{CONTROLS[(block * (len(names) // 2) + k) % 3]}" for k in range(len(names) // 2)]
    return str((names + controls)[int(rng.permutation(size)[index % size])])


def make_case(plan: Plan, places: dict[str, list[Place]], seed: int, index: int) -> Case:
    """Case `index` (from 0) of a seed.

    Raises ConvergenceError where no place and strength could be found that the sensors would see.
    """
    label = label_of(places, seed, index)
    rng = np.random.default_rng([seed, 78, index])
    if label.startswith("none:"):
        control = label.removeprefix("none:")
        drawn = draw(rng, plan, control)
        truth = modes_of(rng, plan, drawn, _patterns(plan), form=control != "exact")
        told = {"effect": "none", "control": control, "nodes": [], "visibility": 0.0}
        told["visibility_beyond_update"] = 0.0
        return Case(label, {r.name: _respond(plan, truth, r, None) for r in plan.replays}, told | _about(drawn))
    return _with_effect(plan, places, rng, label, index)


def _with_effect(plan: Plan, places: dict[str, list[Place]], rng: np.random.Generator, label: str, index: int) -> Case:
    """A case with an effect: the first draw that an update could not hide, in a few cases the first that is visible,
    and where several draws were all hidden the one that was least so.
    """
    reason = ""
    hidden: list[tuple[float, Case]] = []
    careless = rng.random() < CARELESS
    for _ in range(REDRAWS):
        drawn = draw(rng, plan)
        try:
            effect, x, responses, seen, beyond = _visible(rng, plan, drawn, places, label)
        except (Unsuitable, ConvergenceError) as error:
            reason = str(error)
            continue
        told: dict[str, Any] = {
            "effect": label,
            "control": "",
            "nodes": list(effect.nodes),
            "direction": effect.direction,
        }
        told |= {"to": effect.to, "parameters": _plain(effect.values(x)), "visibility": seen}
        told["visibility_beyond_update"] = beyond
        hidden.append((beyond, Case(label, responses, told | _about(drawn))))
        if careless or beyond > BEYOND or len(hidden) == HIDDEN:
            return max(hidden, key=lambda one: one[0])[1]
    if hidden:
        return max(hidden, key=lambda one: one[0])[1]
    raise ConvergenceError(
        f"case {index + 1}: no place of {label} in {REDRAWS} draws could be seen by the sensors ({reason})"
    )


def _about(drawn: Drawn) -> dict[str, Any]:
    return {"factors": {name: round(f, 6) for name, f in drawn.factors.items()}}


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Values for JSON: no infinities."""
    return {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in values.items()}


def _patterns(plan: Plan) -> list[FloatArray]:
    """Directions of the forces of all recordings on the g-set, once each."""
    rows = sorted({int(r) for replay in plan.replays for r in replay.in_rows})
    return [pick(plan.model, [r], [1.0]) for r in rows]


def _visible(
    rng: np.random.Generator, plan: Plan, drawn: Drawn, places: dict[str, list[Place]], label: str
) -> tuple[Effect, float, dict[str, FloatArray], float, float]:
    """Effect, strength, responses, visibility and what of it an update leaves, of one draw; raises Unsuitable where it
    cannot be seen.
    """
    state = rng.bit_generator.state  # the same frequencies and dampings with and without the effect
    plain = modes_of(rng, plan, drawn, _patterns(plan))
    loud = plan.loudest
    base = _respond(plan, plain, loud, None)
    effect = draw_effect(rng, _here(plan, plain, drawn, places, loud), label)
    visible = visible_beside(base, loud)
    goal = float(np.exp(rng.uniform(*np.log(VISIBLE))))
    goal = min(goal, LOUDEST * visible.size)

    def at(x: float, replay: Replay) -> FloatArray:
        return _with(plan, plain, drawn, effect, x, replay, state)

    x, seen = _strength(effect, goal, lambda x: visible.times(at(x, loud) - base))
    met = seen > 1.5 and visible.share(seen) < 2 * LOUDEST if effect.fixed else 0.4 * goal < seen < 2.5 * goal
    if not met:
        raise Unsuitable(f"seen at {seen:.1f} times the noise")
    responses = {r.name: at(x, r) for r in plan.replays}
    update = Update(plan, drawn, plain, visible.replay(loud), _over(plan, loud, rough=False))
    return effect, x, responses, seen, visible.of_moving(update.left(responses[loud.name] - base))


def _rms(y: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.sqrt(np.mean(y**2, axis=1)), 1e-300))


def _strength(effect: Effect, goal: float, seen: Any) -> tuple[float, float]:
    """Strength at which the effect is seen at about `goal`: secants on logarithms, inside the effect's span."""
    if effect.fixed:
        return 1.0, seen(1.0)
    low, high = effect.span
    x = float(np.sqrt(low * high))
    best, last = (x, 0.0), None
    for _ in range(TRIES):
        try:
            v = seen(x)
        except ConvergenceError:
            high = x
            x = float(np.sqrt(low * x))
            continue
        if best[1] == 0.0 or abs(np.log(max(v, 1e-12) / goal)) < abs(np.log(best[1] / goal)):
            best = (x, max(v, 1e-12))
        if abs(np.log(max(v, 1e-12) / goal)) < 0.25:
            break
        slope = 1.0
        if last is not None and abs(np.log(x / last[0])) > 1e-6:
            slope = float(np.clip(np.log(max(v, 1e-12) / max(last[1], 1e-12)) / np.log(x / last[0]), 0.3, 4.0))
        last = (x, v)
        moved = float(np.clip(np.log(goal / max(v, 1e-12)) / slope, -2.3, 2.3))
        x = float(np.clip(x * np.exp(moved), low, high))
        if x == last[0]:
            break
    return best


def _here(plan: Plan, truth: Truth, drawn: Drawn, places: dict[str, list[Place]], loud: Replay) -> Here:
    """The motion of the truth without effect at the loudest recording, place by place."""
    inputs, _ = channels(plan, truth, loud)
    band = (2 * np.pi * plan.band[0], 2 * np.pi * plan.band[1])
    inside = truth.omega < band[1]
    if not inside.any():
        raise Unsuitable("the truth has no mode in the band")
    size = np.linalg.norm(inputs, axis=0) / (truth.omega**1.5 * np.sqrt(truth.zeta))
    r = np.arange(len(truth.omega))
    q = ModalTruth(truth.omega, truth.zeta, inputs, np.eye(len(r)), np.zeros(len(r), dtype=np.int64))
    motion = _rms(integrate(q, loud.u, loud.dt, _over(plan, loud, rough=False)))

    def look(place: Place) -> Spot:
        g = np.zeros(int(plan.model.fe.n_g))
        for rows, values in zip(place.g_rows, place.g_values, strict=True):
            np.add.at(g, rows, values)
        w = truth.shape(g)
        d = float(np.sqrt(np.sum((w * motion)[inside] ** 2)))
        v = float(np.sqrt(np.sum((w * motion * truth.omega)[inside] ** 2)))
        share = np.where(inside, np.abs(w) * size, 0.0)
        if v == 0.0 or not share.sum():
            raise Unsuitable("does not move")
        return Spot(place, g, d, v, truth.stiffness(g), share)

    forces = tuple((int(r), int(s)) for r, s in zip(loud.in_rows, loud.in_signs, strict=True))
    return Here(plan.model, drawn, places, _moving_mass(plan, drawn, truth), band, truth.omega, forces, look)


def _moving_mass(plan: Plan, drawn: Drawn, truth: Truth) -> float:
    """Mass that moves, kg: that of the free nodes in the direction in which most of it is free."""
    masses = []
    for c in range(3):
        shift = np.zeros(int(plan.model.fe.n_g))
        shift[c::6] = 1.0
        a = np.asarray(truth.T.T @ shift)
        a /= np.maximum(np.asarray(truth.T.multiply(truth.T).sum(axis=0)).ravel(), 1.0)
        masses.append(float(a @ (drawn.M @ a)))
    return max(masses)


def _with(
    plan: Plan, plain: Truth, drawn: Drawn, effect: Effect, x: float, replay: Replay, state: Any
) -> FloatArray:  # fmt: skip
    """Responses of a recording with the effect at strength x."""
    if effect.change is None:
        truth = _fine(plan, drawn, effect, state) if effect.g is not None else plain
    else:
        again = np.random.default_rng()
        again.bit_generator.state = state
        truth = modes_of(again, plan, changed(drawn, *effect.change(x)), _patterns(plan))
    return _respond(plan, truth, replay, effect, x)


def _fine(plan: Plan, drawn: Drawn, effect: Effect, state: Any) -> Truth:
    """The truth with the static answer to the effect's direction in its basis; solved for once an effect."""
    kept: Truth | None = effect.note.get("truth")
    if kept is None:
        again = np.random.default_rng()
        again.bit_generator.state = state
        kept = effect.note["truth"] = modes_of(again, plan, drawn, [*_patterns(plan), np.asarray(effect.g)])
    return kept


def _over(plan: Plan, replay: Replay, *, rough: bool) -> int:
    steps = int(np.ceil(STEPS_PER_CYCLE * plan.band[1] * replay.dt))
    return max(steps, STEPS_ROUGH if rough else 2)


def _respond(plan: Plan, truth: Truth, replay: Replay, effect: Effect | None, x: float = 0.0) -> FloatArray:
    """Responses (n_out, n) of the sensors, in their own quantities."""
    inputs, outputs = channels(plan, truth, replay)
    u = replay.u
    law: Law | None = None
    shape = None
    if effect is not None and effect.g is not None:
        w = truth.shape(effect.g)
        if effect.law is not None:
            law, shape = effect.law(x), w
        elif effect.moved:
            inputs = np.vstack([w, inputs[1:]])
        elif effect.extra:
            inputs, u = np.vstack([inputs, w]), np.vstack([u, x * _unrecorded(plan, replay, effect)])
    modal = ModalTruth(truth.omega, truth.zeta, inputs, outputs, replay.order, shape)
    return integrate(modal, u, replay.dt, _over(plan, replay, rough=effect is not None and effect.rough), law)


def _unrecorded(plan: Plan, replay: Replay, effect: Effect) -> FloatArray:
    """A force of RMS 1 that is the same in every recording: a sine, or noise in the band."""
    n = replay.u.shape[1]
    t = replay.dt * np.arange(n)
    if effect.frequency is not None:
        return np.asarray(np.sqrt(2.0) * np.sin(2 * np.pi * effect.frequency * t))
    freq = np.fft.rfftfreq(n, replay.dt)
    rng = np.random.default_rng(int(effect.nodes[0]))
    line = rng.standard_normal((2, freq.size)) * ((freq > plan.band[0]) & (freq < plan.band[1]))
    force = np.fft.irfft(line[0] + 1j * line[1], n)
    return np.asarray(force / max(float(force.std()), 1e-300))


def write_case(plan: Plan, case: Case, folder: Path, seed: int, index: int) -> Path:
    """Writes the recordings with noise, study.toml and truth.json of a case to `folder`; the path of the study."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, 79, index])
    for replay in plan.replays:
        u = replay.u + FORCE_NOISE * _rms(replay.u)[:, None] * rng.standard_normal(replay.u.shape)
        y = case.responses[replay.name]
        y = y + replay.noise[:, None] * rng.standard_normal(y.shape)
        data = TimeData(replay.name, replay.dt, np.vstack([u, y]), (*replay.forces, *replay.sensors))
        write_uff(folder / file_name(plan, replay), functions_of(data))
    write_atomic(folder / "truth.json", json.dumps(case.truth | {"seed": seed, "index": index}, indent=1))
    study = folder / "study.toml"
    write_atomic(study, study_text(plan, f"self-test case {index + 1}", folder))
    return study
