"""Time records and frequency response functions as weighted spectral lines s = sigma + i omega."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.data.bands import within_band
from femend.estimate.cut_off import cut_off, static_part
from femend.estimate.damped_frf import damped
from femend.estimate.frf import MODEL_ALLOWANCE, FrfLines
from femend.estimate.line_spacing import spaced
from femend.estimate.picked_up import ACROSS_SD, GAIN_SD, Across, PickedUp
from femend.estimate.power import holds_power, may_be_noise, smoothed
from femend.model import ReducedModel

__all__ = [
    "FitRecord",
    "Lines",
    "amplitudes",
    "band_power",
    "modal_accelerances",
    "noise_floor",
    "spectral_lines",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# neighbouring lines inside a half-power bandwidth carry the same model error: the effective share of the samples
TEMPERING = 0.1


@dataclass(frozen=True, eq=False)
class FitRecord:
    """One time record, or one column of an FRF, ready for estimation.

    A column of an FRF is the answer to a force of one on every line: `dt` is 0, u (1, K) are ones and y (n_out, K)
    the magnitudes on its K lines, of which norms and levels can be taken as of samples; the values are in `frf`.

    Attributes:
        name: of the recording.
        u: (n_in, n) measured forces.
        y: (n_out, n) accelerations.
        dt: step, s.
        in_rows, out_rows: rows of the g-set.
        in_signs, out_signs: signs of the sensors' directions.
        noise: (n_out,) standard deviation of the noise of every response.
        period: samples of a period where the record repeats itself, 0 elsewhere.
        frf: lines of an FRF; None for a time record.
        recording: the recording it is a column of, where that has another name.
        start: sample from which on responses are compared, where what went before was used for something else: the
            structure is driven by all of the record. Windowed lines (`sigma` > 0), which show the beginning, are of
            the whole record all the same.
        across: (3, n_out, n) accelerations along the two other axes of every sensor's node, and along its own, as a
            model predicts them, of each of which the sensor may hold an unknown share; complex on an FRF's lines. None
            where sensors are believed.
        crossed: rows of the g-set of sensors that were left out, each with how many times as much the structure moves
            across it as was recorded along it, and how many times as much the model moves along it as that.
        loud: rows of the g-set of sensors whose noise was raised to what a model that explains all others leaves of
            them, each with the factor, and the frequency (Hz) about which most of that stands, NaN where it is spread.
        known_to: frequency (Hz) above which what may be noise of the forces counts as an allowance.
    """

    name: str
    u: FloatArray
    y: FloatArray
    dt: float
    in_rows: NDArray[np.int64]
    out_rows: NDArray[np.int64]
    in_signs: FloatArray
    out_signs: FloatArray
    noise: FloatArray
    period: int = 0
    frf: FrfLines | None = None
    recording: str = ""
    start: int = 0
    across: FloatArray | ComplexArray | None = None
    crossed: tuple[tuple[int, float, float], ...] = ()
    loud: tuple[tuple[int, float, float], ...] = ()
    known_to: float = np.inf

    @property
    def source(self) -> str:
        """Name of the recording it came from."""
        return self.recording or self.name

    @property
    def n(self) -> int:
        """Number of samples, or of an FRF's lines."""
        return int(self.u.shape[1])

    @property
    def driven(self) -> bool:
        """Was the force recorded? Where it was not, `u` is (0, n)."""
        return len(self.u) > 0

    def part(self, begin: int, end: int, period: int = 0) -> FitRecord:
        """Samples `begin` to `end` of a time record, of which `period` samples repeat themselves: forces, responses and
        what moves across them."""
        across: FloatArray | ComplexArray | None = self.across
        across = None if across is None else across[:, :, begin:end]
        u, y = (np.ascontiguousarray(v[:, begin:end]) for v in (self.u, self.y))
        return replace(self, u=u, y=y, period=period, across=across)

    @cached_property
    def second(self) -> FloatArray:
        """Second derivative (n_in, n) of the forces, as modes far above the band follow them."""
        return static_part(self.u, self.period, self.dt)

    def force_in_doubt(self, freq: FloatArray) -> FloatArray:
        """Share (K,) of the power of a time record's forces that may be noise, at frequencies `freq` (K,) in Hz; 0 up
        to `known_to`."""
        if self.known_to >= freq[-1]:
            return np.zeros(len(freq))
        share = np.interp(freq, np.fft.rfftfreq(self.n, self.dt), self._may_be_noise)
        return np.where(freq > self.known_to, share, 0.0)

    @cached_property
    def driven_to(self) -> float:
        """Up to where the forces of a time record excite, rad/s; 0 of an FRF and where none was recorded."""
        return 2 * np.pi * holds_power(self.u, self.dt)[1] if self.driven and self.frf is None else 0.0

    @cached_property
    def _may_be_noise(self) -> FloatArray:
        return may_be_noise(self.u, self.dt)

    @property
    def level(self) -> float:
        """How strongly the structure was driven: standard deviation of the forces, of the responses where no force was
        recorded."""
        return float((self.u if self.driven else self.y).std())


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of one record: `freq` (K,) Hz, spectra `U` (K, n_in), `Y` (K, n_out), `weight` (K, n_out) = 1/sd,
    `share` of a line in the cost, the core's object, and what sensors may pick up."""

    record: FitRecord
    sigma: float
    freq: FloatArray
    index: NDArray[np.int64]
    U: ComplexArray
    Y: ComplexArray
    weight: FloatArray
    share: float
    core: Any
    picked_up: PickedUp | None = None

    def left(self, e: ComplexArray) -> ComplexArray:
        """Residuals `e` (K, n_out) of the accelerations with their weights, and without what sensors may have picked
        up: their squares add to what the best shares leave, with the prior of these."""
        weighted = np.asarray(e * self.weight)
        return weighted if self.picked_up is None else self.picked_up.taken_out(weighted)

    @property
    def s(self) -> ComplexArray:
        """Lines sigma + i omega (K,), rad/s."""
        return np.asarray(self.sigma + 2j * np.pi * self.freq, dtype=np.complex128)

    @property
    def first(self) -> int:
        """Sample of the record at which these lines begin."""
        return _first(self.record, self.sigma)

    @property
    def n(self) -> int:
        """Number of samples that these lines are of."""
        return self.record.n - self.first

    @property
    def noise_share(self) -> float:
        """NRMSE that noise alone leaves on these lines."""
        if self.record.frf is not None:
            return noise_floor(self.record, (float(self.freq[0]), float(self.freq[-1])))
        n_eff = float((np.exp(-2 * self.sigma * self.record.dt * np.arange(self.n))).sum())
        noise = len(self.freq) * n_eff * float((self.record.noise**2).sum())
        return float(np.sqrt(noise / (np.abs(self.Y) ** 2).sum()))


