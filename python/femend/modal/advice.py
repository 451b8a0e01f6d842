"""What a person should look at in a modal test."""

from __future__ import annotations

import numpy as np

from femend.modal.result import ModalTest

__all__ = ["advice_on"]


def advice_on(test: ModalTest, converged: bool, correlation: float) -> tuple[str, tuple[str, ...]]:
    """Status ("ok", "doubtful", "no modes") and advice on `test`, whose fit `converged` and left residuals that go
    together over `correlation` lines. Raises nothing."""
    said = [check.message for check in test.checks if check.message]
    band = f"{test.measured.freq[0]:.4g} to {test.measured.freq[-1]:.4g} Hz"
    if not test.modes.n_modes:
        said.append(
            f"no mode was found from {band} in {test.measured.H.shape[1] * test.measured.H.shape[2]} FRFs; look at the "
            "stabilisation diagram, try another band or a higher max_order"
        )
        return "no modes", tuple(said)
    doubtful = bool(said)
    if not converged:
        doubtful = True
        said.append("the fit of poles and shapes did not settle; narrow the band to fewer modes")
    if test.error > 0.2 and test.error > 3 * test.noise_share:
        doubtful = True
        said.append(
            f"the resynthesis misses {100 * test.error:.0f} % of the FRFs, where scatter from line to line explains "
            f"{100 * test.noise_share:.0f} %: modes are missing in {band}, or the structure is not linear"
        )
    said += _poor_frfs(test) + _poor_modes(test)
    if not test.driving_points:
        said.append("no driving point was measured: shapes have no scale and modal masses are unknown")
    if correlation > 10 and test.error > 1e-3:
        said.append(
            f"residuals go together over {correlation:.0f} lines: the misfit is not noise, and the deviations of the "
            "modes are those of that many fewer lines"
        )
    return ("doubtful" if doubtful else "ok"), tuple(said)


def _poor_frfs(test: ModalTest) -> list[str]:
    size = np.sqrt(np.mean(np.abs(test.measured.H) ** 2, axis=0))
    typical = float(np.median(size))
    said = []
    for o, i in np.argwhere((test.frf_error > 0.5) & (test.frf_error > 3 * test.error) & (size > 0.1 * typical)):
        pair = f"{test.measured.outputs[o].dof} / {test.measured.inputs[i].dof}"
        said.append(
            f"the modes explain the FRF {pair} to {100 * (1 - test.frf_error[o, i]):.0f} % only, the others better: "
            "check its sensor and its label"
        )
    return said


def _poor_modes(test: ModalTest) -> list[str]:
    said = []
    for r in range(test.modes.n_modes):
        name = f"mode {r + 1} at {test.modes.freq[r]:.4g} Hz"
        if test.mpc[r] < 0.8:
            said.append(
                f"{name}: shape is complex (MPC {test.mpc[r]:.2f}, mean phase deviation {test.mpd[r]:.0f} degrees); "
                "it is local damping, a neighbour not separated, or noise"
            )
        if test.mass_sd_share[r] > 0.2:
            said.append(
                f"{name}: the driving point hardly moves, its modal mass is known to "
                f"{100 * min(float(test.mass_sd_share[r]), 9.99):.0f} % only"
            )
    return said
