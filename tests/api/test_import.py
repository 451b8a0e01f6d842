"""`import femend` is quick, silent and leaves the interpreter as it was."""

from __future__ import annotations

import subprocess
import sys

import pytest

IMPORT_SECONDS = 0.3
HEAVY = ("matplotlib", "scipy", "h5py", "jinja2")
TIMED_IMPORT = "import time; start = time.perf_counter(); import femend; print(time.perf_counter() - start)"
STATE_AROUND_IMPORT = """
import sys, warnings, logging, locale, signal
import numpy
def state():
    return (list(warnings.filters), logging.getLogger().handlers[:], logging.getLogger().level, numpy.geterr(),
            numpy.get_printoptions(), locale.setlocale(locale.LC_ALL), signal.getsignal(signal.SIGINT))
before = state()
import femend
print(state() == before)
"""


def run_python(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)


def test_import_time() -> None:
    # The least of several runs: what the import costs, not what else the machine was doing.
    seconds = min(float(run_python(TIMED_IMPORT).stdout) for _ in range(5))
    assert seconds <= IMPORT_SECONDS


def test_import_is_silent() -> None:
    done = run_python("import femend")
    assert (done.stdout, done.stderr) == ("", "")


@pytest.mark.parametrize("package", HEAVY)
def test_import_leaves_heavy_packages_alone(package: str) -> None:
    assert run_python(f"import sys, femend; print({package!r} in sys.modules)").stdout.strip() == "False"


def test_import_changes_no_global_setting() -> None:
    assert run_python(STATE_AROUND_IMPORT).stdout.strip() == "True"
