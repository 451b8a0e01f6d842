"""How many threads the BLAS of numpy and scipy may take, and work that several threads do at once.

Updating, diagnosis and the identification of modes work on many small matrices, between whose operations the threads of
a BLAS wait in a loop; the work that does gain from more cores is in the Rust core, which has threads of its own.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import wraps
from threading import Event, current_thread, local, main_thread
from typing import Any, ParamSpec, TypeVar

import threadpoolctl

__all__ = ["Abandoned", "at_once", "core_threads", "go_on", "one_blas_thread", "usable_cpus"]

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

# what a thread of `at_once` works for: whether that was given up
_work = local()
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


def core_threads() -> int:
    """Threads that the Rust core takes: as many as `RAYON_NUM_THREADS` says, or as there are usable CPUs."""
    asked = os.environ.get("RAYON_NUM_THREADS", "")
    if asked.isdigit() and int(asked) > 0:
        return int(asked)
    return usable_cpus()


def usable_cpus() -> int:
    """CPUs this process may use: fewer than the machine's in containers and under taskset."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def at_once(function: Callable[[T], R], items: Iterable[T]) -> list[R]:
    """What `function` gives for every item, in their order, on as many threads as the core takes: worth it where most
    of the time is the core's, which lets go of Python while it works. One after the other in a thread that is itself
    one of several.

    Where the first failure, or an interrupt, ends it, what has not begun is not done any more, and what has ends at the
    next `go_on`: a process waits for its threads before it ends.
    """
    items = list(items)
    workers = min(core_threads(), len(items))
    if workers <= 1 or current_thread() is not main_thread():
        return [function(item) for item in items]
    given_up = Event()

    def one(item: T) -> R:
        _work.given_up = given_up
        return function(item)

    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(one, items))
    finally:
        given_up.set()
        pool.shutdown(wait=False, cancel_futures=True)


class Abandoned(Exception):
    """Nobody waits any more for what a thread of `at_once` works on; only its thread sees it."""


def go_on() -> None:
    """For the steps of a long search. Raises Abandoned in a thread of `at_once` that was given up."""
    given_up: Event | None = getattr(_work, "given_up", None)
    if given_up is not None and given_up.is_set():
        raise Abandoned
