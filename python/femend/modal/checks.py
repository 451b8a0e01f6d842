"""Sensors that are upside down, swapped or elsewhere: what reciprocity, driving points and rigid motion say."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Geometry
from femend.dof import Dof
from femend.errors import RecordingError

__all__ = [
    "SensorCheck",
    "driving_point_checks",
    "reciprocity_checks",
    "rigid_body_check",
    "rigid_body_rows",
    "swap_check",
]

# A pair of reciprocal FRFs of a good test differs by a few per cent; a reversed one by 200 %, two of unrelated points
# by about 140 % (independent vectors). The limits stand between.
_DIFFERS, _AGREES = 0.5, 0.25
# A line stands clear of noise at three times its deviation, as one of ten thousand does by chance; two FRFs are
# compared where one line in fifty does at least.
_CLEAR, _SHARE = 3.0, 0.02
# Sensors pick up to five per cent of what moves across them, and blows are as far off: two FRFs that are smaller than
# that beside their driving points show no coupling, but what leaks.
_ACROSS = 0.05


@dataclass(frozen=True, slots=True)
class SensorCheck:
    """One check: `kind` (reciprocity, driving point, swap, rigid body), the `subject` by name, `verdict` "ok",
    "reversed", "swapped", "differs" or "not decided", the measured `value`, and a `message` where it is not ok."""

    kind: str
    subject: str
    verdict: str
    value: float
    message: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "kind": self.kind,
            "subject": self.subject,
            "verdict": self.verdict,
            "value": self.value,
            "message": self.message,
        }


def _rows(dofs: tuple[Dof | None, ...]) -> dict[Dof, tuple[int, int]]:
    """Unsigned DOF -> row and sign, the first where one occurs twice."""
    found: dict[Dof, tuple[int, int]] = {}
    for row, dof in enumerate(dofs):
        if dof is not None:
            found.setdefault(dof.unsigned, (row, dof.sign))
    return found


def _common(frf: FRF) -> tuple[list[Dof], NDArray[np.complex128]]:
    """DOFs that are outputs and inputs, and H (n_freq, m, m) between them in positive senses."""
    outputs, inputs = _rows(frf.output_dofs), _rows(frf.input_dofs)
    common = [dof for dof in outputs if dof in inputs]
    rows, columns = [outputs[d][0] for d in common], [inputs[d][0] for d in common]
    signs = np.array([outputs[d][1] for d in common])[:, None] * np.array([inputs[d][1] for d in common])[None, :]
    return common, frf.H[:, rows][:, :, columns] * signs


def reciprocity_checks(frf: FRF) -> tuple[SensorCheck, ...]:
    """Compares H(a / b) with H(b / a) for every pair of DOFs that were both struck and measured.

    The value is |H_ab - H_ba| / |mean of their sizes| over the lines of `frf` on which one of them stands clear of the
    noise, less what noise makes of it; above 0.5 the pair differs, and where -H_ba would fit within 0.25 it is
    reversed. Where hardly a line stands clear, or both are below 5 % of their driving points (two planes that do not
    couple), it is "not decided", with the value NaN.
    Maxwell-Betti reciprocity holds for any linear passive structure without gyroscopic terms. Raises nothing; no such
    pair gives an empty tuple.
    """
    common, H = _common(frf)
    noise = _scatter(H)
    found = []
    for a, b in combinations(range(len(common)), 2):
        pair = f"{common[a]} / {common[b]}"
        if not H[:, [a, b], [b, a]].any():
            continue
        clear = (np.abs(H[:, a, b]) > _CLEAR * noise[a, b]) | (np.abs(H[:, b, a]) > _CLEAR * noise[b, a])
        driven = np.sqrt(np.linalg.norm(H[:, a, a]) * np.linalg.norm(H[:, b, b]))
        largest = max(np.linalg.norm(H[:, a, b]), np.linalg.norm(H[:, b, a]))
        if clear.mean() < _SHARE or largest < _ACROSS * driven:
            found.append(SensorCheck("reciprocity", pair, "not decided", float("nan")))
            continue
        ab, ba = H[clear, a, b], H[clear, b, a]
        size = 0.5 * (np.linalg.norm(ab) + np.linalg.norm(ba))
        by_noise = int(clear.sum()) * (noise[a, b] ** 2 + noise[b, a] ** 2)
        apart, flipped = (
            float(np.sqrt(max(np.linalg.norm(ab - sign * ba) ** 2 - by_noise, 0.0)) / size) for sign in (1, -1)
        )
        if apart <= _DIFFERS:
            found.append(SensorCheck("reciprocity", pair, "ok", apart))
            continue
        verdict = "reversed" if flipped < _AGREES else "differs"
        told = (
            f"with the sign of one of them turned only {100 * flipped:.0f} %: a sensor or a hammer direction at "
            f"{common[a]} or {common[b]} is upside down"
            if verdict == "reversed"
            else f"check place and label of the sensors and blows at {common[a]} and {common[b]}"
        )
        message = f"reciprocity: H({pair}) and H({common[b]} / {common[a]}) differ by {100 * apart:.0f} %; {told}"
        found.append(SensorCheck("reciprocity", pair, verdict, apart, message))
    return tuple(found)


def _scatter(H: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Standard deviation (m, m) of the noise of H (n_freq, m, m): its median second difference from line to line, which
    resonances of few lines do not move, over what complex noise of deviation 1 has; 0 with fewer than five lines."""
    if len(H) < 5:
        return np.zeros(H.shape[1:])
    apart = np.abs(H[1:-1] - 0.5 * (H[:-2] + H[2:]))
    return np.asarray(np.median(apart, axis=0) / np.sqrt(1.5 * np.log(2.0)))