def _first(record: FitRecord, sigma: float) -> int:
    """Sample at which lines damped by `sigma` (1/s) begin."""
    return record.start if sigma == 0 else 0


def noise_floor(record: FitRecord, band: tuple[float, float], sigma: float = 0.0) -> float:
    """NRMSE that noise leaves, and the shares of motion that sensors may pick up or be off by: on all samples of a time
    record, windowed by exp(-sigma t), on an FRF's lines in the band (Hz)."""
    across = record.across
    if record.frf is None:
        window = np.exp(-2 * sigma * record.dt * np.arange(record.n))
        left, squares = float((record.noise**2).sum() * window.sum()), float((record.y**2 @ window).sum())
        moved = None if across is None else float((across[:2] ** 2 @ window).sum())
    else:
        inside = within_band(record.frf.freq, band)
        left = float((record.frf.noise[inside] ** 2).sum())
        squares = float((np.abs(record.frf.H[inside]) ** 2).sum())
        moved = None if across is None else float((np.abs(across[:2, :, inside]) ** 2).sum())
    if moved is not None:
        left += ACROSS_SD**2 * moved + GAIN_SD**2 * squares
    return float(np.sqrt(left / squares))


def band_power(record: FitRecord, band: tuple[float, float]) -> float:
    """Power of a record's responses in a band (Hz), summed over sensors and lines."""
    freq, amplitude = amplitudes(record)
    return float((amplitude[:, within_band(freq, band)] ** 2).sum())


def amplitudes(record: FitRecord) -> tuple[FloatArray, FloatArray]:
    """Frequencies (K,) in Hz and amplitudes (n_out, K) of a record's responses: of the transform of a time record, of
    an FRF."""
    if record.frf is not None:
        return record.frf.freq, np.abs(record.frf.H).T
    freq = np.asarray(np.fft.rfftfreq(record.n, record.dt), dtype=np.float64)
    return freq, np.abs(np.fft.rfft(record.y, axis=1))


