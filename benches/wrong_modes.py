"""What a measured mode that is paired wrongly does to an update: `python benches/wrong_modes.py [STRUCTURES]`.

Two chains of six masses, in X and in Y, weakly coupled, whose modes come in close pairs; five factors (four
stiffnesses, a mass) with a prior of 30 % are updated on six modes, frequencies known to 0.3 % and shapes to 5 %, and
the true factors lie 20 % about the deck. In half of the runs the test shows a seventh mode: like one of the model with
something else in it, up to 25 % off in frequency. Every spring and mass of the structure may be off by what no factor
makes up for. Told is the error of the factors (RMS of the logarithm, the middle one of all structures and the worst
tenth) with the honest modes alone, with all modes, and with those left out that all others contradict.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.errors import UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    System,
    Unknowns,
    UpdateResult,
    affine_matrices,
    factor,
    modal_system,
    update,
)

Array = NDArray[np.float64]
N, MODES = 6, 6
NAMES = ("kx lower", "kx upper", "ky lower", "ky upper", "tip")
FREQ_SD, FIT_SD, SHAPE_SD = 0.002, 0.002, 0.05
# stiffness along Y over that along X, coupling, and the mass at the tip beside masses of 1
ASIDE, COUPLING, TIP = 1.05**2, 0.02, 0.5


def chain(springs: Array) -> Array:
    """Stiffness of masses in a row on `springs` (N,), the first of which is to ground."""
    K = np.zeros((N, N))
    for i, k in enumerate(springs):
        b = np.zeros(N)
        b[i] = 1.0
        if i:
            b[i - 1] = -1.0
        K += k * np.outer(b, b)
    return K


def both(x: Array, y: Array) -> Array:
    """Stiffness of two chains on the springs `x` and `y` (N,), not coupled."""
    return np.block([[chain(x), np.zeros((N, N))], [np.zeros((N, N)), chain(y)]])


def deck() -> System:
    """The structure as modelled, with its five factors."""
    lower = np.repeat([1.0, 0.0], N // 2)
    none = np.zeros(N)
    parts = [(lower, none), (1 - lower, none), (none, ASIDE * lower), (none, ASIDE * (1 - lower))]
    tip = np.diag(np.tile(np.append(np.zeros(N - 1), TIP), 2))
    K = {name: both(x, y) for name, (x, y) in zip(NAMES[:4], parts, strict=True)}
    eye = np.eye(N)
    coupling = COUPLING * np.block([[eye, -eye], [-eye, eye]])
    matrices = affine_matrices(K, np.eye(2 * N), K_fixed=coupling, M_parts={NAMES[4]: tip})
    return modal_system(matrices, list(range(2 * N)), MODES + 3)


@dataclass(frozen=True, eq=False)
class Test:
    """The true factors (5,), and what a test shows: `freq` (n_modes,), `phi` (2 N, n_modes), and the number of the
    `wrong` mode among them, -1 for none."""

    truth: Array
    freq: Array
    phi: Array
    wrong: int = -1

    def problem(self, system: System) -> Problem:
        """The update of the factors of `system` on this test."""
        responses = (
            Frequencies(self.freq, np.hypot(FREQ_SD, FIT_SD) * self.freq),
            ShapeDifferences(self.phi, SHAPE_SD),
        )
        unknowns = Unknowns.of([factor(name, 0.3, (0.2, 5.0)) for name in NAMES])
        return Problem(unknowns, (Configuration("test", system, responses, ModeTest(self.freq, self.phi)),))

    def error(self, found: UpdateResult) -> float:
        """RMS of the logarithm of the factors found over the true ones."""
        return float(np.sqrt(np.mean(np.log(np.array(list(found.values.values())) / self.truth) ** 2)))


def honest(rng: np.random.Generator, form: float) -> Test:
    """Six modes of a structure whose springs and masses are each off by `form` (1-sigma)."""
    truth = np.exp(0.2 * rng.standard_normal(5))
    springs = np.exp(form * rng.standard_normal((2, N)))
    masses = np.exp(form * rng.standard_normal(2 * N))
    x, y = (np.repeat(truth[i : i + 2], N // 2) * springs[i // 2] for i in (0, 2))
    eye = np.eye(N)
    K = both(x, ASIDE * y) + COUPLING * np.block([[eye, -eye], [-eye, eye]])
    M = np.diag(masses + truth[4] * np.tile(np.append(np.zeros(N - 1), TIP), 2))
    lam, phi = eigh(K, M, subset_by_index=[0, MODES - 1])
    freq = np.sqrt(lam) / (2 * np.pi) * (1 + FIT_SD * rng.standard_normal(MODES))
    phi = phi / np.abs(phi).max(axis=0) + 0.6 * SHAPE_SD * rng.standard_normal(phi.shape)
    return Test(truth, freq, phi / np.abs(phi).max(axis=0))


def with_a_wrong_mode(rng: np.random.Generator, test: Test, system: System) -> Test:
    """The `test` with a mode that the model lacks: of a MAC of 0.5 to 0.9 with one that it has."""
    state = system.solve(np.ones(5))
    freq, phi = state.value("freq"), state.value("phi") / np.abs(state.value("phi")).max(axis=0)
    while True:
        like, other = rng.integers(0, MODES + 2), rng.integers(0, phi.shape[1])
        shape = phi[:, like] + rng.choice([-1, 1]) * rng.uniform(0.3, 0.9) * phi[:, other]
        shape += 0.1 * rng.standard_normal(2 * N)
        mac = (shape @ phi) ** 2 / (shape @ shape) / (phi**2).sum(axis=0)
        if 0.5 < mac.max() < 0.9:
            break
    at = freq[like] * np.exp(rng.uniform(-0.25, 0.25))
    order = np.argsort(np.append(test.freq, at))
    columns = np.column_stack([test.phi, shape / np.abs(shape).max()])
    wrong = int(np.flatnonzero(order == MODES)[0])
    return Test(test.truth, np.append(test.freq, at)[order], columns[:, order], wrong)


def main(n: int) -> None:
    """Prints the table for `n` structures."""
    system = deck()
    print("form  modes       tests   honest modes   all modes      as told        wrong left out  honest left out")
    for form in (0.0, 0.05, 0.15):
        for extra in (False, True):
            errors: list[tuple[float, float, float]] = []
            out, lost = 0, 0
            for seed in range(n):
                rng = np.random.default_rng(seed)
                plain = honest(rng, form)
                test = with_a_wrong_mode(rng, plain, system) if extra else plain
                try:
                    alone = update(plain.problem(system), doubt=False)
                    led = update(test.problem(system), doubt=False)
                except UpdatingError:
                    continue
                (mates,) = led.after.mates
                if extra and (mates is None or mates.mate[test.wrong] < 0):
                    continue  # it has no mate, so that it never leads
                found = update(test.problem(system))
                errors.append((plain.error(alone), test.error(led), test.error(found)))
                left = {mode for _, mode in found.problem.left_out}
                out, lost = out + (test.wrong in left), lost + len(left - {test.wrong})
            told = [f"{np.median(e):.3f} ({np.quantile(e, 0.9):.3f})" for e in np.array(errors).T]
            kind = "one wrong" if extra else "all honest"
            print(
                f"{form:4.2f}  {kind:10s} {len(errors):6d}   {told[0]}  {told[1]}  {told[2]}  {out:14d}  {lost:15d}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 150)
