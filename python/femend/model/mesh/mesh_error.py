"""The error of a deck's own mesh, mode by mode, from the same model with its linear shells and solids, and beams too
long for their waves, refined once.

Elements that interpolate linearly are too stiff or too soft by an amount that depends on the mode (bending about either
axis, torsion, stretching, plate bending have each their own) and that no parameter of the structure can make up for.
It can be computed: both models are solved, and modes are paired by shape at the nodes of the deck. Quadratic solids of
the deck's size are still up to a per cent too stiff where they are long and thin or stresses are singular at a clamp,
and shapes are off with them; where it can be afforded, solids are halved before.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError
from femend.model.known_mesh import MeshError
from femend.model.mesh.coarse_beams import coarse_beams
from femend.model.mesh.refined import only_shells, refined_model, refined_size, twice_refined
from femend.model.model import Model
from femend.model.reduced.reduction import core_modes

__all__ = ["affordable_refinement", "mesh_error"]

FloatArray = NDArray[np.float64]

# a diagnosis asks for modes up to this multiple of the band's end
ABOVE = 1.2
# of the refined model modes are solved up to this multiple of the deck's, which may change places
FURTHER = 1.15
# modes whose shapes share less than this (squared, over the modes they may mix with) are not the same modes
SAME = 0.9
# a mode that the refined mesh puts higher than the deck's by more than this share, where meshes are rather too stiff,
# has to be so much the same: with one more half wave between two nodes of the deck it looks nearly alike there
HIGHER, SURELY = 0.03, 0.99
# with element size halved, an error of second order in it falls to a quarter: what is left is a third of the change
RICHARDSON = 1.0 / 3.0
# nodes up to which a diagnosis takes the refined model in place of the deck's: it is solved anew for every place that
# is looked into, which takes up to a second each at this size
MOST_NODES = 3000


def mesh_error(model: Model, f_max: float) -> MeshError:
    """Error of the mesh of `model` in its modes up to `f_max` (Hz), by refining its linear shells and solids, and beams
    that put one of these modes off by more than a quarter of a per cent.

    Both models are at the deck's values. Where shells but no solids were refined, whose error is of second order in the
    size of the elements, it is extrapolated to none (Richardson 1911); quadratic solids are taken as they are, of half
    the size where the model then has no more than 3000 nodes, and so are beams, of whose error a sixteenth is left.
    Raises ModelError where nothing can be refined, DeckError or ModelError where the refined deck cannot be built, and
    OSError where the deck's files are gone.

    >>> print(mesh_error(read_model("plate.bdf"), 120.0))  # doctest: +SKIP
     mode    deck Hz  refined Hz  converged Hz  error %    MAC
        1      40.85      40.627        40.553    +0.73   1.00
        2     87.834      87.488        87.372    +0.53   1.00
        3     103.69      102.86        102.58    +1.08   1.00
    """
    return _refined(model, f_max, coarse_beams(model, f_max))[1]


def _refined(model: Model, f_max: float, beams: Collection[int]) -> tuple[Model, MeshError]:
    """The refined model, `beams` cut and its solids halved where that is affordable, and the error of the deck's up to
    `f_max` (Hz)."""
    twice = None if only_shells(model) else twice_refined(model, MOST_NODES, beams)
    finer = refined_model(model, beams) if twice is None else twice
    return finer, replace(_compared(finer, model, f_max), halved=twice is not None)


def affordable_refinement(model: Model, f_max: float) -> Model | None:
    """The refined model with its `mesh_error` up to 1.2 times `f_max` (Hz), to be diagnosed in place of the deck's.

    None where there is nothing to refine, where it would cost too much (more than `MOST_NODES` nodes), and where the
    refined model cannot be built or none of its modes is one of the deck's.
    """
    if len(model.node_ids) > MOST_NODES or model.morphs:
        return None
    try:
        beams = coarse_beams(model, f_max)
        if refined_size(model, beams) > MOST_NODES:
            beams = frozenset()
        if not 0 < refined_size(model, beams) <= MOST_NODES:
            return None
        finer, found = _refined(model, ABOVE * f_max, beams)
    except (FemendError, OSError, ValueError, np.linalg.LinAlgError):
        return None
    return replace(finer, mesh_error=found) if np.isfinite(found.error).any() else None


def _compared(finer: Model, model: Model, f_max: float) -> MeshError:
    """Modes of the deck up to `f_max` (Hz) beside those of the refined model."""
    K, M = model.matrices()
    freq, phi = core_modes(K, M, f_max)
    finer_freq, finer_phi = core_modes(*finer.matrices(), FURTHER * f_max)
    # the deck's nodes come first in the refined model, with the same rows
    seen = np.asarray(finer.transformation().tocsr()[model.g_rows()] @ finer_phi)
    heavy = np.asarray(M @ seen)
    likeness = (phi.T @ heavy) ** 2 / np.maximum(np.einsum("ij,ij->j", seen, heavy), 1e-300)
    higher = finer_freq[None, :] > (1 + HIGHER) * freq[:, None]
    rows, columns = _paired(np.where(higher & (likeness < SURELY), 0.0, likeness))
    refined, converged = np.full(len(freq), np.nan), np.full(len(freq), np.nan)
    refined[rows] = finer_freq[columns]
    beyond = RICHARDSON if only_shells(model) and refined_size(model) else 0.0
    square = finer_freq[columns] ** 2 + beyond * (finer_freq[columns] ** 2 - freq[rows] ** 2)
    converged[rows] = np.sqrt(np.maximum(square, 0.0))
    mac = likeness.max(axis=1, initial=0.0)
    mac[rows] = likeness[rows, columns]
    return MeshError(freq, refined, converged, mac)


def _paired(likeness: FloatArray) -> tuple[Sequence[int], Sequence[int]]:
    """Rows and columns that belong together; each lies (by `SAME`) in what the others' of the pairs span."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = (list(map(int, x)) for x in linear_sum_assignment(likeness, maximize=True))
    while rows:
        within = likeness[np.ix_(rows, columns)]
        share = np.minimum(within.sum(axis=0), within.sum(axis=1))
        worst = int(np.argmin(share))
        if share[worst] >= SAME:
            break
        del rows[worst], columns[worst]
    return rows, columns
