"""What a person should look at in a modal test."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.modal.held_band import held_band
from femend.modal.indicators import lines_near
from femend.modal.parts import misses
from femend.modal.result import ModalTest
from femend.numerals import plain

__all__ = ["advice_on"]

# share of their axes from which two poles may be one mode: of sways along two axes, a bandwidth apart, neither is
IN_COMMON = 0.5


def advice_on(test: ModalTest, converged: bool, correlation: float, conjugate: int = 0) -> tuple[str, tuple[str, ...]]:
    """Status ("ok", "doubtful", "no modes") and advice on `test`, whose fit `converged` and left residuals that go
    together over `correlation` lines; of one without modes the conjugates of its FRFs show `conjugate`. Raises
    nothing."""
    said = [check.message for check in test.checks if check.message]
    band = f"{plain(test.measured.freq[0])} to {plain(test.measured.freq[-1])} Hz"
    if not test.modes.n_modes:
        none = f"no mode was found from {band} in {test.measured.H.shape[1] * test.measured.H.shape[2]} FRFs"
        if conjugate:  # their driving points look upside down, and are not
            return "no modes", (
                f"{none}, and {plain(conjugate)} in their complex conjugates: they follow exp(-i omega t), or their "
                "phases have the other sign, and femend takes exp(+i omega t); change the sign of all imaginary parts "
                "(or phases)",
            )
        said.append(f"{none}; look at the stabilisation diagram, try another band or a higher max_order")
        return "no modes", tuple(said)
    doubtful = bool(said)
    if not converged:
        doubtful = True
        said.append("the fit of poles and shapes did not settle; narrow the band to fewer modes")
    if misses(test.error**2, 1.0, test.noise_share**2):
        doubtful = True
        said.append(
            f"the resynthesis misses {100 * test.error:.0f} % of the FRFs, where scatter from line to line explains "
            f"{100 * test.noise_share:.0f} %: modes are missing in {band}, or the structure is not linear"
            f"{_held(test)}"
        )
    poor = _poor_frfs(test) + _split_modes(test)
    doubtful = doubtful or bool(poor)
    said += poor + _poor_modes(test)
    if not test.driving_points:
        said.append("no driving point was measured: shapes have no scale and modal masses are unknown")
    if correlation > 10 and test.error > 1e-3:
        said.append(
            f"residuals go together over {correlation:.0f} lines: the misfit is not noise, and the deviations of the "
            "modes are those of that many fewer lines"
        )
    return ("doubtful" if doubtful else "ok"), tuple(said)


def _held(test: ModalTest) -> str:
    """Where the modes do explain the FRFs, in words."""
    band = held_band(test)
    return "" if band is None else f"; from {plain(band[0])} to {plain(band[1])} Hz the modes found explain them"


def _poor_frfs(test: ModalTest) -> list[str]:
    size = np.sqrt(np.mean(np.abs(test.measured.H) ** 2, axis=0))
    said = [
        f"the FRF {test.measured.outputs[o].dof} / {test.measured.inputs[i].dof} is 0 on all lines: a dead channel"
        for o, i in np.argwhere(size == 0)
    ]
    poor = (test.frf_error > 0.5) & (test.frf_error > 3 * np.median(test.frf_error)) & (size > 0.1 * np.median(size))
    for o, i in np.argwhere(poor):
        pair = f"{test.measured.outputs[o].dof} / {test.measured.inputs[i].dof}"
        said.append(
            f"the modes miss {100 * test.frf_error[o, i]:.0f} % of the FRF {pair}, and "
            f"{100 * np.median(test.frf_error):.0f} % of the others: check its sensor, its label and its coherence"
        )
    return said


def _split_modes(test: ModalTest) -> list[str]:
    """Modes that may be one mode, which FRFs of slightly different structures have at slightly different frequencies.

    Fitted with common poles such FRFs give two poles within a bandwidth, whose residues nearly cancel at some DOFs:
    their shapes are complex, and the residue at a driving point is not that of a positive mass (2 i omega_d A > 0).
    """
    poles, freq = test.modes.poles, test.modes.freq
    off, common = _driving_point_angle(test), _common_axes(test)
    said = []
    for r in range(poles.size - 1):
        for q in range(r + 1, poles.size):
            if abs(poles[q] - poles[r]) > 2 * (abs(poles[r].real) + abs(poles[q].real)) or common[r, q] < IN_COMMON:
                continue
            complex_, mass = min(test.mpc[r], test.mpc[q]), max(off[r], off[q])
            if complex_ < 0.9 or mass > 45:
                told = f"MPC {complex_:.2f}" + (f", driving-point residue {mass:.0f} degrees off" if mass > 45 else "")
                said.append(
                    f"modes {r + 1} and {q + 1} at {freq[r]:.5g} and {freq[q]:.5g} Hz lie within their bandwidths and "
                    f"are not modes of one lightly damped structure ({told}): probably one mode, which the FRFs have "
                    "at different frequencies (roving mass, temperature, level of excitation)"
                )
    return said


def _common_axes(test: ModalTest) -> NDArray[np.float64]:
    """How far every two of the modes move in the same axes (n_modes, n_modes), 0 for sways along two of them, 1 for
    shapes in the same ones: the roots of their shares of motion an axis, multiplied and summed."""
    axis = np.array([0 if d is None else d.component for d in test.modes.dofs])
    power = np.abs(test.modes.shapes) ** 2
    share = np.array([power[axis == c].sum(axis=0) for c in np.unique(axis)]) / np.maximum(power.sum(axis=0), 1e-300)
    return np.asarray(np.sqrt(share).T @ np.sqrt(share))


def _driving_point_angle(test: ModalTest) -> NDArray[np.float64]:
    """Angle in degrees of 2 i omega_d A, the mean over the driving points by the size of A, of modes that stand out of
    noise there (n_modes,). Of a point that hardly moves in a mode any phase is that of light damping; one that is
    told to be upside down, or no one place, tells nothing of modes."""
    modes = test.modes
    angle, size = np.zeros(modes.n_modes), np.full(modes.n_modes, 1e-300)
    if modes.participation is None:
        return angle
    doubted = {c.subject for c in test.checks if c.kind == "driving point" and c.message}
    for point in test.driving_points:
        if doubted & {str(point.dof), str(point.dof.unsigned)}:
            continue
        A = point.sign * modes.shapes[point.response] * modes.participation[:, point.reference]
        angle += np.abs(A) * np.abs(np.angle(2j * modes.poles.imag * A, deg=True))
        size += np.abs(A)
    return np.where(test.mass_sd_share < 0.2, angle / size, 0.0)


def _poor_modes(test: ModalTest) -> list[str]:
    """What is poor about modes, each fault in one sentence for all modes that have it."""
    poor: dict[str, list[tuple[int, str]]] = {"complex": [], "local": [], "coherence": [], "driving": []}
    for r in range(test.modes.n_modes):
        if test.mpc[r] < 0.8:
            poor["complex"].append((r, f"MPC {test.mpc[r]:.2f}, mean phase deviation {test.mpd[r]:.0f} degrees"))
        size = np.abs(test.modes.shapes[:, r])
        if size.size >= 4 and np.sort(size)[-2] < 0.05 * size.max():
            poor["local"].append((r, str(test.modes.dofs[int(np.argmax(size))])))
        if test.measured.coherence is not None:
            lines = lines_near(test.measured.freq, test.modes.poles[r])
            typical = float(np.median(test.measured.coherence[lines]))
            if typical < 0.7:
                poor["coherence"].append((r, f"{typical:.2f}"))
        if test.mass_sd_share[r] > 0.2:
            poor["driving"].append((r, f"{100 * min(float(test.mass_sd_share[r]), 9.99):.0f} %"))
    return [_said_of(test, kind, found) for kind, found in poor.items() if found]


def _said_of(test: ModalTest, kind: str, found: list[tuple[int, str]]) -> str:
    """One fault of a `kind`, of the modes that were `found` with it and how far each has it."""
    name = [f"{r + 1} at {plain(test.modes.freq[r])} Hz" for r, _ in found]
    if len(found) == 1:
        told = found[0][1]
        return (
            f"mode {name[0]}: "
            + {
                "complex": f"shape is complex ({told}); it is local damping, a neighbour not separated, or noise",
                "local": f"only {told} moves; it is local, or that channel is from another place or test",
                "coherence": f"the coherence around it is {told}; average more, or look for nonlinearity",
                "driving": f"the driving point hardly moves, its modal mass is known to {told} only",
            }[kind]
        )
    return (
        f"modes {', '.join(f'{n} ({told})' for n, (_, told) in zip(name, found, strict=True))}: "
        + {
            "complex": "shapes are complex; it is local damping, neighbours not separated, or noise",
            "local": "one channel alone moves; they are local, or it is from another place or test",
            "coherence": "the coherence around them is low; average more, or look for nonlinearity",
            "driving": "the driving point hardly moves, their modal masses are known to these shares only",
        }[kind]
    )
