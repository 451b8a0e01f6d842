"""Rotating harmonics in responses: found by what a sine is and a resonance is not, named by the tacho, taken out.

Three signs, all of which a steady sine shows and a structural mode in broad excitation does not:

- *peak width*: one line of the spectrum of the whole recording stands out of its neighbours as broad excitation does
  with a probability below FALSE_ALARM (Fisher, Tests of significance in harmonic analysis, Proc. R. Soc. A 125 (1929)
  54-59: a line over the local mean exceeds g with probability exp(-g));
- *one sine explains it*: with the best single sine taken out, what is left there is no longer significant;
- *kurtosis* of the signal around the line: 1.5 for a sine, 3 for a Gaussian signal (Jacobsen, Andersen and Brincker,
  Eliminating the influence of harmonic components in operational modal analysis, IMAC (2007)); a sine must hold more
  than half of the scatter's way, kurtosis below 2.25.

With a rotation speed the harmonic gets its order; orders are also looked for where the speed varies, in the recording
resampled to equal angles, where an order is a line again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from femend.data import TimeData
from femend.data.bands import within_band
from femend.errors import RecordingError
from femend.numerals import plain

__all__ = ["Harmonic", "find_harmonics", "remove_harmonics", "sweeps"]

FALSE_ALARM = 1e-4
MIDWAY_KURTOSIS = 2.25
# Half width in lines of the neighbourhood that a line is compared with and its kurtosis is taken from.
NEIGHBOURS = 20


@dataclass(frozen=True, slots=True)
class Harmonic:
    """A steady rotating component: `freq` in Hz (mean over the recording), `order` of the rotation speed (nan without
    one), `level` its rms over all channels in their units, `ratio` of its line to the local mean, `kurtosis` of the
    signal around it, `width` in Hz within which a mode cannot be told from it."""

    freq: float
    order: float
    level: float
    ratio: float
    kurtosis: float
    width: float

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; an order that is not known is None."""
        order = None if np.isnan(self.order) else self.order
        return {
            "freq": self.freq,
            "order": order,
            "level": self.level,
            "ratio": self.ratio,
            "kurtosis": self.kurtosis,
            "width": self.width,
        }


def find_harmonics(
    data: TimeData,
    rows: list[int],
    band: tuple[float, float],
    speed: float | NDArray[np.float64] | None = None,
) -> list[Harmonic]:
    """Harmonics in the channels `rows` of `data` inside `band` (Hz), in order of frequency.

    `speed` is the rotation frequency in Hz, a number or one value per sample (n_samples,), such as a tacho gives.
    Raises RecordingError for a speed of another length or one that is not positive.
    """
    y = data.values[rows] - data.values[rows].mean(axis=1, keepdims=True)
    steps, mean_speed = _angle_steps(data, speed)
    if steps is not None:
        y = _resampled(y, steps)
    found = _lines(y / y.std(axis=1, keepdims=True), 1.0 / y.shape[1], data.duration, band)
    harmonics = []
    for cycles, ratio, kurtosis in found:
        freq = cycles / data.duration
        level = np.sqrt((np.abs(_amplitudes(y, cycles)) ** 2).sum() / 2)
        order = freq / mean_speed if mean_speed is not None else np.nan
        harmonics.append(Harmonic(freq, order, float(level), ratio, kurtosis, 2.0 / data.duration))
    return harmonics


