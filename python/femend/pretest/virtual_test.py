"""A test on the model: FRFs with noise, identified by the same estimator as real ones, and the model updated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.analysis.frf import modal_frf
from femend.correlate import ModePairing, pair_modes
from femend.data import FRF, Channel, IdentifiedModes, ModeSet
from femend.data.bands import within_band
from femend.dof import Dof
from femend.errors import PretestError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    ParameterRow,
    Problem,
    ShapeDifferences,
    System,
    Unknowns,
    UpdateResult,
    update,
)
from femend.modal import ModalTest, identify_modes
from femend.numerals import plain

__all__ = ["VirtualTest", "virtual_frf", "virtual_test"]

FloatArray = NDArray[np.float64]

# what a shape that was identified without fault is still wrong by, and a frequency: share of its largest value
SHAPE_FLOOR, FREQ_FLOOR = 0.01, 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class VirtualTest:
    """What the test found, and what the model updated on it says.

    `modes` are those of the structure in the band, `identified` the modal test of the FRFs, `pairing` of the
    structure's modes (a) with the identified ones (b); `result` the updating, None where no mode was found; `truth`
    (n,) the values of the unknowns in the structure.
    """

    modes: ModeSet
    identified: ModalTest
    pairing: ModePairing
    result: UpdateResult | None
    truth: FloatArray
    note: str = ""

    @property
    def found(self) -> tuple[int, ...]:
        """Modes of the structure (from 0) that the test identified."""
        return tuple(sorted(p.a for p in self.pairing.pairs))

    @property
    def missed(self) -> tuple[int, ...]:
        """Modes of the structure in the band that the test did not find."""
        return tuple(i for i in range(self.modes.n_modes) if i not in self.found)

    def parameters(self) -> list[tuple[ParameterRow, float, bool]]:
        """Each updated parameter, its true value, and whether the truth lies within three deviations."""
        if self.result is None:
            return []
        rows = self.result.parameters()
        return [(r, float(t), abs(r.value - t) <= 3 * r.sd) for r, t in zip(rows, self.truth, strict=True)]

    def __repr__(self) -> str:
        lines = [f"virtual test: {len(self.found)} of {self.modes.n_modes} modes found"]
        lines += [f"missed: mode {i + 1} at {plain(self.modes.freq[i])} Hz" for i in self.missed]
        for r, truth, inside in self.parameters():
            lines.append(
                f"{r.name:20} true {plain(truth)}, found {plain(r.value)} ± {plain(r.sd, 2)}, learned "
                f"{100 * r.learned:.0f} %" + ("" if inside else "  beyond three deviations")
            )
        return "\n".join([*lines, self.note] if self.note else lines)


def virtual_frf(
    modes: ModeSet,
    sensors: Sequence[Dof],
    exciters: Sequence[Dof],
    freq: ArrayLike,
    *,
    noise: float = 0.0,
    seed: int = 0,
) -> FRF:
    """Accelerances (n_freq, n_out, n_in) of `modes` at `freq` (n_freq,) Hz, as a test would measure them.

    Complex Gaussian noise of the size `noise` x the root mean square of each sensor's FRFs is added, the same on all
    lines. Raises what `modal_frf` raises, and PretestError for noise below 0.
    """
    if not noise >= 0:
        raise PretestError(f"the noise is {noise:g}; it is a share of the FRFs' root mean square, not below 0")
    outputs = [Channel(d, "acceleration", "m/s^2") for d in sensors]
    inputs = [Channel(d, "force", "N") for d in exciters]
    clean = modal_frf(modes, freq, outputs, inputs, name="virtual test")
    rng = np.random.default_rng(seed)
    size = noise * np.sqrt(np.mean(np.abs(clean.H) ** 2, axis=(0, 2), keepdims=True)) / np.sqrt(2.0)
    H = clean.H + size * (rng.standard_normal(clean.H.shape) + 1j * rng.standard_normal(clean.H.shape))
    return FRF(clean.name, clean.freq, H, clean.outputs, clean.inputs, clean.kind, clean.unit)


def virtual_test(
    system: System,
    unknowns: Unknowns,
    truth: ArrayLike,
    sensors: Sequence[Dof],
    exciters: Sequence[int],
    freq: ArrayLike,
    *,
    zeta: ArrayLike = 0.01,
    noise: float = 0.01,
    shape_sd: float = 0.02,
    seed: int = 0,
    model: System | None = None,
) -> VirtualTest:
    """The planned test on a structure that is `system` at values `truth` (n,) of `unknowns`.

    `system` is seen at the `sensors`, in this order; `exciters` are those of them (positions) that are driven; FRFs at
    `freq` (n_freq,) Hz with modal damping `zeta` and `noise` (`virtual_frf`) go through `identify_modes`. The
    identified modes update the unknowns of `model` (`system` itself by default; another one shows what a missing term
    does to the parameters), with frequencies to their own deviation, at least 1e-4, and shapes to `shape_sd` of their
    largest motion. Modes above the band are in the FRFs as far as `system` gives them. Raises PretestError for truths
    that do not fit the unknowns or a band without modes, and what identification and updating raise.
    """
    values = np.asarray(truth, dtype=np.float64)
    if values.shape != (len(unknowns),):
        raise PretestError(f"{values.size} true values for {len(unknowns)} unknowns; one each")
    lines = np.asarray(freq, dtype=np.float64)
    whole = _modes_at(system, unknowns, values, zeta, sensors)
    f = whole.freq
    band = within_band(f, (lines[0], lines[-1]))
    if not band.any():
        raise PretestError(f"no mode lies between {lines[0]:g} and {lines[-1]:g} Hz; the first is at {plain(f[0])} Hz")
    modes = ModeSet(f[band], whole.zeta[band], whole.phi[:, band], whole.dofs)
    at = [whole.dofs[i] for i in exciters]
    test = identify_modes(virtual_frf(whole, whole.dofs, at, lines, noise=noise, seed=seed))
    found = test.modes
    shapes = _real(found.shapes)
    pairing = pair_modes(modes.phi, shapes, modes.freq, found.freq) if found.n_modes else _none(modes.n_modes)
    if not pairing.pairs:
        return VirtualTest(modes, test, pairing, None, values, "no mode was found: nothing to update on")
    one = _measured(model or system, found, shapes, sorted(p.b for p in pairing.pairs), shape_sd)
    try:
        result = update(Problem(unknowns, (one,)))
    except UpdatingError as error:
        return VirtualTest(modes, test, pairing, None, values, str(error))
    return VirtualTest(modes, test, pairing, result, values)


def _modes_at(
    system: System, unknowns: Unknowns, values: FloatArray, zeta: ArrayLike, sensors: Sequence[Dof]
) -> ModeSet:
    """All modes of the system at the true values (n,) of the unknowns; raises PretestError for one it has not."""
    absent = [n for n in unknowns.names if n not in system.names]
    if absent:
        raise PretestError(f"the system has no parameter {absent[0]!r}; it has {', '.join(system.names)}")
    defaults = dict(getattr(system, "defaults", {}))
    factors = np.array([defaults.get(n, 1.0) for n in system.names], dtype=np.float64)
    factors[[system.names.index(n) for n in unknowns.names]] = values
    state = system.solve(factors)
    freq = state.value("freq")
    damping = np.broadcast_to(np.asarray(zeta, dtype=np.float64), freq.shape)
    return ModeSet(freq, damping, state.value("phi"), _plain(sensors))


def _measured(
    model: System, found: IdentifiedModes, shapes: FloatArray, keep: list[int], shape_sd: float
) -> Configuration:
    """What the test tells of the modes `keep`: frequencies, and shapes (n_sensors, n_modes), to their deviations."""
    known = np.zeros(found.n_modes) if found.freq_sd is None else np.nan_to_num(found.freq_sd)
    sd = np.maximum(known[keep], FREQ_FLOOR * found.freq[keep])
    x = shapes[:, keep]
    measured = (
        Frequencies(found.freq[keep], sd),
        ShapeDifferences(x, max(shape_sd, SHAPE_FLOOR) * np.abs(x).max(axis=0)),
    )
    return Configuration("virtual test", model, measured, ModeTest(found.freq[keep], x))


def _plain(sensors: Sequence[Dof]) -> tuple[Dof, ...]:
    """The sensors as labels of rows that are already in their directions."""
    return tuple(d.unsigned for d in sensors)


def _real(shapes: NDArray) -> FloatArray:
    """Shapes (n_dof, n_modes) turned to the phase in which their real part is largest."""
    turn = np.sqrt(np.sum(shapes**2, axis=0))
    turn = np.where(np.abs(turn) > 0, turn / np.maximum(np.abs(turn), 1e-300), 1.0)
    return np.asarray(np.real(shapes / turn), dtype=np.float64)


def _none(n_modes: int) -> ModePairing:
    return ModePairing((), tuple(range(n_modes)), (), (), (), ())