def swap_check(frf: FRF) -> SensorCheck | None:
    """Whether exchanging two outputs of `frf` makes it reciprocal; None where fewer than three DOFs are common or the
    matrix is reciprocal as it is.

    The value is the asymmetry |H - H^T| / |H + H^T| that the best exchange leaves; the outputs count as swapped where
    it falls below 0.25 and below a third of what it was. Raises nothing.
    """
    common, H = _common(frf)
    if len(common) < 3:
        return None

    def asymmetry(M: NDArray[np.complex128]) -> float:
        turned = M.transpose(0, 2, 1)
        whole = float(np.linalg.norm(M + turned))
        return float(np.linalg.norm(M - turned)) / whole if whole else 0.0

    before = asymmetry(H)
    if before < _AGREES:
        return None
    tried = []
    for a, b in combinations(range(len(common)), 2):
        order = np.arange(len(common))
        order[[a, b]] = b, a
        tried.append((asymmetry(H[:, order]), a, b))
    left, a, b = min(tried)
    if left > _AGREES or left > before / 3:
        return None
    pair = f"{common[a]} and {common[b]}"
    return SensorCheck(
        "swap",
        pair,
        "swapped",
        left,
        f"sensors {pair} are swapped: the FRF matrix is {100 * before:.0f} % asymmetric, with the two outputs "
        f"exchanged {100 * left:.0f} %; exchange their labels",
    )


def driving_point_checks(frf: FRF) -> tuple[SensorCheck, ...]:
    """Sign of each driving point of `frf`: a passive structure takes power, Re(mobility) >= 0 on every line.

    The value is sum(Re Y) / sum(|Re Y|): 1 for a driving point, -1 where sensor or blow is reversed ("reversed" below
    -0.5); in between ("differs") response and force are not at one place or not in one direction. Raises nothing.
    """
    common, H = _common(frf)
    d = {"receptance": 1, "mobility": 0, "accelerance": -1}[frf.kind]
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.where(frf.freq > 0, (2j * np.pi * frf.freq) ** d, 0.0)
    found = []
    for i, dof in enumerate(common):
        power = (H[:, i, i] * factor).real
        total = float(np.abs(power).sum())
        value = float(power.sum()) / total if total else 0.0
        if value > 0.5:
            found.append(SensorCheck("driving point", str(dof), "ok", value))
            continue
        verdict = "reversed" if value < -0.5 else "differs"
        what = "sensor or blow is upside down" if verdict == "reversed" else "sensor and blow are not at one place"
        message = (
            f"driving point {dof}: the real part of its mobility has the sign score {value:.2f} where a passive "
            f"structure has 1; {what}, check direction and label"
        )
        found.append(SensorCheck("driving point", str(dof), verdict, value, message))
    return tuple(found)


