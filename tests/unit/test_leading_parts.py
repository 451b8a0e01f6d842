"""Parts of a model between the first vectors of its basis alone are those with zeros elsewhere, and take less work."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core

Array = NDArray[np.float64]

R, FIRST, N_TUNED, N_OUT, N_LINES = 90, 8, 2, 3, 14


def symmetric(rng: np.random.Generator, n: int) -> Array:
    A = rng.standard_normal((n, n))
    return A + A.T


def system(rng: np.random.Generator, beyond: float) -> _core.System:
    """A system whose second parameter moves K and M of the first vectors, and `beyond` of the last one."""
    omega2 = (20.0 * np.arange(1, R + 1)) ** 2
    dK, dM = np.zeros((2, R, R))
    dK[:FIRST, :FIRST] = 30.0 * symmetric(rng, FIRST)
    dM[:FIRST, :FIRST] = 0.02 * symmetric(rng, FIRST)
    dK[-1, -1] = dM[-1, -1] = beyond
    whole = np.diag(0.3 * omega2) + symmetric(rng, R)
    terms: list[tuple[list[tuple[int, float]], Array | None, Array | None]] = [
        ([(0, 1.0)], whole, None),
        ([(1, 1.0)], dK, dM),
    ]
    n = 2 + 2 * N_TUNED + 1
    mean, sd = np.concatenate([np.zeros(2 + N_TUNED), np.full(N_TUNED + 1, np.log(0.02))]), np.full(n, 0.1)
    return _core.System(np.diag(0.7 * omega2), np.eye(R), terms, 2, N_TUNED, mean, sd)


def lines(rng: np.random.Generator) -> _core.RecordLines:
    s = 2.0 + 1j * np.linspace(15.0, 70.0, N_LINES)
    u, y = (rng.standard_normal((2, N_LINES, n)) for n in (1, N_OUT))
    weight = np.ones((N_LINES, N_OUT))
    rows = rng.standard_normal((N_OUT + 1, R))
    return _core.RecordLines(
        s, u[0] + 1j * u[1], 10 * (y[0] + 1j * y[1]), weight, rows[:-1], rows[-1:], 0.01, 2.0, 200, 1.0, 0.5
    )


def test_a_part_of_the_first_vectors_is_one_with_zeros_elsewhere() -> None:
    # what is there beyond is nothing in any sum, but keeps the part as large as the basis
    short, whole = (system(np.random.default_rng(1), beyond) for beyond in (0.0, 1e-290))
    p = np.array([0.1, -0.3, 0.02, -0.01, -4.0, -3.9, -3.8])
    for found, expected in zip(short.modal(p), whole.modal(p), strict=True):
        np.testing.assert_array_equal(found, expected)
    moved = short.modal(p + np.array([0, 0.1, 0, 0, 0, 0, 0]))[0]
    assert np.abs(moved / short.modal(p)[0] - 1).max() > 1e-4
    record, place = lines(np.random.default_rng(2)), _core.Hypothesis(np.random.default_rng(3).standard_normal((1, R)))
    jobs = [(one, place, p, np.zeros(0)) for one in (short, whole)]
    found, expected = _core.solve_hypotheses(jobs, [record], 4)
    assert found is not None
    assert expected is not None
    # unknowns, cost and curvature after steps along the gradient and the matrix of the search
    for i in (0, 2, 5):
        np.testing.assert_allclose(found[i], expected[i], rtol=1e-9, atol=1e-9 * np.abs(expected[i]).max())
    assert np.abs(found[0] - p)[1] > 1e-3
