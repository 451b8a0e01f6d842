"""Arrays that nobody can change behind the owner's back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["frozen"]


def frozen(values: Any, dtype: Any = None) -> NDArray[Any]:
    """`values` as a C-contiguous read-only array; a copy is made unless the array is read-only and fits already."""
    array = np.asarray(values, dtype=dtype)
    if array.flags.writeable or not array.flags.c_contiguous:
        array = np.array(array, order="C", copy=True)
        array.setflags(write=False)
    return array
