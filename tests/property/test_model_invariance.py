"""What must not change a model: turning it in space, renumbering it, the unit of length; refill equals rebuild."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy.spatial.transform
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe

XYZ = np.array(
    [[0, 0, 0], [1, 0, 0.1], [1.1, 0.9, 0], [0.1, 1, 0.05], [0, 0.1, 0.8], [1, 0, 0.9], [0.4, 0.5, 1.3]], float
)
TURN = np.array([0.2, 0.5, 1.0])


def cards(rotation: np.ndarray, number: list[int], length: float = 1.0) -> list[str]:
    """A plate on beams with a rod, a bush and a mass, clamped at one corner; `length` units of length to the metre."""
    n = number
    xyz, up = length * XYZ @ rotation.T, rotation @ TURN

    def text(v: np.ndarray) -> str:
        return ",".join(repr(float(c)) for c in v)

    frame = f"{text(np.zeros(3))},{text(rotation[:, 2])}"
    s2, s4 = length**2, length**4
    out = [f"GRID,{n[i]},,{text(x)}" for i, x in enumerate(xyz)]
    out += [f"CORD2R,9,,{frame}", f"+,{text(rotation[:, 0])}"]
    out += [f"MAT1,1,{2.1e11 / length!r},,0.3,{7850.0 / length**3!r},,,0.02"]
    out += ["PSHELL,1,1," + repr(0.01 * length) + ",1,,1", f"CQUAD4,1,1,{n[0]},{n[1]},{n[2]},{n[3]}"]
    out += [f"PBAR,2,1,{6e-4 * s2!r},{5e-8 * s4!r},{2e-8 * s4!r},{3e-8 * s4!r}", "+,", "+,0.8,0.7"]
    out += [f"CBAR,2,2,{n[0]},{n[4]},{text(up)}", f"CBAR,3,2,{n[1]},{n[5]},{text(up)}"]
    out += [f"CONROD,4,{n[4]},{n[5]},1,{1e-4 * s2!r},{2e-9 * s4!r}"]
    k = ",".join(repr(v) for v in (1e5, 2e5, 3e5))
    r = ",".join(repr(v * s2) for v in (1e3, 2e3, 3e3))
    out += [
        f"PBUSH,5,K,{k},{r}",
        f"CBUSH,5,5,{n[5]},{n[6]},,,,9",
        f"CONM2,6,{n[6]},9,2.5",
        f"+,{0.1 * s2!r},,{0.2 * s2!r},,,{0.3 * s2!r}",
    ]
    return [*out, f"SPC1,1,123456,{n[3]}"]


def frequencies(deck: list[str]) -> np.ndarray:
    """The lowest 30 angular frequencies."""
    with TemporaryDirectory() as folder:
        return fe.low_omega(*fe.matrices(fe.model(Path(folder), deck)))[:30]


REFERENCE = frequencies(cards(np.eye(3), [1, 2, 3, 4, 5, 6, 7]))


@settings(max_examples=15, deadline=None)
@given(st.permutations(list(range(11, 18))), st.integers(0, 2**31), st.sampled_from([1.0, 1e3, 39.37]))
def test_turning_renumbering_and_units_leave_the_frequencies(number: list[int], seed: int, length: float) -> None:
    """Eight digits: the condition of the stiffness costs the others."""
    rotation = scipy.spatial.transform.Rotation.random(random_state=seed).as_matrix()
    np.testing.assert_allclose(frequencies(cards(rotation, number, length)), REFERENCE, rtol=1e-8)


@settings(max_examples=10, deadline=None)
@given(st.floats(0.5, 2.0), st.floats(0.5, 2.0), st.floats(0.5, 2.0))
def test_projection_and_assembly_follow_the_factors_alike(e: float, t: float, k: float) -> None:
    """Project on a random basis: the same as projecting the assembled matrices, derivatives included."""
    parameters = [("e", "E", "material", [1]), ("t", "t", "property_id", [1]), ("k", "k3", "property_id", [5])]
    with TemporaryDirectory() as folder:
        model = fe.model(Path(folder), cards(np.eye(3), [1, 2, 3, 4, 5, 6, 7]), parameters=parameters)
    factors = np.array([e, t, k])
    V = np.random.default_rng(1).standard_normal((model.n_a, 5))
    K, M = fe.matrices(model, factors)
    (K_r, M_r, _, _), (dK_r, dM_r, _, _) = model.project(factors, V)
    np.testing.assert_allclose(K_r, V.T @ K @ V, rtol=1e-11, atol=1e-11 * abs(K_r).max())
    np.testing.assert_allclose(M_r, V.T @ M @ V, rtol=1e-11, atol=1e-11 * abs(M_r).max())
    step = 1e-5
    for i in range(3):
        moved = [fe.matrices(model, factors + s * step * np.eye(3)[i]) for s in (1, -1)]
        for exact, part in ((dK_r[i], 0), (dM_r[i], 1)):
            difference = V.T @ (moved[0][part] - moved[1][part]) @ V / (2 * step)
            np.testing.assert_allclose(exact, difference, atol=1e-8 * abs((K_r, M_r)[part]).max())
