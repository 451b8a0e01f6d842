"""The motion in a run of a structure that changes with the speed, with the speed of every instant."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate.joint.receptance import Receptance
from femend.estimate.joint.rotor import Run
from femend.model.terms.configured import ConfiguredModel

__all__ = ["turning_motion"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# rounds at most, and relative change at which they end
ROUNDS, SETTLED = 40, 1e-4


def turning_motion(
    model: ConfiguredModel, p: FloatArray, run: Run, sense: int, solved: Receptance, loads: ComplexArray
) -> ComplexArray:
    """Motion (K, r) of the basis on the first K lines of `run` to `loads` (K, r), at the unknowns `p` (n,).

    `solved` is the receptance with every line turning at its own speed, where the run drives it. What still rings
    behind a resonance does so at a speed that has gone on: x = X (f - (T(t) - T(s)) x), T(t) being the forces of the
    speed of every instant and T(s) those of the lines. The rounds are mixed so that least is left (Anderson, J. ACM 12
    (1965) 547-560; for a linear problem like this one the same as GMRES, Walker and Ni, SIAM J. Numer. Anal. 49 (2011)
    1715-1735), since near a resonance they do not settle by themselves.
    """
    x = np.asarray((solved.X @ loads[:, :, None])[:, :, 0])
    if not model.turning:
        return x
    places: list[FloatArray] = []
    steps: list[FloatArray] = []
    for _ in range(ROUNDS):
        more = _of_the_instant(model, p, run, sense, solved.s, x)
        step = (solved.X @ (loads - more)[:, :, None])[:, :, 0] - x
        places.append(_real(x))
        steps.append(_real(step))
        if np.linalg.norm(step) <= SETTLED * np.linalg.norm(x):
            break
        new = places[-1] + steps[-1]
        if len(steps) > 1:
            dR = np.diff(np.array(steps), axis=0).T
            mixed = np.linalg.lstsq(dR, steps[-1], rcond=1e-10)[0]
            new = new - (np.diff(np.array(places), axis=0).T + dR) @ mixed
        x = new.view(np.complex128).reshape(x.shape)
    return np.asarray(x)


def _of_the_instant(
    model: ConfiguredModel, p: FloatArray, run: Run, sense: int, s: ComplexArray, x: ComplexArray
) -> ComplexArray:
    """Forces (K, r) by which turning at the speed of every instant differs from turning at that of the lines."""
    v = model.unknowns.values(p)
    omega, lines = sense * run.omega, sense * np.abs(s)
    more = np.zeros_like(x)
    for part in model.turning:
        own = part.value(v) * part.matrix
        moving = (x * (s[:, None] if part.kind == "C" else 1.0)) @ own.T
        history = np.fft.irfft(np.pad(moving, [(0, len(run.freq) - len(s)), (0, 0)]), run.padded, axis=0)
        there = np.fft.rfft(history * part.over_speed.at(omega)[:, None], axis=0)[: len(s)]
        more += there - part.over_speed.at(lines)[:, None] * moving
    return more


def _real(values: ComplexArray) -> FloatArray:
    return np.ascontiguousarray(values).view(np.float64).ravel()
