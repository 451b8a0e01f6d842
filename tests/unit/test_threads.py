"""The BLAS takes one thread while small matrices are worked on, and as many as before afterwards."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from threading import current_thread, main_thread

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from femend.threads import Abandoned, at_once, core_threads, go_on, one_blas_thread

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


def test_what_is_done_at_once_comes_in_order_from_several_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYON_NUM_THREADS", "3")
    assert core_threads() == 3

    def slow(i: int) -> tuple[int, str]:
        time.sleep(0.02 * (3 - i))  # the first ends last
        return i, current_thread().name

    found = at_once(slow, range(3))
    assert [i for i, _ in found] == [0, 1, 2]
    assert len({name for _, name in found}) == 3


def test_one_thread_of_the_core_and_a_thread_of_several_do_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    def in_main(_: int) -> bool:
        return current_thread() is main_thread()

    monkeypatch.setenv("RAYON_NUM_THREADS", "1")
    assert at_once(in_main, range(3)) == [True] * 3
    monkeypatch.setenv("RAYON_NUM_THREADS", "2")

    def inside(_: int) -> bool:
        own = current_thread()
        return all(at_once(lambda _: current_thread() is own, range(4)))

    assert at_once(inside, range(2)) == [True] * 2


def test_the_first_failure_ends_it_and_what_has_not_begun_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYON_NUM_THREADS", "2")
    done: list[int] = []

    def work(i: int) -> None:
        if i == 0:
            raise ValueError("the first")
        time.sleep(0.05)
        done.append(i)

    with pytest.raises(ValueError, match="the first"):
        at_once(work, range(40))
    assert len(done) < 10


def test_what_works_for_nothing_ends_at_its_next_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYON_NUM_THREADS", "2")
    begun, ended = threading.Event(), threading.Event()

    def search(item: str) -> None:
        if item == "fails":
            assert begun.wait(10)
            raise ValueError(item)
        begun.set()
        try:
            for _ in range(1000):  # 10 s, unless it is given up
                go_on()
                time.sleep(0.01)
        except Abandoned:
            ended.set()
            raise

    with pytest.raises(ValueError, match="fails"):
        at_once(search, ["fails", "goes on"])
    assert ended.wait(5)
    go_on()  # nothing in the main thread, nor in threads of work that goes on
    assert at_once(lambda i: (go_on(), i)[1], [1, 2]) == [1, 2]
