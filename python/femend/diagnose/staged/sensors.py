"""Sensors that contradict the model: upside down, or two exchanged, told by what all the others agree on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.staged.prepare import FrfData, ModesData
from femend.diagnose.staged.setup import Setup
from femend.diagnose.staged.stages import Flow, StagedData

__all__ = ["contradictions", "sensor_warnings"]

ComplexArray = NDArray[np.complex128]

# correlation of the typical sensor with the model from which on single ones can be judged; of one that is reversed; of
# one that is at another place, and of that place's sensor with it
EXPLAINED, REVERSED, ELSEWHERE, THERE = 0.8, -0.5, 0.8, 0.9
# MAC of all other sensors from which on an identified mode is the model's, and the least share of a shape's largest
# component that has a sign
LIKE, MOVES = 0.5, 0.02


def contradictions(
    recorded: ComplexArray, computed: ComplexArray, names: Sequence[str]
) -> tuple[tuple[str, float, str, float], ...]:
    """Rows of `recorded` (n, m) that run against the same rows of `computed` (n, m), called `names` (n).

    The correlation r is Re(c^H y) / (|c| |y|), 1 where both agree. A row with r < -0.5 is reversed: (name, r, "", r).
    Two rows with r < 0.8 each of which runs with the other's computed row, r > 0.9, are exchanged: (name, r, other
    name, r crosswise). Nothing is said where the median r is below 0.8: then it is the model that is wrong.

    >>> y = np.array([[1.0, 2.0], [1.0, -1.0], [3.0, 1.0]])
    >>> contradictions(y * [[1], [1], [-1]], y, ["a", "b", "c"])
    (('c', -1.0, '', -1.0),)
    """
    size = np.outer(np.linalg.norm(recorded, axis=1), np.linalg.norm(computed, axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.where(size > 0, (recorded @ computed.conj().T).real / size, 0.0)
    own = np.diag(r)
    if not len(own) or np.median(own) < EXPLAINED:
        return ()
    told = [(n, _rounded(v), "", _rounded(v)) for n, v in zip(names, own, strict=True) if v < REVERSED]
    lost = [int(i) for i in np.flatnonzero(own < ELSEWHERE)]
    for k, i in enumerate(lost):
        for j in lost[k + 1 :]:
            if min(r[i, j], r[j, i]) > THERE:
                told = [row for row in told if row[0] not in (names[i], names[j])]
                told.append((names[i], _rounded(own[i]), names[j], _rounded(min(r[i, j], r[j, i]))))
    return tuple(told)


def _rounded(value: float) -> float:
    return round(float(value), 2)


def sensor_warnings(setup: Setup, data: StagedData, flow: Flow) -> tuple[str, ...]:
    """Sensors of every fit recording that contradict the final model, as sentences."""
    said: list[str] = []
    for configuration in data.configurations:
        posterior = flow.in_configuration(configuration)
        model = setup.model(configuration, posterior.unknowns, flow.terms)
        for frf in data.frfs.get(configuration, []):
            H = frf.block(setup, model).predicted(posterior.p)
            said += _sentences(frf.name, "FRF", _flat(frf.H), _flat(H), _pairs(frf))
        for modes in data.output_only.get(configuration, []):
            shapes = modes.block(setup, model).pairs(posterior.p)[1]
            said += _of_modes(modes, shapes)
    for _, result in flow.runs:
        counted = result.data.slips < 10
        names = [str(d) for d in result.data.sensors]
        recorded, computed = (y[:, counted].astype(complex) for y in (result.data.y, result.predicted))
        said += _sentences(result.data.name, "channel", recorded, computed, names)
    return tuple(said)


def _flat(H: ComplexArray) -> ComplexArray:
    return np.ascontiguousarray(H.reshape(len(H), -1).T)


def _pairs(frf: FrfData) -> list[str]:
    return [f"{o} / {i}" for o in frf.outputs for i in frf.inputs]


def _of_modes(data: ModesData, computed: ComplexArray) -> list[str]:
    """Shapes of identified modes against the model's, each of unit size and with its factor taken out."""
    size = np.linalg.norm(data.modes.shapes, axis=0)
    own = data.modes.shapes / size
    sd = np.zeros(own.shape) if data.shape_sd is None else np.nan_to_num(data.shape_sd) / size
    factor = (computed.conj() * own).sum(axis=0) / np.maximum((np.abs(computed) ** 2).sum(axis=0), 1e-300)
    same = computed * factor
    # what hardly moves, in the recording or in the model, has no sign
    moves = (np.abs(own) > sd) & (np.minimum(np.abs(own), np.abs(same)) > MOVES * np.abs(own).max(axis=0))
    told = moves & (_likeness_of_others(own, computed) >= LIKE)
    rows = np.flatnonzero(told.any(axis=1))
    recorded, same = np.where(told, own, 0.0)[rows], np.where(told, same, 0.0)[rows]
    return _sentences(data.name, "channel", recorded, same, [str(data.modes.dofs[i]) for i in rows])


def _likeness_of_others(own: ComplexArray, computed: ComplexArray) -> NDArray[np.float64]:
    """MAC (n, m) of identified shapes `own` (n, m) with `computed` (n, m) over all sensors but the row's: a mode that
    the others do not find in the model says nothing about one of them."""
    cross, sizes = own.conj() * computed, (np.abs(own) ** 2, np.abs(computed) ** 2)
    left = [row.sum(axis=0) - row for row in sizes]
    return np.asarray(np.abs(cross.sum(axis=0) - cross) ** 2 / np.maximum(left[0] * left[1], 1e-300))


def _sentences(
    recording: str, what: str, recorded: ComplexArray, computed: ComplexArray, names: Sequence[str]
) -> list[str]:
    said = []
    for name, r, other, crosswise in contradictions(recorded, computed, names):
        if other:
            said.append(
                f"recording {recording!r}: {what}s {name} and {other} seem to be exchanged: they agree with the model "
                f"to {crosswise:.2f} crosswise, {name} to {r:.2f} as labelled; check their labels"
            )
        else:
            said.append(
                f"recording {recording!r}: {what} {name} runs against the model (correlation {r:.2f}) where most "
                "others agree with it: it seems to be upside down; check its direction and label"
            )
    return said
