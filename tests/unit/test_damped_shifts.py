"""Frequencies of damped modes and undamped ones, which a local dashpot parts, and that an update says so."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import write_modes
from femend import Dof, model_modes, read_model, update_study
from femend.bench.updating.damped_shifts import damped_shifts

SENSORS = tuple(Dof(n, 3) for n in (3, 5, 7, 9, 11, 13))


def test_a_local_dashpot_shifts_as_the_states_say() -> None:
    K = np.array([[300.0, -100, 0], [-100, 200, -100], [0, -100, 100]])
    M, C = np.diag([1.0, 2.0, 1.5]), np.diag([0.0, 0.0, 2.5])
    L = np.diag(1 / np.sqrt(np.diag(M)))
    lam, v = np.linalg.eigh(L @ K @ L)
    phi, omega = L @ v, np.sqrt(lam)
    states = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    poles = np.linalg.eigvals(states)
    exact = np.sort(np.abs(poles[poles.imag > 0])) / omega - 1
    assert np.abs(exact).max() > 2e-3
    np.testing.assert_allclose(damped_shifts(omega, phi.T @ C @ phi, np.zeros((3, 3))), exact, atol=1e-12)
    # damping in proportion shifts nothing
    assert np.abs(damped_shifts(omega, 0.01 * np.diag(omega**2), np.zeros((3, 3)))).max() < 1e-12


@pytest.mark.parametrize(("c", "said"), [(15.0, True), (0.05, False)])
def test_an_update_on_frequencies_tells_what_dashpots_shift(tmp_path: Path, c: float, said: bool) -> None:
    lines = small_study.deck().splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("ENDDATA"))
    lines[at:at] = [f"PDAMP,50,{c}", "CDAMP1,501,50,9,3"]
    (tmp_path / "model.bdf").write_text("\n".join(lines))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=12)
    rows = [modes.dofs.index(d) for d in SENSORS]
    bending = [i for i in range(12) if np.abs(modes.phi[rows, i]).max() > 0.3][:3]
    write_modes(tmp_path / "tip.uff", modes.freq[bending], modes.phi[np.ix_(rows, bending)], SENSORS)
    text = small_study.study_text({}) + '[[recording]]\nname = "tip"\nfile = "tip.uff"\n'
    (tmp_path / "study.toml").write_text(text)
    advice = update_study(tmp_path / "study.toml").result["advice"]
    assert ("shift frequencies of damped modes" in advice) is said, advice
    assert ("of 'tip' at" in advice and 'responses = ["frfs"]' in advice) is said
