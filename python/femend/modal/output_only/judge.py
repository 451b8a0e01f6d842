"""What to make of the modes an identification found: flags, status, advice."""

from __future__ import annotations

import numpy as np

from femend.data import IdentifiedModes
from femend.modal.output_only.duration import WORST_ZETA_COV, needed_duration, refuse_short
from femend.modal.output_only.harmonics import Harmonic
from femend.modal.output_only.prepare import Signals
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.spectra import clear_peaks
from femend.modal.output_only.ssi_modes import ModeEstimates
from femend.numerals import plain

__all__ = ["judged"]

# Damping is what a recording tells least; this is the coefficient of variation that advice on its length aims at.
GOOD_ZETA_COV = 0.2
# Assumed where a damping ratio is not known, to say how long a recording must be.
TYPICAL_ZETA = 0.01
NOT_STATIONARY = (
    "the excitation is not stationary: stretches of the recording are no repetitions of each other, and no standard "
    "deviations can be given"
)


def judged(
    signals: Signals,
    method: str,
    found: ModeEstimates,
    harmonics: list[Harmonic],
    treatment: str,
    stationary: bool,
) -> OutputOnlyModes:
    """The result: modes `found` in `signals` by `method`, with what speaks against each; `harmonics` were treated as
    `treatment` says; `stationary` says whether the excitation was. Raises RecordingTooShortError for a recording too
    short for its lowest mode."""
    rank = np.argsort(np.abs(found.poles), kind="stable")
    modes = IdentifiedModes(signals.dofs, found.poles, found.shapes, freq_sd=found.freq_sd, zeta_sd=found.zeta_sd)
    covered = np.array([_cover(modes, i, harmonics) is not None for i in range(modes.n_modes)], dtype=bool)
    structural = np.flatnonzero(~covered)
    if structural.size:
        freq, zeta = float(modes.freq[structural[0]]), float(modes.zeta[structural[0]])
        # Of a damping ratio from a short record only a high one is believed; the length asked for allows a lower one.
        if signals.duration < needed_duration(freq, max(zeta, TYPICAL_ZETA)):
            needed = needed_duration(freq, TYPICAL_ZETA)
            refuse_short(signals.name, signals.duration, freq, needed, "its lowest mode at")
    missed = _missed(signals, modes, harmonics) if stationary else []
    if missed and (not structural.size or missed[0] < modes.freq[structural[0]]):
        needed = needed_duration(missed[0], TYPICAL_ZETA)
        refuse_short(signals.name, signals.duration, missed[0], needed, "a spectral peak that gave no mode, at")
    flags = tuple(_flags(signals, modes, i, harmonics, treatment) for i in range(modes.n_modes))
    return OutputOnlyModes(
        signals.name,
        method,
        signals.band,
        signals.duration,
        modes,
        found.shape_sd[:, rank],
        found.support[rank],
        flags,
        covered if treatment == "flag" else np.zeros(modes.n_modes, dtype=bool),
        "no modes" if not modes.n_modes else "doubtful" if any(flags) or missed else "ok",
        _advice(signals, modes, flags, missed, _max_order(found)),
        (*signals.notes, *_harmonic_notes(harmonics, treatment), *(() if stationary else (NOT_STATIONARY,))),
        tuple(harmonics),
        found.stabilisation,
    )


def _cover(modes: IdentifiedModes, i: int, harmonics: list[Harmonic]) -> Harmonic | None:
    """The harmonic that mode `i` cannot be told from: within its width and two deviations of the frequency."""
    assert modes.freq_sd is not None
    reach = 2 * float(np.nan_to_num(modes.freq_sd[i]))
    near = [h for h in harmonics if abs(h.freq - modes.freq[i]) <= h.width + reach]
    return min(near, key=lambda h: abs(h.freq - modes.freq[i])) if near else None