def spectral_lines(
    record: FitRecord,
    reduced: ReducedModel,
    band: tuple[float, float],
    sigma: float = 0.0,
    limit: int | None = None,
    modal: tuple[FloatArray, FloatArray, FloatArray] | None = None,
    n_tuned: int = 0,
    zeta: float = 0.0,
) -> Lines:
    """Lines of a record in a band (Hz), exponentially windowed with decay `sigma` (1/s).

    The window moves the lines to s = sigma + i omega, which is the same as damping added to model and structure alike;
    lines closer than the added bandwidth are thinned and count for those left out. With `limit` at most about that many
    lines are taken: of each group of neighbours the one with the largest force, or response where no force was
    recorded. FRFs have no window on an uneven axis. Of lines that are much closer than resonances of the damping ratio
    `zeta` are wide one is taken (`spaced`).

    `modal` are modes of a model that is about right (omega and zeta (r,), modes (r, r) in the basis): damped lines of
    an FRF are told from those of it, and with it the answers of modes far above the band are those to a
    force that was cut off at the record's end (`cut_off`), of which `n_tuned` modes and more have free decays.
    """
    if record.frf is not None:
        return _of_frf(record, record.frf, reduced, band, sigma, limit, modal, zeta)
    first = _first(record, sigma)
    u, y = record.u[:, first:], record.y[:, first:]
    n = u.shape[1]
    window = np.exp(-sigma * record.dt * np.arange(n))
    freq = np.asarray(np.fft.rfftfreq(n, record.dt), dtype=np.float64)
    Ufull, Yfull = np.fft.rfft(u * window, axis=1), np.fft.rfft(y * window, axis=1)
    force = (np.abs(Ufull) ** 2).sum(axis=0) if record.driven else None
    shown = (np.abs(Yfull / record.noise[:, None]) ** 2).sum(axis=0) if force is None else force
    index, step, each = _chosen(freq, band, (shown, force), (sigma, zeta, limit))
    U = Ufull[:, index].T
    allowed = MODEL_ALLOWANCE**2 + (record.force_in_doubt(freq) if record.driven else 0.0)
    variance = record.noise[:, None] ** 2 * float((window**2).sum()) + allowed * smoothed(np.abs(Yfull) ** 2)
    across = None
    if record.across is not None:
        spectra = np.fft.rfft(record.across[:, :, first:] * window, axis=2)
        variance, across = Across.of(spectra, variance, index, TEMPERING * step)
    weight = np.ascontiguousarray(1 / np.sqrt(variance[:, index].T))
    chosen = (np.asarray(freq[index]), np.asarray(index, dtype=np.int64), U, Yfull[:, index].T, weight)
    if modal is None or n_tuned == 0 or not record.driven or sigma > _core.closing_sigma(n * record.dt):
        return _made(record, reduced, sigma, chosen, n, (step, each), across)
    s = np.asarray(sigma + 2j * np.pi * freq[index], dtype=np.complex128)
    second = np.fft.rfft(record.second[:, first:] * window, axis=1)[:, index].T
    rows = reduced.rows(record.out_rows, record.out_signs), reduced.rows(record.in_rows, record.in_signs)
    beside = cut_off(s, np.asarray(second / s[:, None] ** 2 - U), modal, rows, n_tuned, record.driven_to)
    return _made(record, reduced, sigma, chosen, n, (step, each), across, np.ascontiguousarray(beside))


def _of_frf(
    record: FitRecord,
    frf: FrfLines,
    reduced: ReducedModel,
    band: tuple[float, float],
    sigma: float,
    limit: int | None,
    modal: tuple[FloatArray, FloatArray, FloatArray] | None,
    zeta: float,
) -> Lines:
    """Lines of an FRF; of each group of neighbours the one with the strongest response over its noise. Damped ones are
    told from those of a model of the modes `modal`."""
    if frf.step == 0:
        sigma = 0.0
    H, variance = frf.H, frf.noise**2
    if sigma > 0:
        H, variance = damped(frf, sigma, partial(_accelerances, record, reduced, modal))
    variance = variance + frf.allowance**2 * smoothed((np.abs(H) ** 2).T).T
    shown = (np.abs(H) ** 2 / variance).sum(axis=1)
    index, step, each = _chosen(frf.freq, band, (shown, None), (sigma, zeta, limit))
    across = None
    if record.across is not None and sigma == 0:
        spectra = np.asarray(record.across, dtype=np.complex128)
        raised, across = Across.of(spectra, variance.T, index, TEMPERING * step)
        variance = raised.T
    weight = np.ascontiguousarray(1 / np.sqrt(variance[index]))
    ones = np.ones((len(index), 1), dtype=complex)
    chosen = (frf.freq[index], index, ones, H[index], weight)
    return _made(record, reduced, sigma, chosen, record.n, (step, each), across)


