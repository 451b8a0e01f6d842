"""The reduced model stands for the full one: FRFs in the band, before and after its parameters move."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import diags_array

from femend.errors import ModelError
from femend.model import Model, Parameter, ReducedModel, read_model, reduce_model
from femend.model.reduced import reduction, static_basis
from femend.model.reduced.reduction import extend_model, project_model
from femend.model.reduced.static_basis import added, joined, static_responses

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]
F_MAX = 150.0


@pytest.fixture
def model(tmp_path: Path) -> Model:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    return read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS)


def system_at(reduced: ReducedModel, factors: Array) -> tuple[Array, Array]:
    """K and M of the reduced model at parameter factors, from its terms."""
    K, M = reduced.K_fixed.copy(), reduced.M_fixed.copy()
    for term in reduced.terms:
        scale = float(np.prod([factors[i] ** power for i, power in term.exponents]))
        K += 0 if term.K is None else scale * term.K
        M += 0 if term.M is None else scale * term.M
    return K, M


def receptance(K: Array, M: Array, B: Array, freq: Array) -> Array:
    omega2 = (2 * np.pi * freq) ** 2
    return np.array([B.T @ np.linalg.solve(K * (1 + 0.02j) - w * M, B) for w in omega2])


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.2, 0.85), (0.75, 1.3)])
def test_frfs_of_the_full_model_come_back(model: Model, factors: tuple[float, float]) -> None:
    rows = [6 * model.index(node) + 2 for node in (4, 7, 13)]
    reduced = reduce_model(model, F_MAX, rows)
    assert reduced.r < 0.7 * model.fe.n_a
    names = dict(zip(reduced.names, factors, strict=True))
    K, M = (a.toarray() for a in model.matrices(names))
    freq = np.linspace(5.0, F_MAX, 60)
    full = receptance(K, M, model.transformation()[rows].T.toarray(), freq)
    small = receptance(*system_at(reduced, np.array(factors)), reduced.rows(rows).T, freq)
    worst = np.abs(small - full).max() / np.abs(full).max()
    # The basis holds the modes of three times the band, the static rest, and what opposite changes of the halves do to
    # the shapes: a frequency off by 0.1 % would move a peak of this damping by a tenth of its height.
    assert worst < (1e-5 if factors == (1.0, 1.0) else 1e-3)


def test_frequencies_are_those_of_the_model(model: Model) -> None:
    reduced = reduce_model(model, F_MAX, [6 * model.index(13) + 2])
    omega, _ = small_study.dense_modes(model)
    inside = int((omega < 2 * np.pi * F_MAX).sum())
    assert inside >= 2
    np.testing.assert_allclose(reduced.freq[:inside], omega[:inside] / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(np.asarray(model.transformation() @ reduced.V_a), reduced.V, atol=1e-12)


PLATE = """SOL 103
CEND
SPC = 1
BEGIN BULK
MAT1,1,7.+10,,0.3,2700.
PSHELL,1,1,0.004,1,,1
GRID,1,,0.,0.,0.
GRID,2,,0.2,0.,0.
GRID,3,,0.4,0.,0.
GRID,4,,0.,0.1,0.
GRID,5,,0.2,0.1,0.
GRID,6,,0.4,0.1,0.
CQUAD4,1,1,1,2,5,4
CQUAD4,2,1,2,3,6,5
SPC1,1,123456,1,4
SPC1,1,6,2,3,5,6
ENDDATA
"""


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.25, 1.55])
def test_a_thickness_is_a_polynomial(tmp_path: Path, factor: float) -> None:
    """Membrane as t, bending as t cubed, mass as t: exact at thicknesses that were not sampled."""
    (tmp_path / "plate.bdf").write_text(PLATE)
    model = read_model(tmp_path / "plate.bdf", parameters=[Parameter("t", "t", "property_id", (1,))])
    reduced = reduce_model(model, 400.0, [6 * model.index(6) + 2, 6 * model.index(3) + 0])
    K, M = system_at(reduced, np.array([factor]))
    full_K, full_M = (a.toarray() for a in model.matrices({"t": factor}))
    V = reduced.V_a
    np.testing.assert_allclose(K, V.T @ full_K @ V, rtol=0, atol=1e-8 * np.abs(K).max())
    np.testing.assert_allclose(M, V.T @ full_M @ V, rtol=0, atol=1e-8 * np.abs(M).max())
    powers = sorted(power for term in reduced.terms for _, power in term.exponents if term.K is not None)
    assert 3.0 in powers


@pytest.mark.parametrize("what", ["t", "nu"])
def test_a_large_model_is_projected_as_a_small_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    (tmp_path / "plate.bdf").write_text(PLATE)
    parameter = Parameter("p", what, *(("property_id", (1,)) if what == "t" else ("material", (1,))))
    model = read_model(tmp_path / "plate.bdf", parameters=[parameter])
    V_a = np.random.default_rng(0).standard_normal((model.fe.n_a, 5))
    V = np.asarray(model.transformation() @ V_a)
    small = project_model(model, V_a, V)
    monkeypatch.setattr(reduction, "LARGE", 10)
    monkeypatch.setattr(static_basis, "LARGE", 10)
    large = project_model(model, V_a, V)
    assert [term.exponents for term in large.terms] == [term.exponents for term in small.terms]
    for factor in (0.7, 1.0, 1.25):
        for found, expected in zip(
            system_at(large, np.array([factor])), system_at(small, np.array([factor])), strict=True
        ):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_vectors_join_a_large_basis_as_a_small_one(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 60
    rng = np.random.default_rng(0)
    M = diags_array(rng.uniform(0.5, 2.0, n)).tocsc()
    phi = joined(np.zeros((n, 0)), rng.standard_normal((n, 5)), M)
    static = rng.standard_normal((n, 9))
    # nearly in the basis, near each other, in the basis, as one before, nothing; of sizes far apart
    static[:, 1] = phi @ rng.standard_normal(5) + 1e-5 * static[:, 1]
    static[:, 2] = static[:, 0] + 1e-5 * static[:, 2]
    static[:, 3] = phi @ rng.standard_normal(5)
    static[:, 4] = 3 * static[:, 0] - static[:, 2]
    static[:, 5] = 0.0
    static *= np.geomspace(1e-8, 1e8, 9)
    small = joined(phi, static, M)
    monkeypatch.setattr(static_basis, "LARGE", 10)
    monkeypatch.setattr(static_basis, "AT_ONCE", 4)
    large = joined(phi, static, M)
    assert small.shape[1] == large.shape[1] == 5 + 6
    np.testing.assert_allclose(large.T @ (M @ large), np.eye(11), atol=1e-13)
    # one vector after the other spans the same
    np.testing.assert_allclose(np.abs(np.sum(large * (M @ small), axis=0)), 1.0, atol=1e-8)
    np.testing.assert_allclose(added(phi, static, M).T @ (M @ phi), 0.0, atol=1e-13)


def test_as_many_modes_as_there_are_sensors_are_worked_out_once(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    K, M = model.matrices()
    wanted = [(f_max, at_least) for f_max in (1.0, F_MAX, 1e4) for at_least in (2, 6)]
    few = [reduction._modes(K, M, *each) for each in wanted]
    calls: list[int | None] = []
    own = reduction._core_modes

    def counted(K: object, M: object, f_max: float | None, n: int | None = None) -> tuple[object, ...]:
        calls.append(n)
        return own(K, M, f_max, n)

    monkeypatch.setattr(reduction, "MANY", 1)
    monkeypatch.setattr(reduction, "_core_modes", counted)
    for each, (omega, phi) in zip(wanted, few, strict=True):
        calls.clear()
        found = reduction._modes(K, M, *each)
        np.testing.assert_array_equal(found[0], omega)
        np.testing.assert_array_equal(found[1], phi)
        assert len(calls) == 1 or omega[-1] > found[0][each[1] + 1]


def test_a_part_with_a_factor_of_its_own(model: Model) -> None:
    reduced = reduce_model(model, F_MAX, [6 * model.index(13) + 2])
    rows, K_e, _ = model.fe.element_matrices(3, np.ones(2))
    part = reduced.V[rows].T @ K_e @ reduced.V[rows]
    split = reduced.with_part("member", part, 0, 0.5)
    assert split.names == ("E_root", "E_tip", "member")
    np.testing.assert_allclose(system_at(split, np.ones(3))[0], system_at(reduced, np.ones(2))[0], rtol=1e-12)
    more = system_at(split, np.array([1.1, 1.0, 2.0]))[0] - system_at(reduced, np.array([1.1, 1.0]))[0]
    np.testing.assert_allclose(more, 1.1 * part, rtol=0, atol=1e-9 * np.abs(part).max())


def reduced_with_idle_parameter(path: Path) -> ReducedModel:
    model = read_model(path, parameters=[Parameter("idle", "E", "material", (7,))])
    return reduce_model(model, F_MAX, [6 * model.index(13) + 2])


def test_a_parameter_without_effect_is_named(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(small_study.deck().replace("MAT1,2,", "MAT1,7,7.+10,,0.33,2700.\nMAT1,2,"))
    with pytest.raises(ModelError, match="idle|material 7"):
        reduced_with_idle_parameter(tmp_path / "model.bdf")


def test_static_responses_of_a_large_matrix_are_those_of_a_small_one(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 40
    rng = np.random.default_rng(0)
    A = diags_array([np.full(n - 1, -1.0), np.full(n, 2.5), np.full(n - 1, -1.0)], offsets=[-1, 0, 1]).tocsc()
    loads = rng.standard_normal((n, 3))
    small = static_responses(A, loads)
    monkeypatch.setattr("femend.model.reduced.static_basis.LARGE", 10)
    np.testing.assert_allclose(static_responses(A, loads), small, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(A @ small, loads, rtol=1e-12, atol=1e-14)


def test_an_extended_basis_is_that_of_a_reduction_with_the_loads(model: Model) -> None:
    rng = np.random.default_rng(0)
    loads = rng.standard_normal((model.fe.n_a, 2))
    g_rows = [6 * model.index(int(model.node_ids[2]))]
    whole, bare = reduce_model(model, F_MAX, g_rows, loads), reduce_model(model, F_MAX, g_rows)
    made = extend_model(bare, loads)
    assert made.r == whole.r > bare.r
    # the vectors come in another order, so that what the models answer is compared
    freq = np.linspace(5.0, F_MAX, 40)
    for factors in ((1.0, 1.0), (1.2, 0.8)):
        own, other = (
            receptance(
                *system_at(reduced, np.array(factors)),
                np.vstack([reduced.V[g_rows], loads.T @ np.asarray(reduced.V_a)]).T,
                freq,
            )
            for reduced in (made, whole)
        )
        np.testing.assert_allclose(own, other, atol=1e-5 * np.abs(other).max())
    np.testing.assert_allclose(made.V, model.transformation() @ np.asarray(made.V_a), atol=1e-12)


def test_many_parameters_are_held_by_combinations_of_what_they_do(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [6 * model.index(node) + 2 for node in (4, 7, 13)]
    monkeypatch.setattr("femend.model.reduced.parameter_moves.MOST", 5)
    reduced = reduce_model(model, F_MAX, rows)
    K, M = (a.toarray() for a in model.matrices({"E_root": 1.1, "E_tip": 0.9}))
    freq = np.linspace(5.0, F_MAX, 60)
    full = receptance(K, M, model.transformation()[rows].T.toarray(), freq)
    small = receptance(*system_at(reduced, np.array([1.1, 0.9])), reduced.rows(rows).T, freq)
    assert np.abs(small - full).max() < 1e-2 * np.abs(full).max()


@pytest.mark.parametrize("large", [False, True])
def test_what_moves_no_mass_joins_no_basis(large: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding left a mass of 1e-32 to answers of massless rotations, which then had entries of 1e17."""
    monkeypatch.setattr(static_basis, "LARGE", 1 if large else 10)
    M = diags_array([2.0, 1.0, 0.5, 0.0]).tocsc()
    phi = joined(np.zeros((4, 0)), np.eye(4)[:, :1], M)
    rounding = np.array([1e-17, 1e-17, 0.0, 0.3])
    V = joined(phi, np.column_stack([rounding, [0.0, 1e-5, 0.0, 0.3]]), M)
    assert V.shape == (4, 2)
    np.testing.assert_allclose(V.T @ (M @ V), np.eye(2), atol=1e-10)
    assert added(phi, rounding[:, None], M).shape == (4, 0)
