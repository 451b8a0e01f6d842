"""One recording's modes and FRFs against the model: everything the correlation of a test is told by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.frf import modal_frf
from femend.analysis.model_modes import model_modes
from femend.bench.reading.measured import MeasuredModes
from femend.bench.reading.models import modes_up_to
from femend.correlate import (
    FrfComparison,
    ModeComparison,
    ScaledSensor,
    SensorFault,
    automac,
    comac,
    compare_frfs,
    compare_modes,
    ecomac,
    fault_pairs,
    macco,
    scaled_sensors,
    sensor_faults,
)
from femend.data import FRF, ModeSet
from femend.dof import Dof
from femend.errors import CorrelationError
from femend.model import Model
from femend.numerals import plain

__all__ = ["OFF", "Compared", "compare_recording", "modelled_frf"]

FloatArray = NDArray[np.float64]

# frequencies that are off by this factor, or its inverse, are not those of a model that is only somewhat wrong
OFF = 1.5
# the model's FRFs are superposed from modes up to this multiple of the band's end
FRF_ABOVE = 3.0


@dataclass(frozen=True, eq=False)
class Compared:
    """The modes of a recording, `measured`, against those of the `model` in its configuration.

    `test` are the nearest real shapes, `modes` the model's; `comparison` pairs and tabulates them. `comac`,
    `ecomac` (n_dof,) and `macco` (n_dof, n_pairs) are per DOF over the paired modes (None with fewer than two DOFs
    or without a pair), `faults` sensors that look reversed or exchanged, `scaled` those that are a factor off,
    `automac` (n_test, n_test) of the test. `frfs` compares the measured FRFs with `frf`, the model's; None where
    none were measured.
    """

    measured: MeasuredModes
    test: ModeSet
    modes: ModeSet
    comparison: ModeComparison
    comac: FloatArray | None
    ecomac: FloatArray | None
    macco: FloatArray | None
    faults: tuple[SensorFault, ...]
    automac: FloatArray
    scaled: tuple[ScaledSensor, ...] = ()
    frfs: FrfComparison | None = None
    frf: FRF | None = None

    @property
    def dofs(self) -> tuple[Dof, ...]:
        """Sensors at which shapes are compared, (n_dof,)."""
        return self.comparison.match.dofs

    @property
    def mistaken(self) -> dict[int, str]:
        """Sensors that look reversed, exchanged or a factor off: names by their rows of `dofs`."""
        rows = (*(s.row for s in self.scaled), *(i for f in self.faults for i in f.rows))
        return {i: str(self.dofs[i]) for i in rows}

    @property
    def n_test(self) -> int:
        """Number of measured modes."""
        return self.test.n_modes

    @property
    def n_pairs(self) -> int:
        """Number of measured modes that have a mate in the model."""
        return len(self.comparison.pairing.pairs)

    def summary(self) -> dict[str, Any]:
        """Means over the pairs: number, absolute frequency error, MAC; NaN without a pair."""
        rows = self.comparison.table.rows
        freq = [abs(r.freq_difference) for r in rows]
        return {
            "measured": self.n_test,
            "paired": self.n_pairs,
            "freq_error": float(np.mean(freq)) if rows else float("nan"),
            "largest_freq_error": max(freq, default=float("nan")),
            "mac": float(np.mean([r.mac for r in rows])) if rows else float("nan"),
        }


def compare_recording(
    measured: MeasuredModes,
    model: Model,
    places: dict[Dof, Dof],
    *,
    zeta: float,
    mac_min: float = 0.5,
    factors: Mapping[str, float] | None = None,
    modes: ModeSet | None = None,
) -> Compared:
    """Compares `measured` modes, and its FRFs if there are any, with `model` at `factors` of its parameters by name.

    `places` has the model's DOF of each sensor; the model's modes have the damping ratio `zeta` but for those that are
    paired, which have the measured one in the FRFs. `modes` that a solver of the user's own computed are taken in place
    of the model's, and FRFs are not compared. `mac_min` as in `pair_modes`. Raises what `compare_modes` and
    `compare_frfs` raise.
    """
    test = measured.modes.to_mode_set()
    computed = modes
    if modes is None:
        modes = modes_up_to(model, float(test.freq[-1]), test.n_modes, zeta, factors)
    comparison = compare_modes(test, modes, places=places, mac_min=mac_min)
    a, b = comparison.pairing.a, comparison.pairing.b
    phi_a, phi_b = comparison.phi_a[:, a], comparison.phi_b[:, b]
    scaled = _scaled(comparison, test, modes)
    found = Compared(measured, test, modes, comparison, None, None, None, (), automac(comparison.phi_a), scaled)
    if a.size and len(comparison.match.dofs) > 1:
        found = replace(
            found,
            comac=comac(phi_a, phi_b),
            ecomac=ecomac(phi_a, phi_b),
            macco=macco(phi_a, phi_b),
            faults=_faults(comparison, test, modes),
        )
    if measured.frf is None or computed is not None:
        return found
    frf = modelled_frf(measured.frf, model, places, _damped(found, zeta), zeta, factors)
    return replace(found, frf=frf, frfs=compare_frfs(measured.frf, frf))


def _scaled(comparison: ModeComparison, test: ModeSet, modes: ModeSet) -> tuple[ScaledSensor, ...]:
    try:
        return scaled_sensors(comparison.phi_a, comparison.phi_b, comparison.match.dofs, test.freq, modes.freq)
    except CorrelationError:
        return ()  # what cannot be compared tells nothing of single sensors


def _faults(comparison: ModeComparison, test: ModeSet, modes: ModeSet) -> tuple[SensorFault, ...]:
    """Sensors that look reversed or exchanged in the pairs whose frequencies go together: of a mode that the model has
    not the likest shape far off accuses sensors. Where a few of them make shapes look like those of other modes, the
    pairs are those without the mistake."""
    phi_a, phi_b = comparison.phi_a, comparison.phi_b
    pairs = [(p.a, p.b) for p in comparison.pairing.pairs if 1 / OFF < modes.freq[p.b] / test.freq[p.a] < OFF]
    try:
        cured = fault_pairs(phi_a, phi_b, test.freq, modes.freq, far=OFF)
        a, b = cured if cured is not None else np.array(pairs, dtype=np.int64).reshape(-1, 2).T
        return sensor_faults(phi_a[:, a], phi_b[:, b], comparison.match.dofs)[0]
    except CorrelationError:
        return ()  # too few sensors or modes to tell


def _damped(found: Compared, zeta: float) -> dict[float, float]:
    """Damping of the model's modes by frequency: that of the test where they are paired."""
    return {float(found.modes.freq[p.b]): float(found.test.zeta[p.a]) or zeta for p in found.comparison.pairing.pairs}


