"""How many threads the BLAS of numpy and scipy may take.

Updating, diagnosis and the identification of modes work on many small matrices, between whose operations the threads of
a BLAS wait in a loop; the work that does gain from more cores is in the Rust core, which has threads of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from threading import current_thread, main_thread
from typing import Any, ParamSpec, TypeVar

import threadpoolctl

__all__ = ["one_blas_thread"]

P = ParamSpec("P")
R = TypeVar("R")

# the package is without types
_limits: Any = threadpoolctl.threadpool_limits


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """The function with one BLAS thread while it runs and as many as before afterwards.

    The number is one for the whole process, and taken back by whoever set it: called in another thread than the main
    one, where calls may overlap, the function finds it as it is.
    """

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        if current_thread() is not main_thread():
            return function(*args, **kwargs)
        with _limits(1, user_api="blas"):
            return function(*args, **kwargs)

    return limited