def rigid_body_rows(dofs: tuple[Dof, ...], geometry: Geometry) -> NDArray[np.float64]:
    """Displacement of `dofs` (n_dof, 6) under unit rigid translations and rotations about the origin of `geometry`.

    Raises RecordingError naming a node without coordinates.
    """
    at = {int(node): xyz for node, xyz in zip(geometry.ids, geometry.xyz)}
    rows = np.zeros((len(dofs), 6))
    for i, dof in enumerate(dofs):
        if dof.node not in at:
            raise RecordingError(f"rigid-body check: node {dof.node} has no coordinates; give them in the geometry")
        axis = np.zeros(3)
        axis[(dof.component - 1) % 3] = dof.sign
        rows[i] = np.r_[np.zeros(3), axis] if dof.is_rotation else np.r_[axis, np.cross(at[dof.node], axis)]
    return rows


def rigid_body_check(
    shapes: NDArray[np.complex128], dofs: tuple[Dof, ...], geometry: Geometry, *, tolerance: float = 0.1
) -> SensorCheck:
    """Whether `shapes` (n_dof, n_modes) at `dofs` move as one rigid body, and which sensor spoils it.

    The value is the share |shape - its rigid part| / |shape| over all modes, each mode counted alike. Above
    `tolerance` every single reversal and every exchange of two DOFs is tried: one that brings the share below
    `tolerance` and below a third is named, where no other comes within a factor 2. Otherwise the verdict is
    "not decided": the part may be elastic. Needs at least 9 DOFs, three more than a rigid body has. Raises
    RecordingError for a node without coordinates in `geometry`.
    """
    subject = f"{len(dofs)} DOFs"
    if len(dofs) < 9:
        return SensorCheck("rigid body", subject, "not decided", float("nan"), "")
    U, sizes, _ = np.linalg.svd(rigid_body_rows(dofs, geometry), full_matrices=False)
    Q = U[:, sizes > 1e-9 * sizes[0]]
    S = shapes / np.linalg.norm(shapes, axis=0)
    seen = Q.T @ S
    total = float(S.shape[1])

    def left(held: NDArray) -> NDArray[np.float64]:
        return np.sqrt(np.maximum(1.0 - np.sum(np.abs(held) ** 2, axis=(-2, -1)) / total, 0.0))

    before = float(left(seen))
    if before <= tolerance:
        return SensorCheck("rigid body", subject, "ok", before)
    flips = left(seen[None] - 2 * Q[:, :, None] * S[:, None, :])
    pairs = np.array(list(combinations(range(len(dofs)), 2)))
    a, b = pairs.T
    swaps = left(seen[None] + (Q[a] - Q[b])[:, :, None] * (S[b] - S[a])[:, None, :])
    options = sorted(
        [(float(v), "reversed", str(dofs[i])) for i, v in enumerate(flips)]
        + [(float(v), "swapped", f"{dofs[i]} and {dofs[j]}") for v, (i, j) in zip(swaps, pairs)]
    )
    best, verdict, who = options[0]
    if best > tolerance or best > before / 3 or options[1][0] < 2 * best:
        return SensorCheck("rigid body", subject, "not decided", before, "")
    cure = "turn its sign" if verdict == "reversed" else "exchange their labels"
    message = (
        f"{who} {'is' if verdict == 'reversed' else 'are'} {verdict}: the shapes miss rigid motion by "
        f"{100 * before:.0f} %, with that put right by {100 * best:.0f} %; {cure}"
    )
    return SensorCheck("rigid body", who, verdict, before, message)
