"""Frequencies of whirling modes at several speeds as responses: a measured Campbell diagram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.requests import Whirls
from femend.estimate.updating.responses import Compared, Mates, deviation
from femend.estimate.updating.state import State

__all__ = ["WhirlFrequencies"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WhirlFrequencies:
    """Damped frequencies `freq` (n,) in Hz, Im(pole) / 2 pi, each at the shaft's `speed` (n,) in rad/s, with
    deviations `sd` (n,) in Hz.

    `whirl` (n,) is +1 for a mode that whirls forward, -1 backward, 0 where that is not known or at rest. At every speed
    measured and computed modes are paired one to one so that the sum of |ln f / f_measured| is least, a whirl of the
    other sense counting as much as a factor e of frequency. Raises UpdatingError for sizes that do not fit, values
    that are no numbers above 0, a whirl that is none of these, and one at rest.
    """

    freq: FloatArray
    sd: FloatArray
    speed: FloatArray
    whirl: FloatArray
    name: str = "whirling modes"

    def __post_init__(self) -> None:
        for key in ("freq", "speed", "whirl"):
            object.__setattr__(self, key, np.asarray(getattr(self, key), dtype=np.float64))
        shape = self.freq.shape
        if self.freq.ndim != 1 or not self.freq.size or self.speed.shape != shape or self.whirl.shape != shape:
            raise UpdatingError(
                f"{self.name}: frequencies {shape}, speeds {self.speed.shape}, whirls {self.whirl.shape}; there is one "
                "of each a mode"
            )
        if not (np.isfinite(self.freq) & (self.freq > 0)).all():
            k = int(np.flatnonzero(~(np.isfinite(self.freq) & (self.freq > 0)))[0])
            raise UpdatingError(
                f"{self.name}: frequency {k + 1} is {self.freq[k]:g} Hz; leave modes out that are not above 0"
            )
        if not np.isin(self.whirl, (-1.0, 0.0, 1.0)).all():
            k = int(np.flatnonzero(~np.isin(self.whirl, (-1.0, 0.0, 1.0)))[0])
            raise UpdatingError(
                f"{self.name}: whirl {k + 1} is {self.whirl[k]:g}; give +1 forward, -1 backward, or 0 where it is "
                "not known"
            )
        still = np.flatnonzero((self.speed == 0) & (self.whirl != 0))
        if still.size:
            raise UpdatingError(
                f"{self.name}: mode {int(still[0]) + 1} whirls at a speed of 0; nothing turns there, give 0 for "
                "its whirl"
            )
        object.__setattr__(self, "sd", deviation(self.sd, shape, self.name))

    @classmethod
    def of(
        cls,
        speed: ArrayLike,
        freq: ArrayLike,
        sd: ArrayLike,
        n_modes: int,
        *,
        whirl: ArrayLike | None = None,
        name: str = "whirling modes",
    ) -> tuple[WhirlFrequencies, Whirls]:
        """The response of modes measured at `speed` (n,) rad/s, and the `Whirls` to ask a `rotor_system` for.

        `freq` (n,) Hz, `sd` (n,) or one number, `whirl` (n,) and `name` as above; `n_modes` are computed at every
        speed, more than were measured where some may have been missed. Raises UpdatingError as the class and `Whirls`
        do, and for more modes measured at a speed than are computed.
        """
        f = np.asarray(freq, dtype=np.float64)
        turns = np.zeros(f.shape) if whirl is None else np.asarray(whirl, dtype=np.float64)
        at = np.array(np.broadcast_to(np.asarray(speed, dtype=np.float64), f.shape))
        response = cls(f, np.asarray(sd, dtype=np.float64), at, turns, name)
        speeds, counts = np.unique(response.speed, return_counts=True)
        if counts.max() > n_modes:
            k = int(np.argmax(counts))
            raise UpdatingError(
                f"{name}: {counts[k]} modes were measured at {speeds[k]:g} rad/s and {n_modes} are computed; ask for "
                "more"
            )
        return response, Whirls(speeds, n_modes)

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of all modes in the order given, with those that `state` has at their speeds; `mates` play no
        part. Raises UpdatingError where the model was asked for other speeds or tells no whirl."""
        poles, speeds = state.value("pole"), state.value("pole speed")
        rows, columns = np.empty(self.freq.size, dtype=np.int64), np.empty(self.freq.size, dtype=np.int64)
        for speed in np.unique(self.speed):
            own = np.flatnonzero(self.speed == speed)
            row = np.flatnonzero(speeds == speed)
            if not row.size or poles.shape[1] < own.size:
                raise UpdatingError(
                    f"{self.name}: {own.size} modes at {speed:g} rad/s, and the model gives {poles.shape[1]} at "
                    f"{speeds.tolist()}; ask it for the `Whirls` of the response"
                )
            rows[own] = row[0]
            columns[own] = self._paired(own, poles[row[0]].imag / (2 * np.pi), state.value("whirl")[row[0]])
        residual = (poles[rows, columns].imag / (2 * np.pi) - self.freq) / self.sd
        if not slopes:
            return Compared(residual, None)
        d = state.slope("pole")[:, rows, columns].imag / (2 * np.pi)
        return Compared(residual, d / self.sd)

    def _paired(self, own: NDArray[np.int64], freq: FloatArray, whirl: FloatArray) -> NDArray[np.int64]:
        """Column of the model's modes at `freq`, `whirl` (m,) for each of the measured modes `own`."""
        from scipy.optimize import linear_sum_assignment

        wanted = self.whirl[own]
        if np.any(wanted != 0) and np.isnan(whirl).all():
            raise UpdatingError(
                f"{self.name}: the model tells no whirl, since no spinning part is known; give the system its parts, "
                "or leave the whirl of the modes 0"
            )
        far = np.abs(np.log(np.maximum(freq, 1e-12)[None, :] / self.freq[own][:, None]))
        against = np.maximum(-wanted[:, None] * np.nan_to_num(whirl)[None, :], 0.0)
        return np.asarray(linear_sum_assignment(far + against)[1])