def modelled_frf(
    measured: FRF,
    model: Model,
    places: dict[Dof, Dof],
    zeta_of: dict[float, float],
    zeta: float,
    factors: Mapping[str, float] | None = None,
) -> FRF:
    """The model's FRFs at the lines, sensors and shakers of the `measured` ones, and of their kind.

    `zeta_of` gives damping ratios by the modes' frequencies in Hz, `zeta` that of all others; `factors` are those of
    the parameters. Modes count up to three
    times the band's end. Raises CorrelationError where there are none, and what `model_modes` and `modal_frf` raise.
    """
    # with the rigid-body modes of a free structure, whose share FRFs have
    every = model_modes(model, f_max=FRF_ABOVE * float(measured.freq[-1]), zeta=zeta, factors=factors)
    if not every.n_modes:
        raise CorrelationError(
            f"the FRFs of recording {measured.name!r} end at {plain(measured.freq[-1])} Hz, and the model has no mode "
            f"up to {FRF_ABOVE:g} times that: check the time axis (a column that counts milliseconds is called "
            "'time [ms]'), and units, stiffness and mass of the deck"
        )
    own = np.array([zeta_of.get(float(f), zeta) for f in every.freq])
    for f, value in zeta_of.items():  # two solutions of one model agree to rounding alone
        near = int(np.argmin(np.abs(every.freq - f)))
        if abs(every.freq[near] - f) < 1e-6 * f:
            own[near] = value
    modes = ModeSet(every.freq, own, every.phi, every.dofs, every.scaling)
    outputs, inputs = ([replace(c, dof=places[c.dof]) for c in side if c.dof is not None]
                       for side in (measured.outputs, measured.inputs))  # fmt: skip
    found = modal_frf(modes, measured.freq, outputs, inputs, kind=measured.kind, unit=measured.unit)
    return replace(found, outputs=measured.outputs, inputs=measured.inputs, name="model")
