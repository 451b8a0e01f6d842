"""What run.json holds: versions, seed, threads, and seconds and peak memory per step, so that a run can be repeated."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from femend.diagnose.naming.calibration import CALIBRATION
from femend.threads import usable_cpus

__all__ = ["RunInfo", "Step", "peak_memory", "versions"]

_PACKAGES = ("numpy", "scipy", "msgspec", "h5py")


def peak_memory() -> float:
    """Largest resident memory of this process so far, MB; NaN where the system does not tell (Windows)."""
    try:  # Linux: getrusage also counts what a parent held when it started this process
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        return float(status.split("VmHWM:")[1].split()[0]) * 1024 / 1e6
    except (OSError, IndexError, ValueError):
        pass
    try:
        import resource
    except ImportError:
        return float("nan")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Linux counts in kB, macOS in bytes (getrusage(2) of each).
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6


def versions() -> dict[str, str]:
    """Versions of femend, Python and the packages that compute, by name."""
    from femend import __version__

    found = {"femend": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


@dataclass
class Step:
    """One step of a run: wall-clock seconds, CPU seconds of all threads, peak memory of the process at its end, MB."""

    name: str
    seconds: float
    cpu_seconds: float
    peak_memory_mb: float


@dataclass
class RunInfo:
    """Times the steps of a run and writes them down.

    >>> info = RunInfo(seed=0)
    >>> with info.step("read the deck"):
    ...     total = sum(range(10))
    >>> [step.name for step in info.steps]
    ['read the deck']
    """

    seed: int = 0
    threads: int = field(default_factory=usable_cpus)
    study: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    _clock: float = field(default_factory=time.perf_counter, repr=False)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time the body of a `with` statement as step `name`; a step that raises is recorded too."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.steps.append(Step(name, time.perf_counter() - wall, time.process_time() - cpu, peak_memory()))

    def as_dict(self) -> dict[str, Any]:
        """The content of run.json."""
        return {
            "format": "femend-run/1",
            "study": self.study,
            "started": self.started.isoformat(timespec="seconds"),
            "seconds": round(time.perf_counter() - self._clock, 3),
            "peak_memory_mb": _finite(peak_memory()),
            "seed": self.seed,
            "threads": self.threads,
            "versions": versions(),
            "system": f"{platform.system()} {platform.machine()}",
            "settings": self.settings,
            "calibration": CALIBRATION.as_dict(),
            "steps": [
                {
                    "name": s.name,
                    "seconds": round(s.seconds, 3),
                    "cpu_seconds": round(s.cpu_seconds, 3),
                    "peak_memory_mb": _finite(s.peak_memory_mb),
                }
                for s in self.steps
            ],
        }

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write run.json to `path`."""
        Path(path).write_text(json.dumps(self.as_dict(), indent=2) + "\n", encoding="utf-8")


def _finite(value: float) -> float | None:
    return round(value, 1) if value == value else None
