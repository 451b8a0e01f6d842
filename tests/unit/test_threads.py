"""The BLAS takes one thread while small matrices are worked on, and as many as before afterwards."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from femend.threads import one_blas_thread

# a product, so that there is a BLAS to ask
assert np.ones(2) @ np.ones(2) == 2.0


def blas_threads() -> set[int]:
    return {int(library["num_threads"]) for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.mark.parametrize("before", [1, 2])
def test_one_thread_inside_and_as_many_as_before_outside(before: int) -> None:
    with threadpool_limits(before, user_api="blas"):
        assert one_blas_thread(blas_threads)() == {1}
        assert one_blas_thread(one_blas_thread(blas_threads))() == {1}
        assert blas_threads() == {before}


def test_a_failure_takes_the_limit_back() -> None:
    @one_blas_thread
    def fails() -> None:
        raise ValueError("inside")

    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(ValueError, match="inside"):
            fails()
        assert blas_threads() == {2}


def test_other_threads_find_the_number_as_it_is() -> None:
    with threadpool_limits(2, user_api="blas"), ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda _: one_blas_thread(blas_threads)(), range(20))
        assert all(threads == {2} for threads in found)
        assert blas_threads() == {2}


def test_threads_of_a_call_have_its_number() -> None:
    @one_blas_thread
    def spreads() -> list[set[int]]:
        with ThreadPoolExecutor(2) as pool:
            return list(pool.map(lambda _: one_blas_thread(blas_threads)(), range(20)))

    with threadpool_limits(2, user_api="blas"):
        assert spreads() == 20 * [{1}]
        assert blas_threads() == {2}
