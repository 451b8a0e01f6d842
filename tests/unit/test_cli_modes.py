"""`femend modes` against beam theory, and what it says of models that are free, broken or too small."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from femend.analysis.effective_mass import base_directions
from femend.cli import main

E, RHO, A, I, LENGTH, N = 2.1e11, 7850.0, 6e-4, 5e-8, 1.0, 40


def beam(folder: Path, *, clamped: bool = True, extra: tuple[str, ...] = ()) -> Path:
    """A straight beam along X, one metre of steel; bending in X-Y and X-Z is alike."""
    cards = [f"GRID,{i + 1},,{LENGTH * i / N!r},0.,0." for i in range(N + 1)]
    cards += [f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0." for i in range(N)]
    cards += ["MAT1,1,2.1+11,,0.3,7850.", "PBAR,1,1,6.-4,5.-8,5.-8,8.-8", "PARAM,COUPMASS,1"]
    control = "SPC = 1\n" if clamped else ""
    cards += ["SPC1,1,123456,1"] if clamped else []
    path = folder / "beam.bdf"
    path.write_text(f"SOL 103\nCEND\n{control}BEGIN BULK\n" + "\n".join([*cards, *extra, "ENDDATA", ""]))
    return path


def run(*args: object) -> Result:
    return CliRunner().invoke(main, ["modes", *map(str, args)])


def rows(done: Result) -> list[list[float]]:
    """The numbers of the table: mode, Hz, and percent in X, Y, Z."""
    assert done.exit_code == 0, done.output
    lines = [line.split() for line in done.output.splitlines()]
    return [[float(cell) for cell in line] for line in lines if len(line) == 5 and line[0].isdigit()]


def test_units_that_do_not_fit_the_deck_are_told_with_those_that_do(tmp_path: Path) -> None:
    path = beam(tmp_path)
    assert "in the units" not in run(path).output
    path.write_text(path.read_text().replace("2.1+11,,0.3,7850.", "2.1+5,,0.3,7.85-9"))
    told = run(path).output
    assert "warning   in the units 'SI' no material of the deck is a solid's: MAT1 1 has a modulus of 210000" in told
    assert "in 'mm-t-s' all are those of solids: check --units, and E and RHO of the deck" in told
    assert "in the units" not in run(path, "--units", "mm-t-s").output


def test_a_density_in_the_unit_of_another_system_is_told_of_one_material_too(tmp_path: Path) -> None:
    path = beam(tmp_path, extra=("MAT1,2,7.+10,,0.3,2700.", "PBAR,2,2,6.-4,5.-8,5.-8,8.-8"))
    assert "RHO" not in run(path).output
    sound = path.read_text()
    path.write_text(sound.replace("0.3,7850.", "0.3,7.85+6"))
    assert "MAT1 1 has a density of 7.85e+06, which is 7850000 kg/m³ in the units 'SI', 350 times" in run(path).output
    # a mass that is smeared, and none
    for rho in ("0.3,2.+5", "0.3,1.-12"):
        path.write_text(sound.replace("0.3,7850.", rho))
        assert "RHO" not in run(path).output


def test_a_cantilever_has_the_frequencies_and_effective_masses_of_beam_theory(tmp_path: Path) -> None:
    found = rows(run(beam(tmp_path), "--n", 4))
    # Clamped-free Euler-Bernoulli roots; effective masses of a uniform cantilever 61.3 %, 18.8 %.
    root = np.array([1.875104069, 4.694091133])
    expected = root**2 / (2 * np.pi * LENGTH**2) * np.sqrt(E * I / (RHO * A))
    np.testing.assert_allclose([found[0][1], found[2][1]], expected, rtol=2e-3)
    np.testing.assert_allclose([found[1][1], found[3][1]], expected, rtol=2e-3)
    pairs = [found[0][3] + found[1][3], found[0][4] + found[1][4], found[2][3] + found[3][3]]
    np.testing.assert_allclose(pairs, [61.3, 61.3, 18.8], atol=0.3)
    assert all(row[2] < 0.05 for row in found)


def test_all_modes_up_to_a_frequency(tmp_path: Path) -> None:
    found = rows(run(beam(tmp_path), "--fmax", 60))
    assert [row[0] for row in found] == [1, 2]
    assert found[-1][1] < 60.0


def test_a_free_beam_has_six_modes_without_stiffness_that_carry_all_the_mass(tmp_path: Path) -> None:
    done = run(beam(tmp_path, clamped=False), "--n", 8)
    found = rows(done)
    assert "6 modes of a free body" in done.output
    assert max(row[1] for row in found[:6]) < 1e-2
    np.testing.assert_allclose(np.sum(found, axis=0)[2:], 100.0, atol=0.2)
    # The first elastic frequency of a free-free beam: root 4.730041. Rotary inertia, which the formula leaves out,
    # lowers it by the order of (4.73 r / L)^2 = 0.2 %, r being the radius of gyration 9.1 mm.
    expected = 4.730040745**2 / (2 * np.pi * LENGTH**2) * np.sqrt(E * I / (RHO * A))
    assert found[6][1] == pytest.approx(expected, rel=4e-3)


def test_mass_is_told_in_the_units_of_the_deck(tmp_path: Path) -> None:
    assert "mass 4.71 kg" in run(beam(tmp_path)).output
    assert "mass 4.71 t" in run(beam(tmp_path), "--units", "mm-t-s").output


def test_more_modes_than_degrees_of_freedom_are_all_there_are(tmp_path: Path) -> None:
    assert len(rows(run(beam(tmp_path), "--n", 10_000))) <= 6 * N


@pytest.mark.parametrize("extra", ["CBAR,900,77,1,2,0.,1.,0.", "CBAR,900,1,1,999,0.,1.,0."])
def test_a_reference_to_nothing_is_one_message(tmp_path: Path, extra: str) -> None:
    done = run(beam(tmp_path, extra=(extra,)))
    assert done.exit_code == 2
    assert "900" in done.stderr
    assert done.stderr.count("\n") == 1


def test_base_directions_follow_the_axes_of_turned_nodes() -> None:
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    R = base_directions(np.array([7, 7, 9, 9]), np.array([1, 2, 3, 4]), np.array([9, 7]), np.stack([np.eye(3), turned]))
    np.testing.assert_array_equal(R, [[0, 1, 0], [-1, 0, 0], [0, 0, 1], [0, 0, 0]])


MASSLESS = ("GRID,901,,0.,1.,0.", "GRID,902,,0.,2.,0.", "CELAS2,901,4.+4,901,2", "CELAS2,902,3.+4,901,2,902,2")


def lumped(folder: Path, *masses: str) -> Path:
    path = folder / "lumped.bdf"
    path.write_text("\n".join([*MASSLESS, "SPC1,1,13456,901,902", *masses, "ENDDATA", ""]))
    return path


def test_a_model_with_fewer_masses_than_modes_asked_for_shows_those_it_has(tmp_path: Path) -> None:
    done = run(lumped(tmp_path, "CONM2,903,902,,2."), "--spc", 1)
    assert "only 1 mode: no more DOFs have a mass" in done.output
    k = 1 / (1 / 4e4 + 1 / 3e4)  # two springs in a row
    (row,) = rows(done)
    assert row[1] == pytest.approx(np.sqrt(k / 2) / (2 * np.pi), abs=1e-4)


def test_a_model_without_any_mass_is_refused(tmp_path: Path) -> None:
    done = run(lumped(tmp_path), "--spc", 1)
    assert done.exit_code == 2
    assert done.stderr.startswith("error: no free DOF of the model has a mass")


def test_supports_that_nobody_selects_are_told(tmp_path: Path) -> None:
    path = lumped(tmp_path, "CONM2,903,902,,2.")
    assert "the deck has 1 SPC card, but its case control selects no set" in run(path).output
    assert "SPC card" not in run(path, "--spc", 1).output