def _accelerances(
    record: FitRecord,
    reduced: ReducedModel,
    modal: tuple[FloatArray, FloatArray, FloatArray] | None,
    s: ComplexArray,
) -> ComplexArray:
    """Accelerances (K, n_out) of the only force of a record at s (K,), of modes as of `spectral_lines`; 0 without."""
    if modal is None:
        return np.zeros((len(s), len(record.out_rows)), dtype=complex)
    omega, zeta, Q = modal
    outs = reduced.rows(record.out_rows, record.out_signs) @ Q
    (at,) = reduced.rows(record.in_rows, record.in_signs) @ Q
    return np.asarray((at * modal_accelerances(omega, zeta, s)) @ outs.T)


def modal_accelerances(omega: FloatArray, zeta: FloatArray, s: ComplexArray) -> ComplexArray:
    """Acceleration (K, r) of each of the modes of omega and zeta (r,) by its modal force, at s (K,)."""
    s = s[:, None]
    return np.asarray(s**2 / (s**2 + 2 * zeta * omega * s + omega**2))


def _made(
    record: FitRecord,
    reduced: ReducedModel,
    sigma: float,
    chosen: tuple[FloatArray, NDArray[np.int64], ComplexArray, ComplexArray, FloatArray],
    n: int,
    stands_for: tuple[int, float],
    across: Across | None = None,
    beside: ComplexArray | None = None,
) -> Lines:
    """The lines with the core's object from chosen (freq, index, U, Y, weight), each of which counts as so many and is
    one of so many recorded (`stands_for`, as from `_chosen`); `across` is what sensors may pick up, `beside` (K, n_out)
    what the record's end cuts off."""
    freq, index, U, Y, weight = chosen
    step, each = stands_for
    picked_up = None if across is None else PickedUp.of(across, weight, TEMPERING * step)
    core = _core.RecordLines(
        np.asarray(sigma + 2j * np.pi * freq, dtype=np.complex128),
        np.ascontiguousarray(U),
        np.ascontiguousarray(Y),
        weight,
        np.ascontiguousarray(reduced.rows(record.out_rows, record.out_signs)),
        np.ascontiguousarray(reduced.rows(record.in_rows, record.in_signs)),
        record.dt,
        sigma,
        n,
        each,
        TEMPERING * step / each,
        beside,
        None if across is None else (across.sensor.tolist(), across.motion, ACROSS_SD),
        record.driven_to,
    )
    return Lines(record, sigma, freq, index, U, Y, weight, TEMPERING * step, core, picked_up)


def _chosen(
    freq: FloatArray,
    band: tuple[float, float],
    power: tuple[FloatArray, FloatArray | None],
    how: tuple[float, float, int | None],
) -> tuple[NDArray[np.int64], int, float]:
    """Which lines of an axis `freq` (Hz) in a band are taken, by the `power` they show and that of the recorded force,
    with how many that tell something each counts as, and of how many recorded ones each is one. `how` are the window's
    decay, the damping ratio that gives resonances their width, and about how many lines are taken at most."""
    (shown, force), (sigma, zeta, limit) = power, how
    inside = np.asarray(np.flatnonzero(within_band(freq, band)), dtype=np.int64)
    index = spaced(inside, freq, force, zeta)
    closer = len(inside) / max(len(index), 1)
    step = max(1, int(round(sigma / (2 * np.pi) / (freq[1] - freq[0]) / closer / 2))) if sigma > 0 else 1
    if limit is not None:
        step = max(step, -(-len(index) // limit))
    return _thinned(index, shown, step), step, step * closer


def _thinned(index: NDArray[np.int64], power: FloatArray, step: int) -> NDArray[np.int64]:
    if step == 1:
        return index
    whole = len(index) // step * step
    groups = index[:whole].reshape(-1, step)
    return groups[np.arange(len(groups)), np.argmax(power[groups], axis=1)]
