"""Output-only modes in one call."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData
from femend.errors import RecordingError
from femend.modal.output_only.duration import MIN_PERIODS, refuse_short
from femend.modal.output_only.efdd import efdd_modes
from femend.modal.output_only.harmonics import Harmonic, find_harmonics, remove_harmonics, sweeps
from femend.modal.output_only.judge import judged
from femend.modal.output_only.plscf_modes import plscf_modes
from femend.modal.output_only.prepare import Signals, moving_rows, prepare_signals
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.spectra import spectral_peaks
from femend.modal.output_only.ssi_modes import reference_weights, ssi_modes, ssi_settings
from femend.threads import one_blas_thread

__all__ = ["HARMONICS", "METHODS", "identify_output_only"]

METHODS = ("ssi", "plscf", "efdd")
HARMONICS = ("remove", "flag")


@one_blas_thread
def identify_output_only(
    time_data: TimeData,
    band: tuple[float, float] | None = None,
    method: str = "ssi",
    *,
    references: tuple[str, ...] | None = None,
    speed: float | NDArray[np.float64] | None = None,
    harmonics: str = "remove",
    stationary: bool = True,
    max_order: int = 60,
    max_zeta: float = 0.2,
) -> OutputOnlyModes:
    """Modes of a structure from the responses in `time_data` to an excitation nobody measured.

    `band` (lower, upper) in Hz; without one 0 to 80 % of the Nyquist frequency. `method` is "ssi"
    (covariance-driven stochastic subspace identification, Peeters and De Roeck 1999), "plscf" (poly-reference
    least-squares complex frequency on half spectra, Peeters and Van der Auweraer 2005) or "efdd" (enhanced
    frequency-domain decomposition, Brincker et al. 2001). `references` names the channels that correlations are
    taken with ("ssi" only; principal combinations of all without). `speed` is a rotation speed in Hz, a number or
    (n_samples,): steady rotating harmonics are looked for with or without it, and `harmonics` says whether they are
    taken out of the signals ("remove") or left in and the modes under them marked ("flag"). A speed that runs
    through half the band or more is an excitation, as in a run-up: such a recording is not `stationary` (say so
    where the speed is not known), no harmonics are looked for, and deviations, which come from the scatter between
    stretches, are nan. Model orders go to `max_order` poles, damping ratios to `max_zeta`.

    The excitation is taken to be broad in the band. Shapes come with largest component 1 and no modal mass. Raises
    RecordingTooShortError, with the length needed, for a recording too short for its lowest mode; RecordingError
    for an unknown method or choice, no motion channel with a DOF that moves, a band beyond the sampling or a speed
    that does not fit. Channels that stand still are left out, with a note. That no mode was found is a status with
    advice.
    """
    _check_choice(time_data, "output-only method", method, METHODS)
    _check_choice(time_data, "treatment of harmonics", harmonics, HARMONICS)
    rows = moving_rows(time_data)
    signals = prepare_signals(time_data, band)
    if sweeps(speed, signals.band):
        stationary = False
    found = find_harmonics(time_data, rows, signals.band, speed) if stationary else []
    if found and harmonics == "remove":
        signals = prepare_signals(time_data, band, remove=remove_harmonics(time_data, rows, found, speed))
    lowest = _lowest(signals, found)
    if method == "ssi":
        settings = ssi_settings(signals, lowest, max_order, max_zeta, stationary=stationary)
        estimates = ssi_modes(signals, settings, reference_weights(signals, references))
    elif method == "plscf":
        estimates = plscf_modes(signals, lowest, max_order, max_zeta, stationary=stationary)
    else:
        estimates = efdd_modes(signals, max_zeta)
        estimates = estimates if stationary else estimates.without_deviations()
    return judged(signals, method, estimates, found, harmonics, stationary)


def _check_choice(data: TimeData, what: str, given: str, allowed: tuple[str, ...]) -> None:
    if given not in allowed:
        raise RecordingError(
            f"recording {data.name!r}: {what} {given!r} is none of {', '.join(allowed)}", recording=data.name
        )


def _lowest(signals: Signals, harmonics: list[Harmonic]) -> float:
    """Frequency in Hz of the lowest mode to be expected: the lowest peak of the spectra that is no harmonic; where
    none stands out, a tenth of the upper edge. Raises RecordingTooShortError."""
    low, high = signals.band
    resolution = 10 / signals.duration
    peaks = [
        f
        for f in spectral_peaks(signals.y, signals.dt, signals.band)
        if all(abs(f - h.freq) > resolution for h in harmonics)
    ]
    lowest = float(peaks[0]) if peaks else max(low, high / 10)
    what = "its lowest peak at" if peaks else "an expected lowest mode at"
    refuse_short(signals.name, signals.duration, lowest, MIN_PERIODS / lowest, what)
    return lowest
