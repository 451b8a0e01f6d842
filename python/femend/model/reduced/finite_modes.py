"""How many modes there are where more were asked for: as many as DOFs have a mass, which no caller knows beforehand."""

from __future__ import annotations

import re

from femend.errors import ModelError

__all__ = ["finite_modes"]

_SAID = re.compile(r"only (\d+) modes of finite frequency")


def finite_modes(error: ValueError, n_modes: int | None) -> int | None:
    """The number of modes that an `error` of the core names where `n_modes` were asked for; None where it is about
    something else. Raises ModelError where there is none, since nothing has a mass.

    >>> finite_modes(ValueError("n_modes = 10, but the model has only 3 modes of finite frequency (the rank of M)"), 10)
    3
    """
    said = _SAID.search(str(error))
    if said is None:
        return None
    n = int(said[1])
    if n == 0:
        raise ModelError(
            "no free DOF of the model has a mass, so that it has no modes: give the materials a density (RHO of MAT1) "
            "or add masses (CONM2)"
        )
    return n if n_modes is not None and n < n_modes else None
