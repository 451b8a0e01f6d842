"""FRFs as a laboratory makes them: averaged accelerances with coherence, of the shaker at one place, then another.

Each place is driven for a long time by noise without end, cut into overlapping Hann windows (then resonances narrower
than two lines are broadened, as everywhere), or by a periodic multisine on all lines of a block, whose averages begin
when the motion has become periodic.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import signal

from . import excite
from .excite import Force
from .setting import Test
from .uff58 import ResponseFunction

RMS = 5.0  # N
AVERAGES = 24
WAIT = 3  # blocks of a multisine before it is averaged
LINES = 8  # of one recording, in the width of a resonance of 1 % at the geometric middle of the band

Pair = tuple[int, int]
Recorder = Callable[[Force, int], tuple[np.ndarray, np.ndarray]]


def drives(rng: np.random.Generator, test: Test) -> list[Pair]:
    """Where the shaker acts: at its place, and at another sensor's."""
    others = [place for place in test.sensors if place != test.drive]
    return [test.drive, *(others[int(rng.integers(len(others)))] for _ in range(1 if others else 0))]


def block_seconds(test: Test) -> float:
    """Length of a block: two, four or eight seconds, so that resonances in the middle of the band have some lines."""
    width = 0.02 * np.sqrt(test.band[0] * test.band[1])
    return float(2 ** np.clip(np.round(np.log2(LINES / 2 / width)), 1, 3))


def measured(rng: np.random.Generator, test: Test, kind: str, recorder: Recorder) -> list[ResponseFunction]:
    """All FRFs of one place of the shaker, the test's drive, and their coherences. `recorder` gives force and
    accelerations with their noise of a force and a number of samples."""
    T, rate = block_seconds(test), test.rate
    m = round(T * rate)
    # a little beyond the band on both sides, as the filters of a test are
    wide = (0.8 * test.band[0], min(1.1 * test.band[1], 0.45 * rate))
    if kind == "multisine":
        lines = np.arange(max(int(np.ceil(wide[0] * T)), 1), int(wide[1] * T) + 1)
        force, first, hop = excite.multisine(rng, lines, T), WAIT * m, m
        window = np.ones(m)
    else:
        force, first, hop = excite.noise(rng, wide, rate, T * (1 + AVERAGES / 2)), m // 2, m // 2
        window = signal.windows.hann(m, sym=False)
    n = first + m + (AVERAGES - 1) * hop
    u, y = recorder(excite.scaled(force, RMS, rate, n / rate), n)
    freq, H, coherence = averaged(u, y, rate, [first + k * hop for k in range(AVERAGES)], window, test.band)
    out: list[ResponseFunction] = []
    for values, coherent in ((H, False), (coherence, True)):
        out += [
            ResponseFunction(place, test.drive, freq, v, coherent)
            for place, v in zip(test.sensors, values, strict=True)
        ]
    return out


def averaged(
    u: np.ndarray, y: np.ndarray, rate: float, begins: list[int], window: np.ndarray, band: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lines (Hz) in the band, H1 estimates (n_out, K) and coherences (n_out, K) of force u (n,) and responses y (n_out,
    n)."""
    m = len(window)
    freq = np.fft.rfftfreq(m, 1 / rate)
    keep = (freq >= band[0]) & (freq <= band[1])
    U = np.stack([np.fft.rfft(window * u[b : b + m])[keep] for b in begins])
    Y = np.stack([np.fft.rfft(window * y[:, b : b + m], axis=1)[:, keep] for b in begins])
    uu, yy = np.sum(np.abs(U) ** 2, axis=0), np.sum(np.abs(Y) ** 2, axis=0)
    yu = np.sum(Y * U[:, None].conj(), axis=0)
    return freq[keep], yu / uu, np.abs(yu) ** 2 / (uu * yy)
