"""A simulated record with its derivatives over all parameters of its laws."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core

Array = NDArray[np.float64]


def simulate_with_slopes(
    omega: Array, zeta: Array, phi_in: Array, phi_out: Array, w: Array, laws: Any, u: Array, dt: float, **options: Any
) -> tuple[Any, Array, Array]:
    """What `_core.simulate` returns, dy/dp (n_p, n_out, n_kept) and df/dp (n_p, n_w, n_kept)."""
    modal = [np.asarray(values)[None] for values in (omega, zeta, phi_in, phi_out, w)]
    wanted = [True] * sum(len(p) for at in laws for _, p in at)
    ((histories, dy, df, _, _),) = _core.simulate_tangents(*modal, laws, wanted, [u], dt, **options)
    return histories, dy, df