def _flags(signals: Signals, modes: IdentifiedModes, i: int, harmonics: list[Harmonic], treatment: str) -> str:
    assert modes.freq_sd is not None
    assert modes.zeta_sd is not None
    said = []
    freq, zeta, zeta_sd = float(modes.freq[i]), float(modes.zeta[i]), float(modes.zeta_sd[i])
    near = _cover(modes, i, harmonics)
    if near is not None:
        order = "" if np.isnan(near.order) else f" (order {plain(near.order, 3)})"
        what = "taken out here" if treatment == "remove" else "here: this is it, or a mode under it"
        said.append(f"a rotating harmonic at {near.freq:.5g} Hz{order} was {what}")
    if zeta_sd > WORST_ZETA_COV * zeta:
        share, share_sd = plain(100 * zeta, 2), plain(100 * zeta_sd, 2)
        said.append(f"damping {share} % is known to {share_sd} % only; the mode may be none")
    edge = min(abs(freq - signals.band[0]), abs(signals.band[1] - freq))
    if edge < max(zeta * freq, 2 * float(modes.freq_sd[i])):
        said.append(f"within its own bandwidth of the band's edge; widen the band {signals.band} Hz")
    return "; ".join(said)


def _max_order(found: ModeEstimates) -> int:
    """The highest model order, 0 where there are no orders."""
    return 0 if found.stabilisation is None else int(found.stabilisation.orders.max(initial=0))


def _advice(
    signals: Signals, modes: IdentifiedModes, flags: tuple[str, ...], missed: list[float], max_order: int
) -> tuple[str, ...]:
    said = []
    if not modes.n_modes:
        said.append(
            f"no mode stands in {plain(signals.band[0])} to {plain(signals.band[1])} Hz: every pole is less certain "
            f"than its own bandwidth; record longer than {plain(signals.duration)} s, move sensors off the nodes, or "
            "look at the spectra for a structural peak"
        )
    if missed:
        listed = ", ".join(plain(f) for f in missed)
        said.append(
            f"the spectra peak at {listed} Hz, where no mode was found: a mode too weak, too short recorded or beyond "
            "max_order, or a narrow-band excitation"
        )
    if modes.n_modes * 4 > max_order > 0:
        said.append(
            f"{modes.n_modes} modes take at least {2 * modes.n_modes} of the {max_order} poles of the highest order, "
            "and more to be stable: raise max_order, or identify narrower bands one after the other"
        )
    longest = [needed_duration(float(f), float(z), GOOD_ZETA_COV) for f, z in zip(modes.freq, modes.zeta)]
    worst = int(np.argmax(longest)) if longest else 0
    if longest and longest[worst] > signals.duration and any("damping" in flag for flag in flags):
        said.append(
            f"for damping within {100 * GOOD_ZETA_COV:.0f} % of the mode at {plain(modes.freq[worst])} Hz record at "
            f"least {plain(longest[worst])} s (now {plain(signals.duration)} s)"
        )
    return tuple(said)


def _harmonic_notes(harmonics: list[Harmonic], treatment: str) -> tuple[str, ...]:
    done = "taken out" if treatment == "remove" else "left in"
    return tuple(
        f"rotating harmonic at {h.freq:.5g} Hz"
        + ("" if np.isnan(h.order) else f" (order {plain(h.order, 3)})")
        + f", kurtosis {h.kurtosis:.2f}: {done}"
        for h in harmonics
    )


def _missed(signals: Signals, modes: IdentifiedModes, harmonics: list[Harmonic]) -> list[float]:
    """Peaks of the spectra in Hz that no scatter, mode or harmonic explains, as far as the spectra resolve."""
    resolution = 10 / signals.duration
    known = [(float(f), max(float(z * f), resolution)) for f, z in zip(modes.freq, modes.zeta)]
    known += [(h.freq, resolution) for h in harmonics]
    peaks = clear_peaks(signals.y, signals.dt, signals.band)
    return [float(p) for p in peaks if all(abs(p - f) > width for f, width in known)]
