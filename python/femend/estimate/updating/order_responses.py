"""Orders of a rotor's run as responses: unbalance that is known, or free and shared by all speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.data import ODS, OrderTrack
from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating.eliminated import Eliminated, compared, eliminate
from femend.estimate.updating.operating_data import checked, enough_values, input_rows, on_rows
from femend.estimate.updating.requests import Frfs
from femend.estimate.updating.responses import Compared, Mates
from femend.estimate.updating.state import State
from femend.signal import ods_of_order

__all__ = ["OrderDifferences", "across"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# points of a line's width at which the model is solved (Gauss and Legendre)
POINTS = 5


@dataclass(frozen=True, eq=False)
class OrderDifferences:
    """One order of a run, complex peak amplitudes `shapes` (n_freq, n_out) at the rotor's `speed` (n_freq,) in rev/s,
    over `sd` (the same shape or one number, of real and imaginary part each), against the steady response

        sum over inputs and amplitudes of H (2 pi speed)^power directions u

    on the lines (order times speed), outputs and inputs of the system's `Frfs`. `directions` (n_in, n_free) are the
    complex forces at the inputs per unit of every amplitude (`across` makes those of unbalance), `unbalance` (n_free,)
    the amplitudes u where they are known; without it they are free, the same at all speeds, and those of least squares
    at the parameters (`eliminate`). With `power` 2, u is mass times length; it may be another one, above all of
    another order. NaN in `shapes` marks a sensor that was not there; units are those of the model. With `shares`
    (n_points,) every line is a mean of H over n_points lines of the `Frfs`, which follow each other line by line.

    The response is the steady one at every speed: shapes of a run that is quick against the decay of its modes are to
    be deconvolved first (`femend.signal.run_up_shapes`). Gyroscopic moments and bearings that change with the speed are
    in it with a `rotor_system`; `deck_system` and `modal_system` are at rest at all speeds. Raises UpdatingError for
    sizes that do not fit, a speed that is not above 0, lines without any value, and no more values than the free
    amplitudes meet whatever the model is.
    """

    shapes: ComplexArray
    sd: FloatArray
    speed: FloatArray
    directions: ComplexArray
    unbalance: ComplexArray | None = None
    power: float = 2.0
    shares: tuple[float, ...] = (1.0,)
    name: str = "order"

    def __post_init__(self) -> None:
        shapes, sd = checked(self.shapes, self.sd, self.speed, self.name, "rev/s")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "sd", sd)
        object.__setattr__(self, "speed", np.asarray(self.speed, dtype=np.float64))
        object.__setattr__(self, "directions", np.asarray(self.directions, dtype=np.complex128))
        if self.directions.ndim != 2 or not self.directions.size:
            raise UpdatingError(
                f"{self.name}: directions of forces have shape {self.directions.shape}; they are (n_in, n_free)"
            )
        if not np.isfinite(self.power):
            raise UpdatingError(f"{self.name}: forces grow with the speed to the power {self.power}; give a number")
        if self.unbalance is None:
            enough_values(int(self._there.sum()), self.directions.shape[1], self.name, " at all speeds together")
            return
        object.__setattr__(self, "unbalance", np.asarray(self.unbalance, dtype=np.complex128))
        if self.unbalance.shape != (self.directions.shape[1],) or not np.isfinite(self.unbalance).all():
            raise UpdatingError(
                f"{self.name}: the unbalance has shape {self.unbalance.shape} or holds what is no number; it is "
                f"complex, one for each of the {self.directions.shape[1]} directions"
            )

    @classmethod
    def of(
        cls,
        run: OrderTrack | ODS,
        sensors: Sequence[Dof],
        nodes: Sequence[int],
        axis: int,
        *,
        order: float = 1.0,
        sense: int = 0,
        spin: int = 0,
        unbalance: Mapping[int, complex] | None = None,
        power: float = 2.0,
        sd: ArrayLike | None = None,
        floor: float = 0.0,
        step: float | None = None,
        shaft: int = 0,
        width: float = 0.0,
    ) -> tuple[OrderDifferences, Frfs]:
        """The response of one `order` of a run, and the `Frfs` to ask the system for.

        `run` is an order track, of which `ods_of_order` makes lines `step` Hz apart with their scatter (`shaft` is the
        order's), or shapes of one order (`run_up_shapes`). `sensors` are the system's: those of all channels, and of
        the `nodes` of bearings both directions across the shaft, which lies along `axis` (0, 1, 2 for X, Y, Z).
        `sense` +1 or -1 is that of rotation about the axis by the right hand; 0 leaves the forces across the shaft
        free in both directions, which holds either sense. `spin` +1 or -1 is that of the rotor where it is not that of
        the forces or these are free; a `rotor_system` has to know it. `unbalance` has m r exp(i phase) of some nodes,
        known (as in `femend.data.Rotating`), and takes a sense. `sd` (n_freq, n_ch) or one number is of real and
        imaginary part each, in the channels' units; without it the lines' scatter counts. `floor` is a share of the
        largest value of each line, added in squares. Lines that are means over a `width` in Hz, which a resonance may
        be narrower than, are met by the model's mean over it. Raises UpdatingError as the class does, for channels or
        nodes that are no sensors and shapes that are of another order; KeyError for an order that was not tracked.
        """
        ods = ods_of_order(run, order, step, shaft=shaft) if isinstance(run, OrderTrack) else run
        name = f"order {order:g} of {ods.name!r}"
        if ods.order != order or ods.speed is None:
            what = f"they are of order {ods.order:g}" if ods.order is not None else f"they are {ods.kind!r}"
            raise UpdatingError(
                f"{name}: the shapes are to be of this order, with the speed of every line, and {what}; take those of "
                "`ods_of_order` or `run_up_shapes`"
            )
        if unbalance is not None and not unbalance:
            raise UpdatingError(f"{name}: the unbalance names no node; leave it out where it is not known")
        if unbalance is not None and not sense:
            raise UpdatingError(f"{name}: a known unbalance turns in a sense, +1 or -1; say which, or leave it free")
        if spin not in (-1, 0, 1):
            raise UpdatingError(
                f"{name}: the rotor spins in the sense {spin}; give +1 or -1, or 0 for that of the forces"
            )
        at = tuple(nodes) if unbalance is None else tuple(unbalance)
        places, directions = across(at, axis, sense)
        measured = on_rows(ods, sensors, sd, floor)
        rows, signs = input_rows(places, sensors, name)
        known = None if unbalance is None else np.array([unbalance[n] for n in at], dtype=np.complex128)
        at_points, shares = _over(ods.freq, width, name)
        turned = signs[:, None] * directions
        response = cls(measured.values, measured.sd, ods.speed, turned, known, power, shares, name)
        turns = spin or sense
        speed = turns * 2 * np.pi * at_points / order if turns else None
        return response, Frfs(at_points, measured.rows, rows, measured.kind, speed)

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the lines of `state`; `mates` play no part. Raises UpdatingError where the FRFs computed are
        others than the shapes measured, and where the unbalances cannot be told."""
        if self.unbalance is None:
            found = self._eliminated(state, slopes)
            d = None if found.slopes is None else found.slopes.reshape(-1, *self.shapes.shape)
            taken = 2 * self.directions.shape[1]
            return compared(found.residual.reshape(self.shapes.shape), d, self._there, taken)
        A, dA = self._per_amplitude(state, slopes)
        residual = A @ self.unbalance - self._weighed
        return compared(residual, None if dA is None else dA @ self.unbalance, self._there)

    def found(self, state: State) -> tuple[ComplexArray, FloatArray]:
        """The amplitudes u (n_free,) of least squares in `state`, and their deviations (real and imaginary part each,
        the parameters being what they are). Raises UpdatingError where the unbalance is known."""
        if self.unbalance is not None:
            raise UpdatingError(f"{self.name}: the unbalance is known, no amplitude is to be found")
        found = self._eliminated(state, False)
        return found.amplitudes[0], found.sd[0]

    @property
    def _there(self) -> NDArray[np.bool_]:
        return np.isfinite(self.shapes)

    @property
    def _weighed(self) -> ComplexArray:
        return np.asarray(np.where(self._there, self.shapes, 0.0) / self.sd, dtype=np.complex128)

    def _per_amplitude(self, state: State, slopes: bool) -> tuple[ComplexArray, ComplexArray | None]:
        """Shapes per unit of every amplitude over the deviations (n_freq, n_out, n_free), and their derivatives."""
        H = state.value("frf")
        n_freq, n_out = self.shapes.shape
        wanted = (n_freq * len(self.shares), n_out, self.directions.shape[0])
        if H.shape != wanted:
            raise UpdatingError(
                f"{self.name}: shapes and forces make FRFs of shape {wanted}, {H.shape} computed; ask the system for "
                "the lines, outputs and inputs of the response"
            )
        grown = (2 * np.pi * self.speed[:, None]) ** self.power
        weight = (np.where(self._there, 1.0 / self.sd, 0.0) * grown)[:, :, None]

        def weighed(values: ComplexArray) -> ComplexArray:
            each = (values @ self.directions).reshape(*values.shape[:-3], n_freq, len(self.shares), n_out, -1)
            return np.asarray(np.einsum("...kjoq,j->...koq", each, np.array(self.shares)) * weight)

        return weighed(H), weighed(state.slope("frf")) if slopes else None

    def _eliminated(self, state: State, slopes: bool) -> Eliminated:
        A, dA = self._per_amplitude(state, slopes)
        n = A.shape[-1]
        A = A.reshape(1, -1, n)
        dA = None if dA is None else dA.reshape(len(dA), 1, -1, n)
        return eliminate(A, self._weighed.reshape(1, -1), dA, [" at all speeds together"], self.name, "amplitude")


def _over(freq: FloatArray, width: float, who: str) -> tuple[FloatArray, tuple[float, ...]]:
    """Lines at which the model is solved for means over `width` Hz about `freq` (n_freq,), and the share of each."""
    if not (width >= 0 and width < 2 * freq.min()):
        raise UpdatingError(
            f"{who}: lines are means over {width:g} Hz, the lowest is at {freq.min():.6g} Hz; give 0 or a width that "
            "stays above 0 Hz"
        )
    if width == 0:
        return freq, (1.0,)
    x, share = np.polynomial.legendre.leggauss(POINTS)
    return (freq[:, None] + 0.5 * width * x).ravel(), tuple((0.5 * share).tolist())


def across(nodes: Sequence[int], axis: int, sense: int) -> tuple[tuple[Dof, ...], ComplexArray]:
    """Places (2 n_nodes,) across a shaft along `axis` (0, 1, 2 for X, Y, Z) at its bearings `nodes`, and the forces
    there (2 n_nodes, n_free) per unit of every amplitude, one a node of the `sense` +1 or -1 by the right hand, two of
    sense 0.

    With (e_u, e_v, shaft) right-handed in this order, an unbalance U at the phase phi pulls with Omega^2 U (e_u
    cos(theta + phi) + sense e_v sin(theta + phi)), whose complex amplitude is U exp(i phi) (e_u - i sense e_v). Raises
    UpdatingError for an axis or sense that is none, no node, or one twice.

    >>> across([5], 0, 1)[1].ravel().tolist()
    [(1+0j), -1j]
    """
    if axis not in (0, 1, 2):
        raise UpdatingError(f"a shaft along axis {axis}; give 0, 1 or 2 for X, Y or Z")
    if sense not in (-1, 0, 1):
        raise UpdatingError(f"sense {sense} of rotation; give +1 or -1 by the right hand, or 0 where it is not known")
    if not nodes or len(set(nodes)) != len(nodes):
        raise UpdatingError(f"bearings at nodes {list(nodes)}; name one or more, each once")
    u, v = (axis + 1) % 3 + 1, (axis + 2) % 3 + 1
    places = tuple(Dof(n, c) for n in nodes for c in (u, v))
    one = np.eye(2, dtype=np.complex128) if sense == 0 else np.array([[1.0], [-1j * sense]], dtype=np.complex128)
    return places, np.asarray(np.kron(np.eye(len(nodes)), one), dtype=np.complex128)
