"""Operating deflection shapes as responses: forces that are known, or whose amplitudes nobody measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.data import ODS
from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating.eliminated import Eliminated, compared, eliminate
from femend.estimate.updating.operating_data import checked, enough_values, input_rows, on_rows
from femend.estimate.updating.requests import Frfs
from femend.estimate.updating.responses import Compared, Mates
from femend.estimate.updating.state import State

__all__ = ["OdsDifferences"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class OdsDifferences:
    """Operating deflection shapes, complex `shapes` (n_freq, n_out) at `freq` (n_freq,) in Hz, over `sd` (the same
    shape or one number, of real and imaginary part each), against H f on the lines, outputs and inputs of the system's
    `Frfs`.

    `amplitudes` says what is known of the forces f (n_freq, n_in) at the inputs:

    - "free": nothing but their places. Each has a complex amplitude of its own on every line.
    - "scaled": they are `force` times one complex amplitude a line (the phase or the level of the source is not known).
    - "known": they are `force`.

    Amplitudes that are not known are those of least squares at the parameters (`eliminate`): nothing is said about
    them beforehand, and deviations of the parameters hold what they are free to do. Forces at all places act together
    (a shape is one of a coherent source); `signs` (n_in,), +1 or -1, turn them into the directions of the inputs. NaN
    in `shapes` marks a sensor that was not there. Units are those of the model: force in those of its loads, shapes as
    the kind of the FRFs has them. Raises UpdatingError for sizes that do not fit, lines at 0 Hz or without any value,
    and lines whose values the free amplitudes meet whatever the model is.
    """

    shapes: ComplexArray
    sd: FloatArray
    freq: FloatArray
    signs: tuple[float, ...] = (1.0,)
    force: ComplexArray | None = None
    amplitudes: Literal["free", "scaled", "known"] = "free"
    name: str = "operating shapes"

    def __post_init__(self) -> None:
        shapes, sd = checked(self.shapes, self.sd, self.freq, self.name, "Hz")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "sd", sd)
        object.__setattr__(self, "freq", np.asarray(self.freq, dtype=np.float64))
        if self.amplitudes not in ("free", "scaled", "known"):
            raise UpdatingError(f"{self.name}: amplitudes {self.amplitudes!r} are none of free, scaled, known")
        if (self.force is None) != (self.amplitudes == "free"):
            what = "free amplitudes take no `force`" if self.force is not None else f"{self.amplitudes} ones take one"
            raise UpdatingError(f"{self.name}: {what}, complex (n_freq, n_in)")
        object.__setattr__(self, "signs", tuple(float(x) for x in self.signs))
        if not self.signs or any(abs(x) != 1 for x in self.signs):
            raise UpdatingError(f"{self.name}: signs {list(self.signs)} of the inputs; give +1 or -1 for each")
        if self.force is not None:
            force = np.asarray(self.force, dtype=np.complex128)
            if force.shape != (self.freq.size, self._n_in) or not np.isfinite(force).all():
                raise UpdatingError(
                    f"{self.name}: the force has shape {force.shape} or holds what is no number; it is complex "
                    f"(n_freq, n_in), here {(self.freq.size, self._n_in)}"
                )
            object.__setattr__(self, "force", force)
        for k, n in enumerate(self._there.sum(axis=1).tolist()):
            enough_values(n, self._n_free, self.name, self._at(k))

    @classmethod
    def of(
        cls,
        ods: ODS,
        sensors: Sequence[Dof],
        places: Sequence[Dof],
        *,
        force: ArrayLike | None = None,
        amplitudes: Literal["free", "scaled", "known"] = "free",
        sd: ArrayLike | None = None,
        floor: float = 0.0,
        speed: ArrayLike | None = None,
    ) -> tuple[OdsDifferences, Frfs]:
        """The response of measured shapes `ods`, and the `Frfs` to ask the system for.

        `sensors` are the system's, those of all channels and `places` among them; forces act at the `places` (n_in,) in
        their signed directions, `force` (n_freq, n_in) as above. Deviations are `sd` (n_freq, n_ch) or one number, in
        the channels' units and of real and imaginary part each, or the scatter that the shapes hold (`ODS.sigma`);
        `floor` is a share of the largest value of each line, added in squares. `speed` (n_freq,) or one number is the
        shaft's in rad/s, as `Frfs` takes it, for a `rotor_system`. Raises UpdatingError as the class does, and for
        channels or places that are no sensors.
        """
        name = f"operating shapes {ods.name!r}"
        measured = on_rows(ods, sensors, sd, floor)
        rows, signs = input_rows(places, sensors, name)
        known = None if force is None else np.asarray(force, dtype=np.complex128)
        response = cls(measured.values, measured.sd, ods.freq, tuple(signs.tolist()), known, amplitudes, name)
        turns = None if speed is None else np.asarray(speed, dtype=np.float64)
        return response, Frfs(ods.freq, measured.rows, rows, measured.kind, turns)

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the lines of `state`; `mates` play no part. Raises UpdatingError where the FRFs computed are
        others than the shapes measured, and where the amplitudes cannot be told."""
        if self.amplitudes == "known":
            A, dA = self._per_amplitude(state, slopes)
            residual = A[:, :, 0] - self._weighed
            return compared(residual, None if dA is None else dA[..., 0], self._there)
        found = self._eliminated(state, slopes)
        return compared(found.residual, found.slopes, self._there, 2 * self._n_free * self.freq.size)

    def found(self, state: State) -> tuple[ComplexArray, FloatArray]:
        """The amplitudes (n_freq, n_free) of least squares in `state`, n_in of them on a line where they are free and
        one where they are scaled, and their deviations (real and imaginary part each, the parameters being what they
        are). Raises UpdatingError where the forces are known."""
        if self.amplitudes == "known":
            raise UpdatingError(f"{self.name}: the forces are known, no amplitude is to be found")
        found = self._eliminated(state, False)
        return found.amplitudes, found.sd

    @property
    def _there(self) -> NDArray[np.bool_]:
        return np.isfinite(self.shapes)

    @property
    def _n_in(self) -> int:
        return len(self.signs)

    @property
    def _n_free(self) -> int:
        return {"free": self._n_in, "scaled": 1, "known": 0}[self.amplitudes]

    @property
    def _weighed(self) -> ComplexArray:
        return np.asarray(np.where(self._there, self.shapes, 0.0) / self.sd, dtype=np.complex128)

    def _at(self, line: int) -> str:
        return f" on line {line + 1} at {self.freq[line]:.6g} Hz"

    def _per_amplitude(self, state: State, slopes: bool) -> tuple[ComplexArray, ComplexArray | None]:
        """Shapes per unit of every amplitude over the deviations (n_freq, n_out, n_free or 1), and their
        derivatives."""
        H = state.value("frf")
        wanted = (*self.shapes.shape, self._n_in)
        if H.shape != wanted:
            raise UpdatingError(
                f"{self.name}: shapes and forces make FRFs of shape {wanted}, {H.shape} computed; ask the system for "
                "the lines, outputs and inputs of the response"
            )
        weight = np.where(self._there, 1.0 / self.sd, 0.0)[:, :, None]

        def weighed(values: ComplexArray) -> ComplexArray:
            values = values * np.array(self.signs)
            if self.force is not None:
                values = (values @ self.force[:, :, None]).astype(np.complex128)
            return np.asarray(values * weight)

        return weighed(H), weighed(state.slope("frf")) if slopes else None

    def _eliminated(self, state: State, slopes: bool) -> Eliminated:
        A, dA = self._per_amplitude(state, slopes)
        sets = [self._at(k) for k in range(self.freq.size)]
        return eliminate(A, self._weighed, dA, sets, self.name, "force")
