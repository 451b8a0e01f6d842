"""A harmonic force nobody recorded: its frequency, and its two amplitudes in every recording.

For one frequency the response is linear in the amplitudes of cosine and sine, so that the cost of a recording, its free
decays eliminated, is a quadratic of both whose minimum is known at once, for many frequencies together. A force that
begins with the recording does not begin at once; where that shows, cosine and sine that die away have amplitudes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.loads.loads import with_force
from femend.estimate import Fit, FitRecord, Hypothesis, Problem
from femend.model import ReducedModel

__all__ = ["Harmonic", "fit_harmonic"]

FloatArray = NDArray[np.float64]

# frequencies tried around each of the strongest peaks, within the inverse record length, and how often they close in
PEAKS, AROUND, CLOSER = 3, 7, 2
# times the model and the force are fitted in turns, and how near the last frequency the next is looked for
ROUNDS, NEARER = 3, 0.1
# periods in which what belongs to the onset alone dies away, and the fall of the cost from which there is one
ONSET, WORTH = (1.0, 3.0, 9.0), 40.0


@dataclass(frozen=True, eq=False)
class Harmonic:
    """Force a cos + b sin at `freq` (Hz) from the beginning of each record; `amplitudes` (n_records, 2), or more with
    those of the onset after them, `fit` of the model's unknowns with it, `problem` with the forces in its records."""

    row: int
    freq: float
    amplitudes: FloatArray
    fit: Fit
    problem: Problem

    def waveform(self, amplitudes: FloatArray, n: int, dt: float) -> FloatArray:
        """Samples (n,) of a force with amplitudes (2,), or more with an onset."""
        return _waves(self.freq, n, dt, len(amplitudes)) @ amplitudes

    @property
    def size(self) -> FloatArray:
        """Amplitude (n_records,) once the onset is over."""
        return np.asarray(np.linalg.norm(self.amplitudes[:, :2], axis=1))

    def on(self, problem: Problem, reduced: ReducedModel) -> Problem:
        """All lines of other records with the force in them, its amplitudes taken from them, at the fitted unknowns."""
        problem = problem.thinned(None)
        ((amplitudes, _),) = _amplitudes(problem, reduced, self.fit.p, self.row, [self.freq], self.amplitudes.shape[1])
        return _loaded(problem, self.row, self.freq, amplitudes)


def fit_harmonic(
    problem: Problem,
    reduced: ReducedModel,
    row: int,
    seen: list[tuple[FloatArray, FloatArray]],
    starts: Sequence[FloatArray],
) -> Harmonic | None:
    """The harmonic force at row `row` of the g-set that explains the records best.

    `seen` are frequencies (K,) in Hz and the power (K,) that a force there shows at the sensors, of every record;
    `starts` are unknowns of the model (n_unknowns,), each tried as where its fit begins. None where the model cannot be
    fitted.
    """
    # on all lines: thinned ones would be others for every force that is tried
    problem = problem.thinned(None)
    nothing = Hypothesis(reduced, np.zeros((0, reduced.r)))
    width = 1.0 / (problem.records[0].n * problem.records[0].dt)
    freqs = _peaks(seen)
    begun = [(_closest(problem, reduced, start, row, freqs, width), start) for start in starts]
    (_, freq, amplitudes), p = min(begun, key=lambda b: b[0][0] + problem.prior_cost(reduced, b[1]))
    for _ in range(ROUNDS):
        found = _fitted(problem, nothing, p, row, freq, amplitudes)
        if found is None:
            return None
        p = found.fit.p
        _, freq, amplitudes = _closest(problem, reduced, p, row, [freq], width * NEARER)
    found = _fitted(problem, nothing, p, row, freq, amplitudes)
    return None if found is None else _with_onset(problem, found, nothing)


def _fitted(
    problem: Problem, nothing: Hypothesis, p: FloatArray, row: int, freq: float, amplitudes: FloatArray
) -> Harmonic | None:
    """The force with its model fitted from unknowns `p`; None where the model cannot be fitted."""
    loaded = _loaded(problem, row, freq, amplitudes)
    (fit,) = loaded.fit([nothing], [(p, np.zeros(0))], iterations=8)
    return None if fit is None else Harmonic(row, freq, amplitudes, fit, loaded)


