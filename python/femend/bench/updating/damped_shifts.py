"""How far a deck's dashpots and loss factors put the frequencies of damped modes off those of the undamped ones.

An update on frequencies compares measured poles, |p| / 2 pi, with the undamped modes of the model. For damping in
proportion to K and M these are the same; a dashpot at one place couples modes, and what it does to |p| is of second
order: 0.6 % of a mode of 8 %.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.analysis.model_modes import model_modes
from femend.bench.reading.compared import Compared
from femend.bench.updating.counted import Counted
from femend.numerals import listed, plain

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared
    from femend.estimate.updating import UpdateResult

__all__ = ["damped_shifts", "shifted_by_damping"]

FloatArray = NDArray[np.float64]

# damped modes are looked for in the space of so many times the modes that were compared, and as many more, a local
# dashpot being felt by modes far above, up to a number
TIMES, MORE, MODES = 2, 20, 150
# a shift above this share of a frequency's deviation is told, and modes named
TOLD, NAMED = 0.5, 3


def damped_shifts(omega: FloatArray, c: FloatArray, h: FloatArray) -> FloatArray:
    """|lambda| / omega - 1 (n,) of the damped modes of (lambda^2 + lambda `c` + diag(`omega`^2) + i `h`) q = 0, each
    for the undamped mode at `omega` (n,) rad/s that it moves most like; 0 for those of a free body.

    >>> bool(np.abs(damped_shifts(np.array([1.0, 2.0]), np.diag([0.1, 0.1]), np.zeros((2, 2)))).max() < 1e-12)
    True
    """
    from scipy.optimize import linear_sum_assignment

    n = omega.size
    K = np.diag(omega**2) + 1j * h
    lam, v = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-K, -c]]))
    upper = np.argsort(-lam.imag)[:n]  # one of each pair; overdamped ones last
    share = np.abs(v[:n, upper]) ** 2
    rows, columns = linear_sum_assignment(-share / share.sum(axis=0))
    size = np.empty(n)
    size[rows] = np.abs(lam[upper[columns]])
    moving = omega > 1e-6 * omega.max(initial=0.0)
    return np.where(moving, size / np.where(moving, omega, 1.0) - 1.0, 0.0)


def shifted_by_damping(
    prepared: Prepared, found: UpdateResult, counted: Sequence[Counted], after: Sequence[Compared]
) -> list[str]:
    """Modes that count whose frequency the damping on the deck's cards shifts by more than half of its deviation."""
    if prepared.solver is not None or "frequencies" not in prepared.study.updating.responses:
        return []
    compared = {c.measured.name: c for c in after if c.measured.role == "fit"}
    told: list[tuple[float, float, str]] = []
    for one in counted:
        c = compared.get(one.sources[0])
        if c is None or len(one.sources) > 1:
            continue
        shift = _shifts(prepared, found, c)
        if shift is None:
            continue
        mates = {row.a: row.b for row in c.comparison.table.rows if row.b is not None}
        for number, f, sd in zip(one.numbers, one.freq.tolist(), one.freq_sd.tolist(), strict=True):
            mate = mates.get(number - 1)
            if mate is not None and mate < shift.size and abs(shift[mate]) * f > TOLD * sd:
                who = f"mode {number} of {one.name!r} at {plain(f)} Hz by {plain(100 * shift[mate], 2, signed=True)} %"
                told.append((abs(float(shift[mate])), sd / f, who))
    if not told:
        return []
    told.sort(key=lambda t: -t[0])
    return [
        "dashpots and loss factors of the deck, as they were found, shift frequencies of damped modes against the "
        f"undamped ones that are compared: {listed([t[2] for t in told], NAMED)}, where the deviation is "
        f"{plain(100 * told[0][1], 1)} %; parameters make up for it: meet FRFs in place of frequencies "
        f'([updating] responses = ["frfs"]), which have it in full, or give freq_sd = {plain(told[0][0], 1)}'
    ]


def _shifts(prepared: Prepared, found: UpdateResult, c: Compared) -> FloatArray | None:
    """Those of the model's modes in `c`; None where no card has damping."""
    from scipy.sparse import csc_array

    model = prepared.models.of(c.measured.configuration)
    values = prepared.of_the_deck(found.values, c.measured.configuration)
    own = model.factors({p.name: values[p.name] for p in model.parameters})
    indptr, indices, _, _, C, H = model.fe.assemble(own)
    if not C.any() and not H.any():
        return None
    modes = model_modes(model, n_modes=min(TIMES * c.modes.n_modes + MORE, MODES), factors=values)
    at = {(d.node, d.component): i for i, d in enumerate(modes.dofs)}
    rows = [at.get((int(n), int(k)), -1) for n, k in zip(model.fe.dof_nodes, model.fe.dof_components, strict=True)]
    phi = np.vstack([modes.phi, np.zeros((1, modes.n_modes))])[rows]
    shape = (model.fe.n_a, model.fe.n_a)
    damped, lossy = (phi.T @ (csc_array((v, indices, indptr), shape=shape) @ phi) for v in (C, H))
    return damped_shifts(2 * np.pi * modes.freq, damped, lossy)