def remove_harmonics(
    data: TimeData, rows: list[int], harmonics: list[Harmonic], speed: float | NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """The part (n_ch, n_samples) of `data` that the `harmonics` make in its channels `rows`; other rows are zero.

    Each is one sine of constant amplitude and phase (against the angle where `speed` varies), by least squares of all
    together. Raises RecordingError for a speed that `find_harmonics` refuses.
    """
    part = np.zeros_like(data.values)
    if not harmonics:
        return part
    steps, _ = _angle_steps(data, speed)
    cycle = np.arange(data.n_samples) / data.n_samples if steps is None else steps
    columns = [np.exp(2j * np.pi * h.freq * data.duration * cycle) for h in harmonics]
    basis = np.concatenate([[c.real, c.imag] for c in columns]).T
    y = data.values[rows] - data.values[rows].mean(axis=1, keepdims=True)
    part[rows] = (basis @ np.linalg.lstsq(basis, y.T, rcond=None)[0]).T
    return part


def sweeps(speed: float | NDArray[np.float64] | None, band: tuple[float, float]) -> bool:
    """True where the rotation `speed` (Hz, a number or (n_samples,)) runs through half the `band` (Hz) or more: its
    first order is then the excitation, and the recording is not stationary.

    >>> sweeps(np.array([2.0, 12.0]), (3.0, 15.0)), sweeps(10.0, (3.0, 15.0))
    (True, False)
    """
    if speed is None:
        return False
    values = np.asarray(speed, dtype=np.float64)
    covered = min(float(values.max()), band[1]) - max(float(values.min()), band[0])
    return bool(covered >= 0.5 * (band[1] - band[0]))


def _angle_steps(
    data: TimeData, speed: float | NDArray[np.float64] | None
) -> tuple[NDArray[np.float64] | None, float | None]:
    """Angle of the shaft at each sample over that of the whole recording (n_samples,), None where the speed does not
    vary by a line, and the mean speed in Hz."""
    if speed is None:
        return None, None
    values = np.asarray(speed, dtype=np.float64)
    if values.ndim == 0:
        values = np.full(data.n_samples, float(values))
    if values.shape != (data.n_samples,) or not np.isfinite(values).all() or values.min() <= 0:
        raise RecordingError(
            f"recording {data.name!r}: the rotation speed has shape {values.shape} and a least value of "
            f"{plain(values.min(initial=np.inf))} Hz; give a positive value (Hz) for each of {data.n_samples} samples",
            recording=data.name,
        )
    mean = float(values.mean())
    if np.ptp(values) * data.duration < 0.5:
        return None, mean
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    return angle / (angle[-1] + values[-1]), mean


def _resampled(y: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """`y` (n_ch, n_samples) at equal angles, by linear interpolation of an angle that grows steadily."""
    at = np.interp(np.arange(steps.size) / steps.size, steps, np.arange(steps.size))
    return np.stack([ndimage.map_coordinates(row, [at], order=3, mode="nearest") for row in y])


def _lines(
    y: NDArray[np.float64], step: float, duration: float, band: tuple[float, float]
) -> list[tuple[float, float, float]]:
    """Cycles per recording, ratio and kurtosis of the lines of `y` (n_ch, n_samples) that pass all three signs."""
    n = y.shape[1]
    window = np.hanning(n + 1)[:n] / np.sqrt(0.375 * n)
    inside = np.arange(n // 2 + 1) / duration
    use = within_band(inside, band) & (np.arange(inside.size) > 2)
    left, found = y.copy(), []
    needed = np.log(max(int(use.sum()), 1) / FALSE_ALARM)
    for _ in range(50):  # more harmonics than this are an excitation, not a disturbance
        power = (np.abs(np.fft.rfft(left * window, axis=1)) ** 2).sum(axis=0)
        ratio = np.where(use, power / _background(power), 0.0)
        line = int(np.argmax(ratio))
        if ratio[line] < needed:
            break
        kurtosis = _kurtosis(left, line)
        use[max(line - 3, 0) : line + 4] = False
        if kurtosis >= MIDWAY_KURTOSIS:
            continue
        cycles = _refined(left, line)
        phase = np.exp(2j * np.pi * cycles * step * np.arange(n))
        basis = np.stack([phase.real, phase.imag], axis=1)
        cleaned = left - (basis @ np.linalg.lstsq(basis, left.T, rcond=None)[0]).T
        after = (np.abs(np.fft.rfft(cleaned * window, axis=1)) ** 2).sum(axis=0)
        near = slice(max(line - 3, 0), line + 4)
        explained = (after[near] / _background(power)[near]).max() < needed
        if explained:
            found.append((cycles, float(ratio[line]), kurtosis))
            left = cleaned
    return sorted(found)


def _background(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Local mean of the lines of an exponentially distributed spectrum from their running median."""
    return ndimage.median_filter(power, 2 * NEIGHBOURS + 1, mode="nearest") / np.log(2) + 1e-300


def _amplitudes(y: NDArray[np.float64], cycles: float) -> NDArray[np.complex128]:
    """Complex amplitudes (n_ch,) of the sine of `cycles` per recording in `y` (n_ch, n_samples), Hann-windowed."""
    n = y.shape[1]
    window = np.hanning(n + 1)[:n] * (2 / (0.5 * n))
    angle = 2 * np.pi * cycles / n * np.arange(n)
    return y @ (window * np.cos(angle)) - 1j * (y @ (window * np.sin(angle)))


def _refined(y: NDArray[np.float64], line: int) -> float:
    """Cycles per recording of the strongest sine within a line of `line` in all channels of `y`, by successive
    parabolas through the windowed power."""
    at, width = float(line), 0.5
    for _ in range(6):
        power = [float((np.abs(_amplitudes(y, at + d)) ** 2).sum()) for d in (-width, 0.0, width)]
        bend = power[0] - 2 * power[1] + power[2]
        shift = 0.5 * width * (power[0] - power[2]) / bend if bend < 0 else 0.0
        at += float(np.clip(shift, -width, width))
        width /= 2
    return at


def _kurtosis(y: NDArray[np.float64], line: int) -> float:
    """Kurtosis of the strongest combination of the channels of `y` (n_ch, n_samples) around `line`; the mean
    1.5 E|a|^4 / (E|a|^2)^2 of the complex amplitude a(t), which equals that of the real signal."""
    Y = np.fft.rfft(y, axis=1)[:, max(line - NEIGHBOURS, 1) : line + NEIGHBOURS + 1]
    main = np.linalg.svd(Y, full_matrices=False)[0][:, 0]
    a = np.abs(np.fft.ifft(main.conj() @ Y, 4 * Y.shape[1])) ** 2
    return float(1.5 * (a**2).mean() / a.mean() ** 2)
