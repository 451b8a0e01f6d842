"""A solver of the user's own as a system: finite differences from parallel runs, kept so that none is made twice."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.correlate import pair_modes
from femend.errors import ExternalSolverError, UpdatingError
from femend.estimate.updating.command import Command
from femend.estimate.updating.state import State
from femend.io.atomic import atomic_path

__all__ = ["ExternalSystem"]

FloatArray = NDArray[np.float64]
Results = dict[str, NDArray[Any]]


@dataclass(eq=False)
class ExternalSystem:
    """A `command` with parameters: `values` gives each field of the templates its nominal value, which factors
    multiply.

    Derivatives are central differences over `step` (a factor's change; large enough for the digits that the solver
    prints), one-sided where one side fails. Runs go on in `workers` threads, each in a folder of its own under `folder`
    (a temporary one by default); their results are kept there as `results.npz` and taken again for the same input
    files, so that a stopped updating loses nothing. Raises UpdatingError for fields without value and values without
    field.
    """

    command: Command
    values: Mapping[str, float]
    folder: str | Path | None = None
    step: float = 0.01
    workers: int = 1
    keep: bool = False
    defaults: Mapping[str, float] = field(default_factory=dict)
    n_runs: int = field(default=0, init=False)
    n_failed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        fields = set(self.command.fields)
        wrong = sorted(fields ^ set(self.values))
        if wrong:
            where = "no value" if wrong[0] in fields else "no field in a template"
            raise UpdatingError(f"parameter {wrong[0]!r} of the external solver has {where}")
        if not 0 < self.step < 1:
            raise UpdatingError(f"a difference over a factor of {self.step:g}; take one between 0 and 1, such as 0.01")
        self._root = Path(self.folder) if self.folder is not None else Path(tempfile.mkdtemp(prefix="femend-runs-"))
        self._root.mkdir(parents=True, exist_ok=True)
        self._lock = threading.Lock()
        self._running: dict[Path, threading.Lock] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.values)

    def solve(self, factors: FloatArray) -> State:
        """Results at `factors` (n_parameters,); raises ExternalSolverError where the run gave none."""
        at = np.array(factors, dtype=np.float64)
        (found,) = self.solve_many([at])
        if isinstance(found, ExternalSolverError):
            raise found
        return State(found, lambda _: self._slopes(at, found))

    def solve_many(self, points: Sequence[FloatArray]) -> list[Results | ExternalSolverError]:
        """Results or the error of every point of factors (n_parameters,) in `points`, in parallel: one that fails
        leaves the others alone."""
        with ThreadPoolExecutor(max(1, self.workers)) as pool:
            return list(pool.map(self._one, points))

    def _one(self, factors: FloatArray) -> Results | ExternalSolverError:
        values = {n: float(v * f) for (n, v), f in zip(self.values.items(), factors, strict=True)}
        c = self.command
        text = repr((c.arguments, sorted(c.templates.items()), sorted(values.items()), *filter(None, [c.depends_on])))
        folder = self._root / hashlib.sha256(text.encode()).hexdigest()[:16]
        with self._lock:
            running = self._running.setdefault(folder, threading.Lock())
        with running:  # whoever asks for the same point meanwhile waits for what this run gives
            return self._kept_or_run(values, folder)

    def _kept_or_run(self, values: Mapping[str, float], folder: Path) -> Results | ExternalSolverError:
        """Results of the run in `folder`, which is made where none are kept there."""
        kept = folder / "results.npz"
        if kept.exists():
            with np.load(kept) as content:
                return {name: content[name] for name in content.files}
        with self._lock:
            self.n_runs += 1
        # what a run left that failed is not to be read as this one's
        shutil.rmtree(folder, ignore_errors=True)
        try:
            found = self.command.run(values, folder)
        except ExternalSolverError as error:
            with self._lock:
                self.n_failed += 1
            return error
        with atomic_path(kept) as temporary, temporary.open("wb") as file:
            np.savez(file, **found)  # type: ignore[arg-type]
        if not self.keep:
            for entry in folder.iterdir():
                if entry.name != kept.name:
                    shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        return found

    def _slopes(self, at: FloatArray, here: Results) -> Results:
        n = at.size
        points = [at + sign * self.step * row for row in np.eye(n) for sign in (1.0, -1.0)]
        found = self.solve_many(points)
        out: Results = {name: np.zeros((n, *v.shape), dtype=v.dtype) for name, v in here.items()}
        for i, name in enumerate(self.names):
            above, below = found[2 * i], found[2 * i + 1]
            if isinstance(above, ExternalSolverError) and isinstance(below, ExternalSolverError):
                raise ExternalSolverError(
                    f"no derivative by {name!r}: the runs on both sides failed. {above}",
                    reason=above.reason,
                    folder=above.folder,
                )
            up = here if isinstance(above, ExternalSolverError) else _followed(here, above)
            down = here if isinstance(below, ExternalSolverError) else _followed(here, below)
            width = self.step * (2 - isinstance(above, ExternalSolverError) - isinstance(below, ExternalSolverError))
            for key in out:
                if up[key].shape != down[key].shape or up[key].shape != here[key].shape:
                    raise ExternalSolverError(
                        f"{key!r} has shapes {up[key].shape} and {down[key].shape} beside a change of {name!r}: the "
                        "reader has to give as many values in every run",
                        reason="unreadable",
                    )
                out[key][i] = (up[key] - down[key]) / width
        return out


def _followed(here: Results, there: Results) -> Results:
    """Modes of a neighbouring point in the order, sign and scale of those `here`."""
    if "phi" not in here or "freq" not in here or there["phi"].shape != here["phi"].shape:
        return there
    pairs = pair_modes(here["phi"], there["phi"], here["freq"], there["freq"], mac_min=0.0)
    order = np.arange(here["freq"].size)
    order[pairs.a] = pairs.b
    phi = there["phi"][:, order]
    along = (phi * here["phi"]).sum(axis=0) / np.maximum((phi**2).sum(axis=0), 1e-300)
    return {**there, "freq": there["freq"][order], "phi": phi * np.where(along < 0, -1.0, 1.0)}
