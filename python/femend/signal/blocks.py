"""Records cut into windowed blocks, transformed and averaged (Welch)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from femend.data import TimeData
from femend.errors import SignalError
from femend.signal.windows import Window, effective_averages, make_window

__all__ = ["Blocks", "block_length", "cut_blocks"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# a record is cut into this many blocks side by side where nothing is said
DEFAULT_BLOCKS = 8


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Transforms `X` (n_blocks, n_ch, n_freq) of windowed blocks at `freq` (n_freq,) Hz; `scale` turns |X|^2 into a
    one-sided density per Hz (half of it at 0 Hz and at the Nyquist frequency); `n_averages` is what overlapping
    blocks are worth; `decay` (1/s) that of an exponential window."""

    freq: FloatArray
    X: ComplexArray
    scale: FloatArray
    n_averages: float
    decay: float = 0.0

    def cross(self, rows: list[int], columns: list[int]) -> ComplexArray:
        """Averaged E[X_row conj(X_column)] (n_freq, n_rows, n_columns), a one-sided density per Hz."""
        left = np.moveaxis(self.X[:, rows], 2, 0)  # (n_freq, n_blocks, n)
        right = np.moveaxis(self.X[:, columns], 2, 0)
        G = np.swapaxes(left, 1, 2) @ right.conj()
        return np.asarray(G * (self.scale / len(self.X))[:, None, None])

    def auto(self, rows: list[int]) -> FloatArray:
        """Averaged |X|^2 (n_freq, n_rows), a one-sided density per Hz."""
        power = (np.abs(self.X[:, rows]) ** 2).mean(axis=0)
        return np.asarray((power * self.scale).T)


def block_length(data: TimeData, resolution: float | None) -> int:
    """Samples of a block with `resolution` Hz between the lines of `data`; None is an eighth of the record.

    Raises SignalError where the record is shorter than one block.
    """
    if resolution is None:
        return max(2, data.n_samples // DEFAULT_BLOCKS)
    if not (np.isfinite(resolution) and resolution > 0):
        raise SignalError(f"a resolution of {resolution} Hz is none; it must be positive", recording=data.name)
    n = int(round(1 / (resolution * data.dt)))
    if n > data.n_samples:
        raise SignalError(
            f"recording {data.name!r} of {data.duration:.6g} s is too short for a resolution of {resolution:.6g} Hz, "
            f"which takes {1 / resolution:.6g} s; accept at least {1 / data.duration:.6g} Hz or record longer",
            recording=data.name,
        )
    return max(2, n)


def cut_blocks(
    data: TimeData, *, resolution: float | None = None, overlap: float = 0.5, window: str | Window = "hann"
) -> Blocks:
    """Transforms of the blocks of `data`, each without its mean, windowed and shifted by 1 - `overlap` of its length.

    `resolution` (Hz) sets the length, None makes eight blocks side by side; `window` is a name or a Window of the
    block's length. Raises SignalError for a record that is too short or an overlap outside 0 <= overlap < 1.
    """
    n = window.values.size if isinstance(window, Window) else block_length(data, resolution)
    shape = window if isinstance(window, Window) else make_window(window, n)
    if not 0 <= overlap < 1:
        raise SignalError(f"an overlap of {overlap} is not between 0 and 1", recording=data.name)
    if n > data.n_samples:
        raise SignalError(
            f"recording {data.name!r} has {data.n_samples} samples, fewer than a block of {n}", recording=data.name
        )
    step = max(1, int(round(n * (1 - overlap))))
    cut = sliding_window_view(data.values, n, axis=1)[:, ::step]  # (n_ch, n_blocks, n)
    blocks = (cut - cut.mean(axis=2, keepdims=True)) * shape.values
    X = np.fft.rfft(np.swapaxes(blocks, 0, 1), axis=2)
    return Blocks(
        np.asarray(np.fft.rfftfreq(n, data.dt), dtype=np.float64),
        X,
        density_scale(n, data.dt, shape.power),
        effective_averages(shape.values, step, X.shape[0]),
        shape.decay,
    )


def density_scale(n: int, dt: float, power: float) -> FloatArray:
    """Factor (n_freq,) from |X|^2 of `n` windowed samples every `dt` s to a one-sided density; `power` is the
    window's sum of squares."""
    scale = np.full(n // 2 + 1, 2 * dt / power)
    scale[0] /= 2
    if n % 2 == 0:
        scale[-1] /= 2
    return scale
