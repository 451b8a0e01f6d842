"""Where a recording's shapes contradict the deck's equations of motion, and which parameters could mend it.

Shapes are expanded to the whole model by least dynamic residual, at the measured frequencies; what is left of K and M
then has an energy in each element, and each parameter takes a share of it away (`residual_energy` and
`residual_parameters` in `femend.diagnose.residual`). No update is made, and none of the model's modes are needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.compared import Compared
from femend.bench.reading.sensor_rows import sensor_rows
from femend.diagnose.residual.residual_energy import ResidualEnergy, residual_energy
from femend.diagnose.residual.residual_parameters import ResidualRanking, rank_parameters
from femend.errors import FemendError
from femend.estimate.updating import DeckMatrices
from femend.expansion import expand_residual
from femend.expansion.residual import LARGEST_ERROR, LEAST_ERROR
from femend.model import Model
from femend.numerals import plain
from femend.study.file.study import Study

__all__ = ["LARGEST", "SHOWN", "WhereWrong", "where_wrong", "where_wrong_result", "where_wrong_words"]

FloatArray = NDArray[np.float64]

# a model of more DOFs is not expanded, since every mode is solved for a dozen times
LARGEST = 20_000
# sensors at DOFs of their own from which shapes can be expanded
FEWEST = 3
# elements, regions, joints and parameters that are told, and elements that correlation.json holds
SHOWN, LISTED = 8, 50


@dataclass(frozen=True, eq=False)
class WhereWrong:
    """The residual `energy` of a recording's paired modes, numbers from 0 `modes` (n_modes,), the `ranking` of the
    study's parameters (None where it has none), and the `model_error`, the relative error of the stiffness between mode
    shapes that the shapes speak of; `why` there is nothing, "" where there is. `left_out` are sensors that
    look mistaken."""

    energy: ResidualEnergy | None = None
    ranking: ResidualRanking | None = None
    model_error: float = float("nan")
    modes: tuple[int, ...] = ()
    why: str = ""
    left_out: tuple[str, ...] = ()


def where_wrong(c: Compared, model: Model, study: Study) -> WhereWrong | None:
    """Expands the paired modes of `c` in `model`, weighed as an update of the `study` weighs shapes.

    Sensors that look mistaken are left out. None for a held-out recording, without a pair, for fewer than three sensors
    at DOFs of their own, and for a model of more than 20,000 DOFs. What cannot be expanded is told in `why`.
    """
    left_out = tuple(c.mistaken.values())
    rows, test = sensor_rows(c, model, c.mistaken)
    at = c.comparison.pairing.a
    if c.measured.role != "fit" or model.fe.n_a > LARGEST or not at.size:
        return None
    if len(rows) < FEWEST:
        own = {p.id for p in model.points}
        between = sum(c.modes.dofs[j].node in own for j in c.comparison.match.rows_b.tolist())
        why = f"{between} of {len(c.dofs)} sensors lie between nodes, from which shapes are not expanded"
        return WhereWrong(why=why) if between else None
    y, freq = np.real(test[:, at]), c.test.freq[at]
    # a shape that the sensors with rows do not see is not expanded
    seen = np.abs(y).max(axis=0) > 0
    y, freq, modes = y[:, seen], freq[seen], tuple(int(i) for i in at[seen])
    if not modes:
        return None
    sd = np.tile(study.updating.shape_sd * np.abs(y).max(axis=0), (len(rows), 1))
    K, M = model.matrices()
    try:
        found = expand_residual(K, M, rows, y, freq, sd)
        if found.model_error <= LEAST_ERROR:
            return WhereWrong(
                model_error=found.model_error, modes=modes, why="the deck meets the shapes within their deviations"
            )
        energy = residual_energy(model, found.residual, found.phi)
        ranking = _ranking(model, study, rows, (y, freq, sd), found.model_error)
    except FemendError as error:
        return WhereWrong(modes=modes, why=str(error))
    return WhereWrong(energy, ranking, found.model_error, modes, left_out=left_out)


def _ranking(
    model: Model,
    study: Study,
    rows: list[int],
    measured: tuple[FloatArray, FloatArray, FloatArray],
    model_error: float,
) -> ResidualRanking | None:
    if not model.parameters:
        return None
    prior = {p.name: p.prior_sd for p in study.parameters}
    matrices = DeckMatrices(model)
    return rank_parameters(
        matrices, rows, *measured, prior_sd=[prior[name] for name in matrices.names], model_error=model_error
    )


def where_wrong_result(w: WhereWrong | None) -> dict[str, Any] | None:
    """What correlation.json holds of it; None for none."""
    if w is None:
        return None
    found: dict[str, Any] = {
        "modes": [i + 1 for i in w.modes],
        "model_error": w.model_error,
        "why_not": w.why,
        "sensors_left_out": list(w.left_out),
        "said": where_wrong_words(w),
    }
    if w.energy is not None:
        e = w.energy
        density = dict(zip(e.elements.tolist(), e.density.tolist(), strict=True))
        found["elements"] = [
            {"element": eid, "share": share, "density": density[eid]} for eid, share in e.worst(LISTED)
        ]
        found["regions"] = dict(sorted(e.regions.items(), key=lambda one: -one[1]))
        found["joints"] = [{"node": n, "share": s} for n, s in sorted(e.joints.items(), key=lambda one: -one[1])]
    if w.ranking is not None:
        found["parameters"] = [
            {
                "parameter": r.name,
                "removes": r.removes,
                "change": r.change,
                "sd": r.sd,
                "moved_by_prior_sd": r.z,
                "gain": r.gain,
                "alike": list(r.alike),
            }
            for r in w.ranking.rows
        ]
        found["together"] = [{"parameter": n, "change": x, "left": left} for n, x, left in w.ranking.chosen]
    return found


def where_wrong_words(w: WhereWrong) -> str:
    """One sentence: how wrong, where, and what could mend it."""
    if w.energy is None:
        return f"Where the deck is wrong is not told: {w.why}."
    (region, share), *_ = sorted(w.energy.regions.items(), key=lambda one: -one[1]) or [("", 0.0)]
    without = f" without {', '.join(w.left_out)}" if w.left_out else ""
    bound = "at least " if w.model_error >= LARGEST_ERROR else ""
    said = (
        f"The shapes{without} speak of a stiffness that is {bound}{plain(100 * w.model_error, 2)} % off between modes"
        + (f", {100 * share:.0f} % of it in {region}" if region else "")
        + f"; per strain energy most in element {w.energy.worst(1, by='density')[0][0]}."
    )
    if w.ranking is None:
        return f"{said} The study has no parameters."
    if not w.ranking.chosen:
        return f"{said} No parameter of the study by itself removes enough of it to be told."
    chosen = ", ".join(f"{name} {100 * change:+.0f} %" for name, change, _ in w.ranking.chosen)
    left = w.ranking.chosen[-1][2]
    return (
        f"{said} {chosen} would leave {100 * left:.0f} % of the misfit (a linear step; `femend update` finds values)."
    )
