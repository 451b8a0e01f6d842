"""Running a self-test: cases are made, diagnosed blind and judged one by one; what is done is kept."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from femend.errors import ConvergenceError, FemendError, StudyError
from femend.io.atomic import write_atomic
from femend.progress import Progress, SilentProgress
from femend.selftest.case import make_case, places_of, write_case
from femend.selftest.found import Selftest
from femend.selftest.plan import Plan, read_plan
from femend.selftest.report import as_dict, as_html
from femend.selftest.score import Outcome, judge
from femend.study.file.load import load_study

__all__ = ["FORMAT", "run_selftest"]

FORMAT = "femend-selftest/1"


def run_selftest(
    study_path: str | Path,
    out: str | Path,
    *,
    cases: int = 24,
    seed: int = 0,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Selftest:
    """Makes `cases` concealed cases on the model and sensor plan of a study, diagnoses each blind, and judges them.

    Everything goes to the folder `out`: `cases/<number>/` with the recordings, the truth and the diagnosis,
    `selftest.json` and `selftest.html`. Cases that are there already, of the same study and `seed`, are not done again.
    `jobs` processes work side by side. Interrupted (KeyboardInterrupt), it reports what is finished.

    Raises StudyError where no recording can be replayed or `out` holds a self-test of another study or seed, and the
    errors of the readers.
    """
    study = load_study(study_path)
    plan = read_plan(study)
    folder = Path(out).resolve()
    _same(folder, study.file, seed)
    (folder / "cases").mkdir(parents=True, exist_ok=True)
    write_atomic(folder / "selftest-of.json", json.dumps({"study": str(study.file), "seed": seed}))
    outcomes, failed = _finished(folder, cases)
    todo = [i for i in range(cases) if i not in outcomes]
    progress = progress or SilentProgress()
    progress.start("diagnose concealed cases", len(todo))
    interrupted = False
    try:
        for index, done in _work(plan, folder, seed, todo, jobs):
            if isinstance(done, str):
                failed[index] = done
            else:
                outcomes[index] = done
                failed.pop(index, None)
            progress.advance(1)
            _report(_state(plan, seed, cases, outcomes, failed), folder)
    except KeyboardInterrupt:
        interrupted = True
    progress.done()
    found = _state(plan, seed, cases, outcomes, failed, interrupted=interrupted)
    _report(found, folder)
    return found


def _state(
    plan: Plan, seed: int, cases: int, outcomes: dict[int, Outcome], failed: dict[int, str], interrupted: bool = False
) -> Selftest:
    ordered = tuple(outcomes[i] for i in sorted(outcomes))
    return Selftest(plan.study.title, seed, cases, ordered, dict(sorted(failed.items())), interrupted)


def _same(folder: Path, study: Path, seed: int) -> None:
    path = folder / "selftest-of.json"
    if not path.is_file():
        return
    before = json.loads(path.read_text(encoding="utf-8"))
    if before != {"study": str(study), "seed": seed}:
        raise StudyError(
            f"{folder} holds a self-test of {before.get('study')} with seed {before.get('seed')}, not of {study} with "
            f"seed {seed}; name another folder, or that study and seed to continue it"
        )


def _finished(folder: Path, cases: int) -> tuple[dict[int, Outcome], dict[int, str]]:
    """Outcomes of the cases that were finished before, by index."""
    done = {}
    for path in (folder / "cases").glob("*/outcome.json"):
        outcome = Outcome(**json.loads(path.read_text(encoding="utf-8")))
        if outcome.case <= cases:
            done[outcome.case - 1] = outcome
    return done, {}


def _work(plan: Plan, folder: Path, seed: int, todo: list[int], jobs: int) -> Iterator[tuple[int, Outcome | str]]:
    """Cases in the order in which they are finished."""
    if jobs <= 1 or len(todo) <= 1:
        places = places_of(plan)
        for index in todo:
            yield index, _one(plan, places, folder, seed, index)
        return
    # an interruption is the parent's business: cases under way are finished and kept, no others begun
    pool = ProcessPoolExecutor(
        jobs, get_context("spawn"), initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN)
    )
    try:
        waiting: dict[Future[Outcome | str], int] = {
            pool.submit(_one_of_file, str(plan.study.file), str(folder), seed, index): index for index in todo
        }
        for future in as_completed(waiting):
            yield waiting[future], future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _one_of_file(study: str, folder: str, seed: int, index: int) -> Outcome | str:
    """A case in a process of its own."""
    plan = read_plan(load_study(study))
    return _one(plan, places_of(plan), Path(folder), seed, index)


def _one(plan: Plan, places: Any, folder: Path, seed: int, index: int) -> Outcome | str:
    """Makes, diagnoses and judges a case; the reason where it could not be made or diagnosed."""
    from femend.study.run import diagnose

    own = folder / "cases" / f"s{index + 1:04d}"
    try:
        case = make_case(plan, places, seed, index)
    except ConvergenceError as error:
        return f"not made: {error}"
    study = write_case(plan, case, own, seed, index)
    since = time.perf_counter()
    try:
        result = diagnose(study, out=own / "diagnosis", seed=seed).result
    except FemendError as error:
        return f"not diagnosed: {error}"
    xyz = plan.model.xyz_of
    outcome = judge(index + 1, case.truth, result, xyz, round(time.perf_counter() - since, 2))
    write_atomic(own / "outcome.json", json.dumps(asdict(outcome)))
    return outcome


def _report(found: Selftest, folder: Path) -> None:
    told = {"format": FORMAT, **as_dict(found)}
    write_atomic(folder / "selftest.json", json.dumps(told, indent=1) + "\n")
    write_atomic(folder / "selftest.html", as_html(found))
