"""Shapes of a CalculiX result: those of the modes, whatever else the deck printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend import Dof
from femend.errors import FormatError
from femend.io.calculix import read_calculix_modes

SENSORS = [Dof(5, 2), Dof(11, 3)]
FREQ = (16.79736, 25.18538)
# (set, node, u) of each mode
SHAPES = (
    {"A": {5: (0.0, -0.21, 0.0), 11: (0.0, -0.93, 0.01)}, "B": {7: (0.0, -0.4, 0.0)}},
    {"A": {5: (0.0, 0.02, -0.21), 11: (0.0, 0.0, -0.93)}, "B": {7: (0.0, 0.0, -0.4)}},
)
EXPECTED = np.array([[-0.21, 0.02], [0.01, -0.93]])


def displacements(name: str, time: float, values: dict[int, tuple[float, float, float]]) -> str:
    rows = "".join(f"{n:10d}  {u[0]:.6E}  {u[1]:.6E}  {u[2]:.6E}\n" for n, u in values.items())
    return f"\n displacements (vx,vy,vz) for set {name} and time  {time:.7E}\n\n{rows}\n"


def frequency_step(sets: str, time: float = 1.0) -> str:
    """The table of eigenvalues, that of participation factors, and the shapes at the nodes of some sets."""
    lines = ["\n     E I G E N V A L U E   O U T P U T\n", " MODE NO    EIGENVALUE                       FREQUENCY   "]
    lines += ["                                     REAL PART            IMAGINARY PART"]
    lines += ["                           (RAD/TIME)      (CYCLES/TIME     (RAD/TIME)\n"]
    for k, f in enumerate(FREQ, start=1):
        w = 2 * np.pi * f
        lines.append(f"{k:7d}   {w * w:.7E}   {w:.7E}   {f:.7E}   0.0000000E+00")
    lines += ["\n     P A R T I C I P A T I O N   F A C T O R S\n", "MODE NO.   X-COMPONENT\n", "      1   0.1E-07", ""]
    for k, shape in enumerate(SHAPES, start=1):
        lines.append(f"\n                    E I G E N V A L U E    N U M B E R     {k}\n")
        lines += [displacements(name, time, shape[name]) for name in sets]
    return "\n".join(lines)


STATIC = displacements("A", 1.0, {5: (0.0, 0.0, -7e-4), 11: (0.0, 0.0, -4e-3)})


@pytest.mark.parametrize(
    "text",
    [
        frequency_step("A"),
        frequency_step("AB"),
        frequency_step("BA"),
        STATIC + frequency_step("A", 2.0),
        frequency_step("A") + STATIC.replace("1.0000000E+00", "2.0000000E+00"),
    ],
    ids=["one set", "two sets", "sensors in the second", "after a static step", "before a static step"],
)
def test_shapes_are_those_of_the_modes(tmp_path: Path, text: str) -> None:
    path = tmp_path / "beam.dat"
    path.write_text(text)
    freq, phi = read_calculix_modes(path, SENSORS)
    np.testing.assert_allclose(freq, FREQ, rtol=1e-7)
    np.testing.assert_allclose(phi, EXPECTED, rtol=1e-6)


def test_two_frequency_steps_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "beam.dat"
    path.write_text(frequency_step("A") + frequency_step("A", 2.0))
    with pytest.raises(FormatError, match="2 tables of eigenvalues"):
        read_calculix_modes(path, SENSORS)
