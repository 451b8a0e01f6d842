"""Time `femend diagnose` as a process of its own: wall clock, CPU time and peak memory.

    python benches/end_to_end.py                       # the case bundled with the package
    python benches/end_to_end.py path/to/study.toml --runs 3 --json figures.json

Each run writes to a fresh temporary folder. A run that exits with an error, or without `result.json`, stops the bench:
a time without a result is no figure. Peak memory is the kernel's, of the process and the largest of its children.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path


@dataclass(frozen=True)
class Run:
    """One run: seconds of wall clock and CPU (all threads), peak resident memory in MiB, the verdict."""

    wall_s: float
    cpu_s: float
    peak_mib: float
    verdict: str


def bundled_study() -> Path:
    """The study file inside the installed package; exits with a message if there is none or more than one."""
    package = Path(str(resources.files("femend")))
    found = sorted(package.rglob("study.toml"))
    if len(found) != 1:
        sys.exit(f"{len(found)} studies are bundled with femend, one is needed; name a study file on the command line")
    return found[0]


def run_once(study: Path) -> Run:
    """Diagnose `study` once in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="femend-bench-") as folder:
        out = Path(folder) / "out"
        command = [str(Path(sys.executable).with_name("femend")), "diagnose", str(study), "--out", str(out)]
        start = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        # wait4 and not RUSAGE_CHILDREN: the latter keeps the peak of all earlier runs.
        _, wait_status, usage = os.wait4(process.pid, 0)
        wall_s = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(wait_status)
        if process.returncode != 0:
            sys.exit(f"femend diagnose {study} ended with exit code {process.returncode} after {wall_s:.1f} s")
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    bytes_per_unit = 1 if sys.platform == "darwin" else 1024  # ru_maxrss: bytes on macOS, KiB on Linux
    peak_mib = usage.ru_maxrss * bytes_per_unit / 2**20
    return Run(wall_s, usage.ru_utime + usage.ru_stime, peak_mib, result["verdict"])


def main() -> None:
    """Run the bench and print one line per run and the median."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", nargs="?", type=Path, help="study file (default: the bundled case)")
    parser.add_argument("--runs", type=int, default=1, help="number of runs (default 1)")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    arguments = parser.parse_args()
    if arguments.runs < 1:
        parser.error(f"--runs is {arguments.runs}; one run is the least")
    study = arguments.study or bundled_study()

    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    print(f"femend diagnose on {study.parent.name}/{study.name}; {machine}", flush=True)
    runs = []
    for number in range(1, arguments.runs + 1):
        runs.append(run_once(study))
        last = runs[-1]
        print(
            f"run {number}: {last.wall_s:.2f} s wall, {last.cpu_s:.2f} s CPU, {last.peak_mib:.0f} MiB peak, "
            f"verdict {last.verdict}",
            flush=True,
        )
    median_s = statistics.median(run.wall_s for run in runs)
    print(f"median {median_s:.2f} s wall, {max(run.peak_mib for run in runs):.0f} MiB peak")
    if arguments.json:
        figures = {"machine": machine, "study": study.parent.name, "runs": [asdict(run) for run in runs]}
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