def _with_onset(problem: Problem, steady: Harmonic, nothing: Hypothesis) -> Harmonic:
    """The harmonic force with an onset of its own, where that explains clearly more."""
    found, row, freq = steady, steady.row, steady.freq
    for _ in range(ROUNDS):
        ((amplitudes, _),) = _amplitudes(problem, nothing.reduced, found.fit.p, row, [freq], 2 + 2 * len(ONSET))
        new = _fitted(problem, nothing, found.fit.p, row, freq, amplitudes)
        if new is None or new.fit.cost > found.fit.cost - WORTH:
            break
        found = new
    return found


def _closest(
    problem: Problem, reduced: ReducedModel, p: FloatArray, row: int, freqs: list[float], width: float
) -> tuple[float, float, FloatArray]:
    """Least cost, its frequency and amplitudes (n_records, 2), within `width` (Hz) of one of `freqs`."""
    best = (np.inf, freqs[0], np.zeros((len(problem.records), 2)))
    for _ in range(CLOSER):
        tried = [f + d * width for f in freqs for d in np.linspace(-1, 1, AROUND)]
        for freq, (amplitudes, cost) in zip(tried, _amplitudes(problem, reduced, p, row, tried), strict=True):
            if cost < best[0]:
                best = (cost, freq, amplitudes)
        freqs, width = [best[1]], width / AROUND * 2
    return best


def _waves(freq: float, n: int, dt: float, columns: int) -> FloatArray:
    """Cosine and sine (n, 2), and with more `columns` those that die away."""
    t = 2 * np.pi * freq * dt * np.arange(n)
    both = np.column_stack([np.cos(t), np.sin(t)])
    dying = [both * np.exp(-t / (2 * np.pi * periods))[:, None] for periods in ONSET]
    return np.hstack([both, *dying])[:, :columns]


def _peaks(seen: list[tuple[FloatArray, FloatArray]]) -> list[float]:
    """Frequencies (Hz) of the strongest lines, each record weighing the same."""
    freq = np.concatenate([f for f, _ in seen])
    power = np.concatenate([p / max(float(p.sum()), 1e-300) for _, p in seen])
    found: list[float] = []
    for i in np.argsort(-power):
        if all(abs(freq[i] - f) > 2 * abs(seen[0][0][1] - seen[0][0][0]) for f in found):
            found.append(float(freq[i]))
        if len(found) == PEAKS:
            break
    return found


def _with(record: FitRecord, row: int, freq: float, amplitudes: FloatArray) -> FitRecord:
    return with_force(record, row, _waves(freq, record.n, record.dt, len(amplitudes)) @ amplitudes)


def _loaded(problem: Problem, row: int, freq: float, amplitudes: FloatArray) -> Problem:
    return problem.on([_with(r, row, freq, a) for r, a in zip(problem.records, amplitudes, strict=True)])


def _amplitudes(
    problem: Problem, reduced: ReducedModel, p: FloatArray, row: int, freqs: Sequence[float], n: int = 2
) -> list[tuple[FloatArray, float]]:
    """Best amplitudes (n_records, n) at each of the frequencies (Hz), and the cost they leave."""
    system, place = problem.system(reduced), np.ascontiguousarray(reduced.rows([row])[0])
    amplitudes, costs = np.zeros((len(freqs), len(problem.records), n)), np.zeros(len(freqs))
    for i, line in enumerate(problem.lines(reduced)):
        waves = np.hstack([_waves(freq, line.record.n, line.record.dt, n) for freq in freqs])
        spectra = np.fft.rfft(waves[line.first :], axis=0)[line.index]
        products = _core.force_products(system, line.core, place, np.ascontiguousarray(spectra), p)
        for k in range(len(freqs)):
            if products is None:
                costs[k] = np.inf
                continue
            own = slice(1 + k * n, 1 + (k + 1) * n)
            b, A = products[own, 0], products[own, own]
            positive = bool(np.all(np.isfinite(A))) and float(np.linalg.eigvalsh(A).min()) > 0
            amplitudes[k, i] = np.linalg.solve(A, b) if positive else np.zeros(n)
            costs[k] += products[0, 0] - amplitudes[k, i] @ b
    return [(a, float(cost)) for a, cost in zip(amplitudes, costs, strict=True)]
