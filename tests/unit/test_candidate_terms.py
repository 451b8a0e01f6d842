"""Terms a deck lacks beside its parameters: their matrices, their rank by the residual, and whether a test tells them
apart; the residual's energy at joints."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import Dof
from femend.diagnose.residual.residual_energy import residual_energy
from femend.diagnose.residual.residual_parameters import ResidualRanking, rank_parameters
from femend.errors import PretestError
from femend.estimate.updating import AffineMatrices, Unknown, Unknowns, factor, modal_system
from femend.expansion import expand_residual
from femend.model import Model, Parameter, read_model
from femend.model.terms.linear_terms import point_mass, point_spring, weaker_element
from femend.pretest import candidate_matrices, distinguish, planned_test

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import PARAMETERS, deck

K_SPRING, M_LUMP = 4e3, 0.05
SENSORS = tuple(Dof(n, 3) for n in (3, 5, 7, 9, 11, 13))
FREQ_SD, SHAPE_SD = 5e-4, 0.005


def model_of(folder: Path, more: tuple[str, ...] = (), parameters: tuple[Parameter, ...] = PARAMETERS) -> Model:
    path = folder / "model.bdf"
    path.write_text(deck(more=more))
    return read_model(path, parameters=parameters)


@pytest.fixture
def model(tmp_path: Path) -> Model:
    return model_of(tmp_path)


@pytest.fixture
def candidates(model: Model) -> AffineMatrices:
    springs = [point_spring(model, n, 3, K_SPRING) for n in (5, 8, 12)]
    return candidate_matrices(model, [*springs, point_mass(model, 8, M_LUMP), weaker_element(model, 9)])


NAMES = (
    "E_root", "E_tip", "spring at 5 Z to ground", "spring at 8 Z to ground", "spring at 12 Z to ground", "mass at 8",
    "stiffness of element 9",
)  # fmt: skip
AS_THE_DECK = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def dense(matrices: AffineMatrices, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from scipy.sparse import csc_array

    n = len(matrices.indptr) - 1
    K, M = (csc_array((v, matrices.indices, matrices.indptr), shape=(n, n)) for v in matrices.at(factors))
    return K.toarray(), M.toarray()


def test_a_term_is_what_its_card_in_the_deck_would_be(candidates: AffineMatrices, tmp_path: Path) -> None:
    assert set(candidates.names) == set(NAMES)
    for more, changed in (
        ((), {}),
        ((f"CELAS2,900,{K_SPRING},8,3",), {"spring at 8 Z to ground": 1.0}),
        ((f"CONM2,900,8,,{2 * M_LUMP}",), {"mass at 8": 2.0}),
        ((f"CELAS2,900,{0.5 * K_SPRING},12,3",), {"spring at 12 Z to ground": 0.5, "E_tip": 1.1}),
    ):
        own = model_of(tmp_path, more)
        wanted = own.matrices({"E_tip": changed.get("E_tip", 1.0)})
        factors = np.array([changed.get(n, AS_THE_DECK[NAMES.index(n)]) for n in candidates.names])
        for found, expected in zip(dense(candidates, factors), wanted, strict=True):
            np.testing.assert_allclose(found, expected.toarray(), rtol=1e-12, atol=1e-9 * abs(expected).max())


def ranked(candidates: AffineMatrices, truth: Model) -> ResidualRanking:
    """What removes the residual of three modes of `truth`, seen by six sensors with a little noise."""
    from femend import model_modes

    modes = model_modes(truth, n_modes=3)
    y = modes.phi[[modes.dofs.index(d) for d in SENSORS]]
    sd = SHAPE_SD * np.abs(y).max(axis=0)
    y = y + np.random.default_rng(7).standard_normal(y.shape) * sd
    fe = truth.fe
    at = {(int(n), int(c)): i for i, (n, c) in enumerate(zip(fe.dof_nodes, fe.dof_components, strict=True))}
    rows = [at[d.node, d.component] for d in SENSORS]
    factors = np.array([AS_THE_DECK[NAMES.index(n)] for n in candidates.names])
    prior = np.array([0.05 if n.startswith("E") else 1.0 for n in candidates.names])
    return rank_parameters(
        candidates, rows, y, modes.freq, np.tile(sd, (len(SENSORS), 1)), prior_sd=prior, factors=factors,
        model_error=0.01,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("more", "name", "change"),
    [
        (f"CELAS2,900,{0.5 * K_SPRING},8,3", "spring at 8 Z to ground", 0.5),
        (f"CELAS2,900,{0.5 * K_SPRING},12,3", "spring at 12 Z to ground", 0.5),
        (f"CONM2,900,8,,{M_LUMP}", "mass at 8", 1.0),
    ],
)
def test_the_term_that_is_missing_ranks_first(
    candidates: AffineMatrices, tmp_path: Path, more: str, name: str, change: float
) -> None:
    found = ranked(candidates, model_of(tmp_path, (more,)))
    assert found.rows[0].name == name, found
    assert found.chosen[0][0] == name
    # one linear step: the sign and half the size at least
    assert 0.5 * change < found.rows[0].change < 1.5 * change
    assert found.chosen[0][2] < 0.5


def test_alike_terms_are_named(model: Model, tmp_path: Path) -> None:
    """Springs at neighbouring nodes move three modes the same way."""
    terms = [point_spring(model, n, 3, K_SPRING) for n in (12, 13)]
    own = candidate_matrices(model, [*terms, point_mass(model, 6, M_LUMP)])
    truth = model_of(tmp_path, (f"CELAS2,900,{0.5 * K_SPRING},13,3",))
    from femend import model_modes

    modes = model_modes(truth, n_modes=2)
    y = modes.phi[[modes.dofs.index(d) for d in SENSORS]]
    fe = truth.fe
    at = {(int(n), int(c)): i for i, (n, c) in enumerate(zip(fe.dof_nodes, fe.dof_components, strict=True))}
    factors = np.array([1.0 if n.startswith("E") else 0.0 for n in own.names])
    sd = np.tile(SHAPE_SD * np.abs(y).max(axis=0), (len(SENSORS), 1))
    found = rank_parameters(
        own, [at[d.node, d.component] for d in SENSORS], y, modes.freq, sd, prior_sd=0.5, factors=factors,
        model_error=0.01,
    )  # fmt: skip
    springs = [r for r in found.rows if r.name.startswith("spring")]
    assert found.rows[0] in springs
    assert all(other.name in one.alike for one, other in zip(springs, springs[::-1], strict=True))


def prior_of(candidates: AffineMatrices) -> Unknowns:
    """Moduli within 5 %, terms about 0."""
    return Unknowns.of(
        [factor(n, 0.05) if n.startswith("E") else Unknown(n, 1.0, False, 0.0, 0.5) for n in candidates.names]
    )


def test_a_planned_test_tells_a_spring_from_a_mass_and_not_from_its_neighbour(model: Model) -> None:
    terms = [point_spring(model, n, 3, K_SPRING) for n in (8, 9)]
    own = candidate_matrices(model, [*terms, point_mass(model, 8, M_LUMP)])
    T = model.transformation().tocsr()
    system = modal_system(own, T[[model.row(d) for d in SENSORS]], 6)
    names = ["spring at 8 Z to ground", "spring at 9 Z to ground", "mass at 8"]
    rough = planned_test(system, prior_of(own), modes=[0, 1], freq_sd=0.005, shape_sd=0.05)
    told = {(d.truth, d.rival): d for d in distinguish(rough, range(6), names)}
    assert len(told) == 6
    beside = told[names[0], names[1]]
    assert not beside.told
    assert beside.detected > 2 * beside.distance
    # the same with all that six modes and a good test say
    fine = planned_test(system, prior_of(own), modes=range(4), freq_sd=0.0005, shape_sd=0.005)
    told = {(d.truth, d.rival): d for d in distinguish(fine, range(6), names)}
    assert told[names[0], names[2]].told
    assert told[names[0], names[1]].told
    assert all(d.distance <= d.detected * (1 + 1e-9) for d in told.values())
    # a term twice as large is twice as far away
    twice = distinguish(fine, range(6), names, sizes=1.0)
    assert twice[0].distance == pytest.approx(2 * told[names[0], names[1]].distance)


def test_the_distance_is_what_a_fit_with_the_rival_leaves(model: Model) -> None:
    """The Schur complement against the update itself, for a small term: linear about the deck."""
    from femend.estimate.updating import Configuration, Frequencies, ModeTest, Problem, ShapeDifferences, update

    own = candidate_matrices(model, [point_spring(model, 8, 3, 0.05 * K_SPRING), point_mass(model, 8, 0.05 * M_LUMP)])
    T = model.transformation().tocsr()
    system = modal_system(own, T[[model.row(d) for d in SENSORS]], 6)
    plan = planned_test(system, prior_of(own), modes=range(3), freq_sd=FREQ_SD, shape_sd=SHAPE_SD)
    (pair, _) = distinguish(plan, range(6), ["spring at 8 Z to ground", "mass at 8"], sizes=1.0)
    factors = np.array([1.0 if n.startswith(("E", "spring")) else 0.0 for n in own.names])
    truth = system.solve(factors)
    freq, phi = truth.value("freq")[:3], truth.value("phi")[:, :3]
    rivals = Unknowns.of([u for u in prior_of(own).items if not u.name.startswith("spring")])
    # the spring stays away from this model; its factor is the system's default
    system = replace(system, defaults={"spring at 8 Z to ground": 0.0})
    shape_sd = np.broadcast_to(SHAPE_SD * np.abs(phi).max(axis=0), phi.shape)
    responses = (Frequencies(freq, FREQ_SD * freq), ShapeDifferences(phi, shape_sd))
    free = Unknowns.of([replace(u, sd=1e3) if u.name == "mass at 8" else u for u in rivals.items])
    found = update(Problem(free, (Configuration("x", system, responses, ModeTest(freq, phi)),)))
    assert np.sqrt(found.after.cost) == pytest.approx(pair.distance, rel=0.05)


def test_terms_that_free_supports_are_refused(model: Model) -> None:
    term = replace(point_spring(model, 8, 3, 1.0), releases=np.array([0], dtype=np.int64))
    with pytest.raises(PretestError, match="spring at 8 Z to ground frees DOFs that the deck holds"):
        candidate_matrices(model, [term])


# two members of one property in line along X, a third that joins them at node 5 along Z, all of two bars a metre
FRAME = """SOL 103
CEND
SPC = 1
BEGIN BULK
PARAM,COUPMASS,1
MAT1,1,7.+10,,0.33,2700.
PBAR,1,1,3.-4,3.-9,2.5-8,1.-8
PBAR,2,1,3.-4,3.-9,2.5-8,1.-8
{nodes}
{bars}
SPC1,1,123456,1
ENDDATA
"""


def frame(folder: Path) -> Model:
    nodes = [f"GRID,{n},,{0.5 * (n - 1)},0.,0." for n in range(1, 10)]
    nodes += [f"GRID,{10 + i},,2.,0.,{0.5 * (i + 1)}" for i in range(3)]
    bars = [f"CBAR,{n},{1 if n < 7 else 2},{n},{n + 1},0.,1.,0." for n in range(1, 9)]
    bars += ["CBAR,9,1,5,10,0.,1.,0.", "CBAR,10,1,10,11,0.,1.,0.", "CBAR,11,1,11,12,0.,1.,0."]
    path = folder / "frame.bdf"
    path.write_text(FRAME.format(nodes="\n".join(nodes), bars="\n".join(bars)))
    parameters = [Parameter("E", "E", "elements", (9,))]
    return read_model(path, parameters=parameters)


def test_joints_are_where_members_meet_turn_or_change(tmp_path: Path) -> None:
    model = frame(tmp_path)
    rng = np.random.default_rng(2)
    d, u = rng.standard_normal((2, model.fe.n_a, 2))
    found = residual_energy(model, d, u)
    # 5: three members meet; 7: the property changes; ends and points along a member are none
    assert set(found.joints) == {5, 7}
    index = {int(e): i for i, e in enumerate(found.elements)}
    assert found.joints[5] == pytest.approx(sum(found.element[index[e]] for e in (4, 5, 9)) / 2)
    assert found.joints[7] == pytest.approx(sum(found.element[index[e]] for e in (6, 7)) / 2)


def test_the_residual_of_a_weak_connection_is_at_its_joint(tmp_path: Path) -> None:
    model = frame(tmp_path)
    from scipy.linalg import eigh

    K, M = (a.toarray() for a in model.matrices())
    true_K = model.matrices({"E": 0.5})[0].toarray()
    lam, phi = eigh(true_K, M, subset_by_index=[0, 4])
    fe = model.fe
    rows = [i for i, c in enumerate(fe.dof_components) if c <= 3]
    y = phi[rows]
    sd = np.tile(1e-3 * np.abs(y).max(axis=0), (len(rows), 1))
    expanded = expand_residual(K, M, rows, y, np.sqrt(lam) / 2 / np.pi, sd, model_error=0.05)
    found = residual_energy(model, expanded.residual, expanded.phi)
    assert max(found.joints, key=found.joints.__getitem__) == 5
    assert found.worst(1)[0][0] == 9
    text = repr(found)
    assert "joint" in text
    assert " 5 " in text
