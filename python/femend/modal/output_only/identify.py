"""Output-only modes in one call."""

from __future__ import annotations

import numpy as np

from femend.data import IdentifiedModes, TimeData
from femend.errors import RecordingError
from femend.modal.output_only.duration import MIN_PERIODS, needed_duration, refuse_short
from femend.modal.output_only.efdd import efdd_modes
from femend.modal.output_only.plscf_modes import plscf_modes
from femend.modal.output_only.prepare import Signals, prepare_signals
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.spectra import spectral_peaks
from femend.modal.output_only.ssi_modes import ModeEstimates, ssi_modes, ssi_settings

__all__ = ["identify_output_only"]

METHODS = ("ssi", "plscf", "efdd")


def identify_output_only(
    time_data: TimeData,
    band: tuple[float, float] | None = None,
    method: str = "ssi",
    *,
    max_order: int = 60,
    max_zeta: float = 0.2,
) -> OutputOnlyModes:
    """Modes of a structure from the responses in `time_data` to an excitation nobody measured.

    `band` (lower, upper) in Hz, 0 to 80 % of the Nyquist frequency without; `method` "ssi" (covariance-driven
    stochastic subspace identification). Model orders go to `max_order`, damping ratios to `max_zeta`. The excitation
    is taken to be broad in the band. Raises RecordingTooShortError, with the length needed, for a recording too short
    for its lowest mode; RecordingError for an unknown method, no motion channel with a DOF, a dead channel, or a band
    beyond the sampling. That no mode was found is a status with advice.
    """
    if method not in METHODS:
        raise RecordingError(
            f"recording {time_data.name!r}: output-only method {method!r} is none of {', '.join(METHODS)}",
            recording=time_data.name,
        )
    signals = prepare_signals(time_data, band)
    lowest = _lowest(signals)
    if method == "ssi":
        found = ssi_modes(signals, ssi_settings(signals, lowest, max_order, max_zeta))
    elif method == "plscf":
        found = plscf_modes(signals, lowest, max_order, max_zeta)
    else:
        found = efdd_modes(signals, max_zeta)
    return _result(signals, method, found)


def _lowest(signals: Signals) -> float:
    """Frequency in Hz of the lowest mode to be expected: the lowest peak of the spectra, not below the band; where
    none stands out, a tenth of the upper edge. Raises RecordingTooShortError."""
    low, high = signals.band
    peaks = spectral_peaks(signals.y, signals.dt, signals.band)
    lowest = float(max(peaks[0], low)) if peaks.size else max(low, high / 10)
    what = "its lowest peak at" if peaks.size and peaks[0] >= low else "the lower band edge"
    refuse_short(signals.name, signals.duration, lowest, MIN_PERIODS / lowest, what)
    return lowest


def _result(signals: Signals, method: str, found: ModeEstimates) -> OutputOnlyModes:
    if found.poles.size:
        size = np.abs(found.poles)
        first = int(np.argmin(size))
        freq, zeta = float(size[first]) / (2 * np.pi), float(-found.poles[first].real / size[first])
        refuse_short(signals.name, signals.duration, freq, needed_duration(freq, zeta), "its lowest mode at")
    rank = np.argsort(np.abs(found.poles), kind="stable")
    modes = IdentifiedModes(
        signals.dofs, found.poles, found.shapes, freq_sd=found.freq_sd, zeta_sd=found.zeta_sd, scaling="unscaled"
    )
    return OutputOnlyModes(
        signals.name,
        method,
        signals.band,
        signals.duration,
        modes,
        found.shape_sd[:, rank],
        found.support[rank],
        ("",) * rank.size,
        np.zeros(rank.size, dtype=bool),
        "ok" if rank.size else "no modes",
        (),
        signals.notes,
        found.stabilisation,
    )
