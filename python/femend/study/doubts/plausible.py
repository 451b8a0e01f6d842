"""Recordings of a study against its deck as it stands, before anything is fitted: what looks like a mistake in units or
directions is told, since a fit would make a parameter or a missing part of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.analysis.frf import shapes_at
from femend.analysis.model_modes import model_modes
from femend.correlate.doubts import (
    MOVES,
    ROUNDING,
    Doubt,
    exchange_doubts,
    level_doubts,
    misplaced_doubts,
    misread_doubts,
    sign_doubts,
    twice_doubts,
)
from femend.correlate.exchanged import CLEAR, Exchange, Shapes, exchanged, put_right, turned
from femend.correlate.misplaced import misplaced
from femend.correlate.misread import Misread
from femend.data import ModeSet, Recording, Spectra, Test
from femend.diagnose.deciding.too_little import PERIODS
from femend.diagnose.staged.prepare import FrfData, frf_data
from femend.dof import Dof
from femend.errors import FemendError
from femend.model import Model, Pairing
from femend.model.free_body import elastic
from femend.model.reduced.rigid_motion import count_zero, zero_modes
from femend.numerals import plain
from femend.study.doubts.plausible_frequencies import Against, frequency_doubts
from femend.study.doubts.plausible_output import output_doubts, time_axis_doubts
from femend.study.doubts.sampled import too_slow_for_modes

__all__ = ["Doubted", "Doubts", "doubts_found"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# modes of the model up to this multiple of a recording's band, and so many at least: a free body has six of 0 Hz, and
# resonances may be elsewhere
ABOVE, LEAST = 2.0, 30
# share of the values of FRFs that stand clear of their noise where a force has anything to do with the responses: three
# quarters and more on twelve generated cases, none of noise
RELATED = 0.02
# doubts that frequencies which are off do not raise
APART = ("twice", "unrelated", "held", "silent")
# how many times what a sensor shows, noise and all, the model moves there from which it says nothing
SILENT = 5.0
# places of the model, evenly drawn of all, at which a sensor may stand instead
PLACES = 600
# share of the nodes that move without any mass from which a density is thought to be missing
MASSLESS = 0.5


@dataclass(frozen=True, slots=True)
class Doubted:
    """A doubt, and the names of the recordings that raise it."""

    doubt: Doubt
    recordings: tuple[str, ...]

    @property
    def text(self) -> str:
        """How a report says it."""
        first, *others = map(repr, self.recordings)
        also = f" (so in {', '.join(others)})" if others else ""
        return f"recording {first}: {self.doubt.text}{also}"


@dataclass(frozen=True, slots=True)
class Doubts:
    """What is doubtful: sentences `of_model`, and doubts `of_recordings`."""

    of_model: tuple[str, ...] = ()
    of_recordings: tuple[Doubted, ...] = ()

    @property
    def texts(self) -> list[str]:
        """All of it as sentences."""
        return [*self.of_model, *(one.text for one in self.of_recordings)]


def doubts_found(model: Model, test: Test, pairing: Pairing, zeta: float, *, digits: bool = False) -> Doubts:
    """Recordings to be fitted that contradict the `model` as a mistake in units, scales, signs or durations does.

    `zeta` is the damping ratio of its modes. Where the force was not measured (ambient, unknown) it is what the shapes
    say of single sensors, and of a rotor's run whether its sampling reaches the model's modes. Mistaken `digits` of
    parameters are sought in any case, where else only in a model whose shapes explain little."""
    used = [r for r in test if r.role == "fit" and (_measured(r) or _unmeasured(r) or _turning(r))]
    frfs = [_frfs(r) if _measured(r) else None for r in used]
    if not used:
        return Doubts()
    try:
        # of recordings too short for FRFs at least the lowest mode is wanted
        f_max = ABOVE * max((float(d.freq[-1]) for d in frfs if d is not None), default=0.0)
        modes = _modes(model, f_max, zeta)
    except (FemendError, ValueError):
        return Doubts()  # whoever solves the model next says what is wrong with it
    against = {r.name: _of_channels(r, data, modes, pairing) for r, data in zip(used, frfs, strict=True)}
    known = [Against(r, d, against[r.name]) for r, d in zip(used, frfs, strict=True) if d is not None]
    elsewhere = frequency_doubts(model, zeta, modes, pairing, known, digits=digits)
    found: dict[tuple[str, str], tuple[Doubt, list[str]]] = {}
    for recording in used:
        why = [doubt for doubt, names in elsewhere if recording.name in names]
        for doubt in _of_one(recording, modes, against[recording.name], why):
            found.setdefault((doubt.kind, doubt.channel), (doubt, []))[1].append(recording.name)
    of_model = (*_free(model, modes), *_massless(model))
    return Doubts(of_model, tuple(Doubted(doubt, tuple(names)) for doubt, names in found.values()))


def _of_channels(recording: Recording, data: FrfData | None, modes: ModeSet, pairing: Pairing) -> list[Doubt]:
    """Doubts about the channels of a recording, with its FRFs where it has any."""
    if _unmeasured(recording):
        return output_doubts(recording, modes, pairing)
    if _turning(recording):
        slow = too_slow_for_modes(recording, modes.freq)
        return time_axis_doubts(recording, modes, pairing) if slow else []
    return [] if data is None else _against(data, modes, pairing)


def _of_one(recording: Recording, modes: ModeSet, against: Sequence[Doubt], why: Sequence[Doubt]) -> list[Doubt]:
    """Doubts that one recording raises: those `against` its channels, and `why`, about its frequencies."""
    if why:
        # where frequencies are off, levels, signs and durations are by that: the cause is told alone
        return [*why, *(d for d in against if d.kind in APART)]
    slow = [] if any(d.kind == "time axis" for d in against) else [*_short(recording, modes), *_slow(recording, modes)]
    return [*slow, *against]


def _measured(recording: Recording) -> bool:
    return recording.excitation == "measured" and not isinstance(recording.data, Spectra)


def _unmeasured(recording: Recording) -> bool:
    return recording.excitation in ("ambient", "unknown") and recording.is_time


def _turning(recording: Recording) -> bool:
    return recording.excitation == "rotating" and recording.is_time


def _frfs(recording: Recording) -> FrfData | None:
    try:
        return frf_data(recording)
    except FemendError:
        return None  # too short, or of several quantities: nothing to compare


def _modes(model: Model, f_max: float, zeta: float) -> ModeSet:
    found = model_modes(model, n_modes=LEAST, zeta=zeta)
    return found if found.freq[-1] > f_max else model_modes(model, f_max=f_max, zeta=zeta)


def _free(model: Model, modes: ModeSet) -> list[str]:
    """A body is held, or free in all six ways; one that is free in some may have lost a support, one of which parts
    move against each other what connects them."""
    phi = np.real(modes.phi)
    n = count_zero(model, model.matrices()[0], modes.freq, phi)
    return [told] if n and (told := zero_modes(model, phi[:, :n]).text) else []


def _massless(model: Model) -> list[str]:
    """A deck whose materials lost their density has masses where point masses are, and modes of those alone."""
    K, M = model.matrices()
    to_g = abs(model.transformation())
    stiff, heavy = (
        (to_g @ np.abs(a.diagonal()))[: 6 * len(model.node_ids)].reshape(-1, 6)[:, :3].max(axis=1) > 0 for a in (K, M)
    )
    without = int((stiff & ~heavy).sum())
    if without <= MASSLESS * stiff.sum():
        return []
    return [
        f"{without} of the {int(stiff.sum())} nodes that move carry no mass: is the density of a material (RHO of its "
        "MAT card) missing? Where point masses are meant to be all there is, nothing is wrong"
    ]


def _short(recording: Recording, modes: ModeSet) -> list[Doubt]:
    freq = elastic(modes.freq)
    if not recording.is_time or not freq.size:
        return []
    duration, lowest = recording.time.duration, float(freq[0])
    periods = duration * lowest
    if periods >= PERIODS:
        return []
    text = (
        f"{plain(duration, 3)} s are {plain(periods, 2)} periods of the model's lowest mode at {plain(lowest)} Hz, "
        f"which they hardly show: record {plain(PERIODS / lowest, 2)} s or more, or check the time axis"
    )
    return [Doubt("short", "", text)]


def _slow(recording: Recording, modes: ModeSet) -> list[Doubt]:
    who = f"recording {recording.name!r}"
    return [Doubt("slow", "", f"it{text.removeprefix(who)}") for text in too_slow_for_modes(recording, modes.freq)]


def _against(data: FrfData, modes: ModeSet, pairing: Pairing) -> list[Doubt]:
    out, into = (shapes_at(modes, [pairing[d].dof for d in dofs]) for dofs in (data.outputs, data.inputs))
    w, W = 2 * np.pi * data.freq[:, None], 2 * np.pi * modes.freq
    gain = -(w**2) / (W**2 - w**2 + 2j * modes.zeta * W * w)
    H = np.einsum("or,fr,ir->foi", out, gain, into)
    quiet = _unrelated(data) or _silent(data, H)
    # what says nothing is not compared
    told_of = {doubt.channel for doubt in quiet}
    heard = [i for i, dof in enumerate(data.outputs) if str(dof) not in told_of]
    data = replace(data, H=data.H[:, heard], noise=data.noise[:, heard], outputs=tuple(data.outputs[i] for i in heard))
    out, H = out[heard], H[:, heard]
    outputs = [str(d) for d in data.outputs]
    told = twice_doubts(data.H, data.outputs)
    also = [*quiet, *_still(data, out, into)]
    if _unmoved(into).all():
        return [*told, *also]
    shapes = Shapes(modes.freq, modes.zeta, out, into)
    pairs = [] if told else exchanged(data.H, data.noise, data.freq, shapes)
    levels, signs = _levels_and_signs(data, H, put_right(len(outputs), pairs))
    if pairs and any(doubt.kind == "sensor level" for doubt in levels):
        # a sensor in other units moves unlike the model wherever it is
        pairs, (levels, signs) = [], _levels_and_signs(data, H, put_right(len(outputs), []))
    off = [*levels, *signs]
    elsewhere = [] if told else _elsewhere(_without_factors(data, off), shapes, modes, pairing, pairs, off)
    if elsewhere:
        away = {doubt.channel for doubt in elsewhere}
        pairs, (levels, signs) = [], _levels_and_signs(data, H, put_right(len(outputs), []))
        levels, signs = ([d for d in some if d.channel not in away] for some in (levels, signs))
    elif not told:
        signs += _turned(data, shapes, put_right(len(outputs), pairs), [*levels, *signs])
    return [*told, *also, *exchange_doubts(pairs, outputs), *elsewhere, *levels, *signs]


def _without_factors(data: FrfData, told: Sequence[Doubt]) -> FrfData:
    """FRFs with signs that are `told` turned, and sensors that show too much brought down, beside which the others say
    nothing of each other."""
    factor = {d.channel: d.factor or 1.0 for d in told if d.kind in ("sensor level", "sensor sign")}
    off = np.array([factor.get(str(d), 1.0) for d in data.outputs])
    put = np.where((np.abs(off) > 1) | (off < 0), 1 / off, 1.0)[None, :, None]
    return replace(data, H=data.H * put, noise=data.noise * np.abs(put))


def _elsewhere(
    data: FrfData,
    shapes: Shapes,
    modes: ModeSet,
    pairing: Pairing,
    pairs: Sequence[Exchange],
    off: Sequence[Doubt],
) -> list[Doubt]:
    """Doubts about sensors that stand at other nodes than they are said to; none where sensors that were exchanged,
    `pairs`, explain as much. `off` is what is told of levels and signs."""
    own = [pairing[d].dof for d in data.outputs]
    ways = {(d.component, d.sign) for d in own}
    every = [(k, Dof(d.node, *way)) for k, d in enumerate(modes.dofs) for way in ways if way[0] == d.component]
    places = every[:: max(1, -(-len(every) // PLACES))]
    shown = np.array([dof.sign * modes.phi[k] for k, dof in places]).reshape(len(places), -1)
    allowed = np.array([[(p.component, p.sign) == (d.component, d.sign) for _, p in places] for d in own])
    names, n_out = [str(d) for d in data.outputs], len(own)
    scaled = [names.index(doubt.channel) for doubt in off if doubt.channel in names]
    allowed = allowed.reshape(n_out, len(places))
    found = misplaced(data.H, data.noise, data.freq, shapes, shown, allowed, scaled)
    if found and any(-n_out * np.log(max(pair.left, 1e-300)) >= found[0].gain for pair in pairs):
        return []
    return misplaced_doubts(found, names, [str(dof) for _, dof in places])


def _unrelated(data: FrfData) -> list[Doubt]:
    """The doubt about responses that no line of the FRFs shows to follow from their force."""
    share = float((np.abs(data.H) > CLEAR * data.noise).mean())
    if share >= RELATED:
        return []
    text = (
        f"{plain(100 * share, 2)} % of the values of its FRFs stand clear of their noise: the responses hardly follow "
        "from the force; check the table of channels, the cables, and that all channels were recorded together"
    )
    return [Doubt("unrelated", "", text)]


def _silent(data: FrfData, H: ComplexArray) -> list[Doubt]:
    """Doubts about sensors that show noise alone where the model's FRFs `H` are far above it, beside others that show
    what the forces do: a cable or a mount is broken, or a range is wrong."""
    told = []
    for i in range(len(data.outputs)):
        clear = float((np.abs(data.H[:, i]) > CLEAR * data.noise[:, i]).mean())
        shown, model = (float(np.sqrt(np.mean(np.abs(a[:, i]) ** 2))) for a in (data.H, H))
        if clear >= RELATED or model <= SILENT * shown:
            continue
        times = f"{plain(model / shown, 2)} times" if shown > 0 else "without end"
        text = (
            f"the sensor {data.outputs[i]} shows nothing of what the forces do ({plain(100 * clear, 2)} % of the "
            f"values of its FRFs stand clear of their noise), where the deck moves {times} as much: check its cable, "
            "mount and range, unless something holds the structure there"
        )
        told.append(Doubt("silent", str(data.outputs[i]), text))
    return told


def _still(data: FrfData, out: FloatArray, into: FloatArray) -> list[Doubt]:
    """Doubts about sensors that show motion, and forces, at DOFs where no mode of the model moves; `out` (n_out, r) and
    `into` (n_in, r) are the modes there."""
    size = np.sqrt(np.mean(np.abs(data.H) ** 2, axis=(0, 2)))
    told = []
    for i in np.flatnonzero(_unmoved(out) & (size >= MOVES * size.max())):
        text = (
            f"the sensor {data.outputs[i]} shows {plain(100 * size[i] / size.max(), 2)} % of what the one that moves "
            "most does, where no mode of the model moves: check its node and direction, and what the deck holds"
        )
        told.append(Doubt("held", str(data.outputs[i]), text))
    for j in np.flatnonzero(_unmoved(into)):
        text = (
            f"the force {data.inputs[j]} acts where no mode of the model moves: check its node and direction, and what "
            "the deck holds"
        )
        told.append(Doubt("held", str(data.inputs[j]), text))
    return told


def _unmoved(rows: FloatArray) -> NDArray[np.bool_]:
    """Which of the DOFs, whose modes (n, r) are `rows`, stand still but for rounding."""
    size = np.abs(rows).max(axis=1, initial=0.0)
    return np.asarray(size <= ROUNDING * size.max(initial=0.0))


def _turned(data: FrfData, shapes: Shapes, order: list[int], told: Sequence[Doubt]) -> list[Doubt]:
    """Doubts about signs of sensors that phases do not tell, since resonances are off, but shapes do; with the mistakes
    that are `told` taken out."""
    names = [str(d) for d in data.outputs]
    factor = {doubt.channel: doubt.factor or 1.0 for doubt in told if doubt.kind in ("sensor level", "sensor sign")}
    put = np.array([1 / factor.get(name, 1.0) for name in names])[None, :, None]
    found = turned(data.H[:, order] * put, data.noise[:, order] * np.abs(put), data.freq, shapes)
    # what was turned before is right as it is
    return misread_doubts([Misread(i, -1.0, left) for i, left in found if names[i] not in factor], names)


def _levels_and_signs(data: FrfData, H: ComplexArray, order: list[int]) -> tuple[list[Doubt], list[Doubt]]:
    """Doubts about levels and signs of FRFs against the model's `H`, the sensors' recordings in another `order`."""
    outputs, inputs = ([str(d) for d in dofs] for dofs in (data.outputs, data.inputs))
    measured = data.H[:, order]
    clear = np.abs(measured) > CLEAR * data.noise[:, order]
    return level_doubts(measured, H, outputs, clear, data.freq), sign_doubts(measured, H, outputs, inputs, clear)
