"""Frequency response functions from time records: H1, H2 and Hv, with coherence and variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.blocks import Blocks, cut_blocks
from femend.signal.check import notes_of
from femend.signal.windows import Window

__all__ = ["ESTIMATORS", "FrfEstimate", "estimate_frf", "frf_of_blocks", "h1", "h2", "hv"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

ESTIMATORS = ("H1", "H2", "Hv")
KINDS = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}
# condition of the inputs' coherence matrix from which they are one input (double precision leaves half its digits)
ONE_INPUT = 1e8


@dataclass(frozen=True, slots=True, eq=False)
class FrfEstimate:
    """An estimated FRF and how good it is.

    Attributes:
        frf: the FRF; its coherence is the multiple one, the same for every input of an output.
        ordinary: (n_freq, n_out, n_in) coherence of every output with every input by itself.
        multiple: (n_freq, n_out) coherence of every output with all inputs.
        variance: (n_freq, n_out, n_in) of the complex values, E|H - E H|^2.
        n_averages: independent averages.
        decay: 1/s that an exponential window added to zeta omega of every mode (`without_window` takes it out).
        notes: what to mind.
    """

    frf: FRF
    ordinary: FloatArray
    multiple: FloatArray
    variance: FloatArray
    n_averages: float
    decay: float = 0.0
    notes: tuple[str, ...] = ()


def estimate_frf(
    data: TimeData,
    estimator: str = "H1",
    *,
    resolution: float | None = None,
    overlap: float = 0.5,
    window: str | Window = "hann",
    inputs: Sequence[int] | None = None,
    outputs: Sequence[int] | None = None,
) -> FrfEstimate:
    """FRF of `data` from averaged spectra of its force channels and responses.

    `estimator` H1 takes noise to be on the responses, H2 on the forces, Hv on both alike, in proportion to each
    channel's power (Bendat and Piersol, Random Data, 4th ed., ch. 7; Allemang and Brown, in Harris' Shock and Vibration
    Handbook, ch. 21, eq. 21.26 to 21.31). With several inputs H1 = Gyx Gxx^-1, H2 = Gyy Gxy^+ (as many outputs as
    inputs at least), Hv the smallest eigenvector of every output's matrix with all inputs. `resolution`, `overlap` and
    `window` are those of `cut_blocks`; `inputs` and `outputs` are rows of `data`, by default all forces and all
    responses with a DOF.

    Raises SignalError for no force or response, outputs of different quantities, a dead channel, inputs that carry no
    power or are one and the same, fewer averages than inputs, and an unknown estimator.
    """
    ins = data.rows("force") if inputs is None else list(inputs)
    outs = _responses(data) if outputs is None else list(outputs)
    blocks = cut_blocks(data, resolution=resolution, overlap=overlap, window=window)
    found = frf_of_blocks(data.name, data.channels, blocks, ins, outs, estimator)
    return replace(found, notes=(*found.notes, *notes_of(data, outs), *notes_of(data, ins)))


def h1(data: TimeData, **options: object) -> FRF:
    """H1 of `data` with its coherence; `options` are those of `estimate_frf`."""
    return estimate_frf(data, "H1", **options).frf  # type: ignore[arg-type]


def h2(data: TimeData, **options: object) -> FRF:
    """H2 of `data` with its coherence; `options` are those of `estimate_frf`."""
    return estimate_frf(data, "H2", **options).frf  # type: ignore[arg-type]


def hv(data: TimeData, **options: object) -> FRF:
    """Hv of `data` with its coherence; `options` are those of `estimate_frf`."""
    return estimate_frf(data, "Hv", **options).frf  # type: ignore[arg-type]


def _responses(data: TimeData) -> list[int]:
    return [i for i in data.rows(*KINDS) if data.channels[i].dof is not None]


def frf_of_blocks(
    name: str,
    channels: Sequence[Channel],
    blocks: Blocks,
    inputs: Sequence[int],
    outputs: Sequence[int],
    estimator: str = "H1",
) -> FrfEstimate:
    """The FRF of transformed `blocks`, whose rows `channels` label; `inputs` and `outputs` are rows.

    `name` is the recording's, `estimator` as in `estimate_frf`, which also says what SignalError is raised for.
    """
    if estimator not in ESTIMATORS:
        raise SignalError(f"estimator {estimator!r} is none of {', '.join(ESTIMATORS)}", recording=name)
    ins, outs = list(inputs), list(outputs)
    kind, unit = frf_kind(name, channels, ins, outs)
    Gxx, Gyx, Gyy = blocks.cross(ins, ins), blocks.cross(outs, ins), blocks.auto(outs)
    keep = _powered(name, channels, ins, Gxx)
    freq, Gxx, Gyx, Gyy = blocks.freq[keep], Gxx[keep], Gyx[keep], Gyy[keep]
    _refuse_one_input(name, channels, ins, blocks, freq, Gxx)
    inverse = np.linalg.inv(Gxx)
    H1 = Gyx @ inverse
    tiny = np.finfo(float).tiny
    multiple = np.real(np.einsum("fij,fij->fi", H1, Gyx.conj())) / np.maximum(Gyy, tiny)
    multiple = np.clip(multiple, 0, 1)
    power = np.real(np.einsum("fii->fi", Gxx))
    ordinary = np.clip(np.abs(Gyx) ** 2 / np.maximum(Gyy[:, :, None] * power[:, None, :], tiny), 0, 1)
    H = H1
    if estimator == "H2":
        H = _h2(name, blocks, ins, outs, keep, Gyx, Gyy)
    elif estimator == "Hv":
        H = _hv(Gxx, Gyx, Gyy)
    freedom = max(blocks.n_averages - len(ins), 1.0)
    left = Gyy * (1 - multiple) * (blocks.n_averages / freedom)
    variance = left[:, :, None] * np.real(np.einsum("fii->fi", inverse))[:, None, :] / blocks.n_averages
    coherence = np.repeat(multiple[:, :, None], len(ins), axis=2)
    frf = FRF(name, freq, H, tuple(channels[i] for i in outs), tuple(channels[i] for i in ins), kind, unit, coherence)
    notes = () if blocks.n_averages > 1.5 * len(ins) else ("one average: the coherence is 1 whatever the noise",)
    return FrfEstimate(frf, ordinary, multiple, variance, blocks.n_averages, blocks.decay, notes)


def frf_kind(name: str, channels: Sequence[Channel], ins: list[int], outs: list[int]) -> tuple[str, str]:
    """Kind and unit of the FRF between rows; raises SignalError where they make none."""
    if not ins or not outs:
        there = ", ".join(c.text for c in channels[:12])
        what = "force channel" if not ins else "response with a DOF"
        raise SignalError(
            f"recording {name!r} has no {what}; its channels are {there}: add one with node and direction",
            recording=name,
        )
    labels = {(channels[i].quantity, channels[i].unit) for i in outs}
    if len(labels) > 1 or next(iter(labels))[0] not in KINDS:
        raise SignalError(
            f"recording {name!r}: the responses are {', '.join(f'{q} [{u}]' for q, u in sorted(labels))}; one FRF has "
            "outputs of one quantity and unit: leave out those of the other kind, as rotations beside translations, or "
            "make them one (`femend.signal.to_quantity`)",
            recording=name,
        )
    forces = {channels[i].unit for i in ins}
    if len(forces) > 1:
        raise SignalError(f"recording {name!r}: the forces are in {', '.join(sorted(forces))}", recording=name)
    quantity, unit = next(iter(labels))
    return KINDS[quantity], f"{unit}/{next(iter(forces))}"


def _powered(name: str, channels: Sequence[Channel], ins: list[int], Gxx: ComplexArray) -> NDArray[np.bool_]:
    """Lines on which every input has power (0 Hz has none, the blocks being without mean)."""
    power = np.real(np.einsum("fii->fi", Gxx))
    keep = power > 1e-24 * power.max(axis=0)
    dead = np.flatnonzero(power.max(axis=0) <= 0)
    if dead.size:
        channel = channels[ins[int(dead[0])]].text
        raise SignalError(
            f"recording {name!r}: the force channel {channel} does not move; leave it out of the inputs",
            recording=name,
            channel=channel,
        )
    keep[0] = False
    return np.asarray(keep.all(axis=1))


def _refuse_one_input(
    name: str, channels: Sequence[Channel], ins: list[int], blocks: Blocks, freq: FloatArray, Gxx: ComplexArray
) -> None:
    if len(ins) == 1:
        return
    names = ", ".join(channels[i].text for i in ins)
    if len(blocks.X) < len(ins):
        raise SignalError(
            f"recording {name!r}: {len(blocks.X)} averages cannot tell {len(ins)} inputs apart; use a coarser "
            "resolution or more recordings",
            recording=name,
        )
    root = np.sqrt(np.real(np.einsum("fii->fi", Gxx)))
    condition = np.linalg.cond(Gxx / (root[:, :, None] * root[:, None, :]))
    bad = condition > ONE_INPUT
    if bad.any():
        at = float(freq[int(np.flatnonzero(bad)[0])])
        raise SignalError(
            f"recording {name!r}: the inputs {names} move as one on {int(bad.sum())} of {bad.size} lines (first "
            f"{at:.6g} Hz, condition {plain(condition.max(), 3)}); drive them with independent signals or leave one "
            "out",
            recording=name,
            channel=channels[ins[1]].text,
        )


def _h2(
    name: str,
    blocks: Blocks,
    ins: list[int],
    outs: list[int],
    keep: NDArray[np.bool_],
    Gyx: ComplexArray,
    Gyy: FloatArray,
) -> ComplexArray:
    if len(ins) == 1:
        return np.asarray(Gyy[:, :, None] / Gyx.conj())
    if len(outs) < len(ins):
        raise SignalError(
            f"recording {name!r}: H2 of {len(ins)} inputs takes as many outputs, there are {len(outs)}; use H1 or Hv",
            recording=name,
        )
    Gxy = np.conj(np.swapaxes(Gyx, 1, 2))
    return np.asarray(blocks.cross(outs, outs)[keep] @ np.linalg.pinv(Gxy))


def _hv(Gxx: ComplexArray, Gyx: ComplexArray, Gyy: FloatArray) -> ComplexArray:
    """For every output the plane through inputs and output with the least distance, channels scaled to equal power."""
    n_freq, n_out, n_in = Gyx.shape
    sx = np.sqrt(np.real(np.einsum("fii->fi", Gxx)))
    H = np.empty_like(Gyx)
    for i in range(n_out):
        sy = np.sqrt(np.maximum(Gyy[:, i], np.finfo(float).tiny))
        scale = np.column_stack([sx, sy])
        G = np.empty((n_freq, n_in + 1, n_in + 1), complex)
        G[:, :n_in, :n_in], G[:, n_in, n_in] = Gxx, Gyy[:, i]
        G[:, n_in, :n_in] = Gyx[:, i]
        G[:, :n_in, n_in] = Gyx[:, i].conj()
        v = np.linalg.eigh(G / (scale[:, :, None] * scale[:, None, :]))[1][:, :, 0]
        H[:, i] = -np.conj(v[:, :n_in] / v[:, n_in:]) * sy[:, None] / sx
    return H
