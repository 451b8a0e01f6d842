"""Forces as functions of time that are known between the samples, so that the truth sees a continuous input."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

RAMP = 0.05  # seconds of half-cosine start, so that a recording begins at rest


@dataclass
class Force:
    """A periodic spectrum (`lines` of complex amplitudes over `period` seconds), which may end early, a logarithmic
    sine sweep, or blows of a hammer."""

    period: float = 0.0
    spectrum: np.ndarray | None = None
    sweep: tuple[float, float, float] | None = None  # f0, f1 (Hz), duration (s)
    amplitude: float = 1.0
    ramp: bool = True
    until: float | None = None  # seconds after which a periodic force is gone
    blows: tuple[tuple[float, float, float], ...] = ()  # begin (s), length (s), height of each

    def at(self, rate: float, n: int, shift: float = 0.0) -> np.ndarray:
        """Values at t = (k + shift) / rate, k = 0..n-1; exact, not interpolated."""
        t = (np.arange(n) + shift) / rate
        if self.blows:
            u = np.zeros(n)
            for begin, length, height in self.blows:
                x = (t - begin) / length
                u += np.where((x > 0) & (x < 1), height * np.sin(np.pi * np.clip(x, 0.0, 1.0)) ** 2, 0.0)
        elif self.sweep is not None:
            f0, f1, T = self.sweep
            L = T / np.log(f1 / f0)
            u = np.sin(2 * np.pi * f0 * L * (np.exp(t / L) - 1.0))
        else:
            assert self.spectrum is not None
            m = round(self.period * rate)
            full = np.zeros(m // 2 + 1, complex)
            k = min(len(self.spectrum), len(full))
            full[:k] = self.spectrum[:k] * np.exp(2j * np.pi * np.arange(k) * shift / m)
            u = np.resize(np.fft.irfft(full, m) * m, n)
        if self.until is not None:
            u = u * 0.5 * (1 + np.cos(np.pi * np.clip((t - self.until) / RAMP, 0.0, 1.0)))
        if self.ramp:
            u = u * np.where(t < RAMP, 0.5 * (1 - np.cos(np.pi * np.minimum(t, RAMP) / RAMP)), 1.0)
        return self.amplitude * u


def scaled(force: Force, rms: float, rate: float, seconds: float) -> Force:
    """The same force with the wanted RMS over the recording."""
    u = force.at(rate, int(rate * seconds))
    return replace(force, amplitude=force.amplitude * rms / np.sqrt(np.mean(u**2)))


def odd_lines(rng: np.random.Generator, band: tuple[float, float], period: float = 2.0) -> np.ndarray:
    """Odd line numbers inside the band with one in every four left out at random (detection lines)."""
    k = np.arange(int(np.ceil(band[0] * period)), int(band[1] * period) + 1)
    k = k[k % 2 == 1]
    out = [g[i] for g in np.array_split(k, max(len(k) // 4, 1)) if len(g) >= 3 for i in [rng.integers(len(g))]]
    return np.setdiff1d(k, out)


def multisine(rng: np.random.Generator, lines: np.ndarray, period: float = 2.0) -> Force:
    """Random-phase multisine with flat amplitude on the given lines."""
    s = np.zeros(lines.max() + 1, complex)
    s[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    return Force(period, s)


def noise(rng: np.random.Generator, band: tuple[float, float], rate: float, seconds: float) -> Force:
    """Gaussian noise with a fourth-order Butterworth shape around the band, nothing above 0.47 of the sampling rate."""
    period = 2.0 * seconds
    f = np.arange(int(0.47 * rate * period)) / period
    with np.errstate(divide="ignore"):
        shape = 1.0 / np.sqrt(1 + (band[0] / f) ** 8) / np.sqrt(1 + (f / band[1]) ** 8)
    return Force(period, shape * (rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))))


def sine(frequency: float, phase: float, seconds: float) -> Force:
    """A single sine from the first sample on (for forces that nobody recorded)."""
    period = 8.0 * seconds
    k = max(round(frequency * period), 1)
    s = np.zeros(k + 1, complex)
    s[k] = np.exp(1j * phase)
    return Force(period, s)


def burst(rng: np.random.Generator, band: tuple[float, float], rate: float, seconds: float) -> Force:
    """Noise that ends at six tenths of the recording, so that the motion dies away in it."""
    return replace(noise(rng, band, rate, seconds), until=0.6 * seconds)


def chirp(rng: np.random.Generator, band: tuple[float, float], seconds: float) -> Force:
    """A logarithmic sine sweep through the band."""
    return Force(sweep=(band[0] * rng.uniform(0.9, 1.0), band[1] * rng.uniform(0.95, 1.0), seconds))


def hammer(rng: np.random.Generator, band: tuple[float, float], seconds: float) -> Force:
    """One to three blows of a hammer whose spectrum falls to about a half at the end of the band."""
    length = 1.0 / band[1]
    count = int(rng.integers(1, 4))
    begins = 0.05 + (np.arange(count) + 0.2 * rng.random(count)) * seconds / count
    return Force(ramp=False, blows=tuple((float(b), length, float(rng.uniform(0.8, 1.2))) for b in begins))
