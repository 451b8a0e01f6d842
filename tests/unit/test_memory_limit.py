"""Modes and factors that do not fit are refused beforehand, with a typed error, and the process goes on.

Each case is a process of its own, whose address space the system limits: what is free is then known to the byte.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import femend

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and sizes are read from /proc")

NET = """
import json, resource
import numpy as np
import scipy.sparse as sp
from femend import _core
from femend.analysis.modes import modes_memory, solve_modes
from femend.dof import Dof
from femend.errors import MemoryLimitError

def status(name):
    line = next(l for l in open("/proc/self/status") if l.startswith(name + ":"))
    return int(line.split()[1]) * 1024

def limit(spare):
    "Leaves so many bytes of address space; None takes the limit away."
    ends = resource.RLIM_INFINITY if spare is None else status("VmSize") + spare
    resource.setrlimit(resource.RLIMIT_AS, (ends, resource.RLIM_INFINITY))

n = 26  # a cubic net of 17 576 DOFs: two factors of some 45 MB
line = sp.diags_array([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], offsets=[-1, 0, 1])
one = sp.eye_array(n)
K = (sp.kron(sp.kron(line, one), one) + sp.kron(sp.kron(one, line), one) + sp.kron(sp.kron(one, one), line)).tocsc()
K.sort_indices()
M = np.where(K.indices == np.repeat(np.arange(n**3), np.diff(K.indptr)), 1.0, 0.0)
symbolic = _core.Symbolic(K.indptr, K.indices)
pattern = (K.indptr, K.indices)
dofs = [Dof(i + 1, 3) for i in range(n**3)]
"""


def run(code: str) -> dict[str, Any]:
    """What the code prints last, as JSON."""
    folder = str(Path(femend.__file__).parents[1])
    text = f"import sys; sys.path.insert(0, {folder!r})" + NET + code
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_modes_that_do_not_fit_are_refused_before_anything_is_factorised() -> None:
    found = run("""
need = modes_memory(*pattern, 20, symbolic=symbolic)
before = status("VmHWM")
limit(need // 2)
try:
    solve_modes(*pattern, K.data, M, dofs, n_modes=20, symbolic=symbolic)
except MemoryLimitError as error:
    told = dict(message=str(error), needed=error.needed, free=error.free, memory=isinstance(error, MemoryError))
grown = status("VmHWM") - before
limit(None)
freq = solve_modes(*pattern, K.data, M, dofs, n_modes=20, symbolic=symbolic).modes.freq
print(json.dumps(told | dict(need=need, grown=grown, first=freq[0] * 2 * np.pi)))
""")
    assert found["needed"] == found["need"]
    # what else is mapped between the call's start and the check is little
    assert 0 < found["free"] <= found["need"] // 2
    assert found["memory"]
    assert found["message"].startswith(f"20 modes of 17576 DOFs need {found['need'] * 1e-9:.2f} GB of memory beside")
    assert f"{found['free'] * 1e-9:.2f} GB are free; ask for fewer modes" in found["message"]
    # less than one factor
    assert found["grown"] < found["need"] // 8
    # and once there is room the same call goes through: 3 (2 - 2 cos(pi / 27)) is the lowest
    assert found["first"] == pytest.approx(math.sqrt(3 * (2 - 2 * math.cos(math.pi / 27))))


def test_a_band_is_refused_by_the_least_it_takes_and_a_factor_by_its_own_size() -> None:
    found = run("""
limit(symbolic.memory // 2)
out = []
for call in (
    lambda: solve_modes(*pattern, K.data, M, dofs, f_max=0.1, symbolic=symbolic),
    lambda: _core.Factor(*pattern, K.data, symbolic=symbolic),
):
    try:
        call()
    except MemoryLimitError as error:
        out.append((str(error), error.needed, error.free))
print(json.dumps(dict(out=out, least=symbolic.modes_memory(), factor=symbolic.memory)))
""")
    (band, needed, free), (factor, of_factor, _) = found["out"]
    assert band.startswith("modes up to 0.1 Hz of 17576 DOFs, however few they are, need")
    assert needed == found["least"] > free
    assert factor.startswith("needs")
    assert of_factor == found["factor"] > free


def test_what_is_told_is_what_is_taken() -> None:
    """Growth of the resident set over the call; the allocator keeps some of what was used before."""
    found = run("""
need = modes_memory(*pattern, 60, symbolic=symbolic)
before = status("VmRSS")
solve_modes(*pattern, K.data, M, dofs, n_modes=60, symbolic=symbolic)
print(json.dumps(dict(need=need, grown=status("VmHWM") - before)))
""")
    assert 0.6 < found["grown"] / found["need"] < 1.1


def test_memory_grows_with_modes_and_the_count_takes_a_second_factor() -> None:
    found = run("""
more = [symbolic.modes_memory(k) for k in (1, 20, 200)]
second = symbolic.modes_memory(20) - symbolic.modes_memory(20, False)
print(json.dumps(dict(more=more, second=second, nnz=symbolic.nnz)))
""")
    assert found["more"] == sorted(set(found["more"]))
    assert found["second"] == 8 * found["nnz"]
