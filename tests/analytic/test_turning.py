"""Terms that act with the speed of rotation: critical speeds by hand, motion in a run by steps in time."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof
from femend.analysis.rotor import gyroscopic_matrices
from femend.data import Speed
from femend.errors import ModelError
from femend.estimate.joint import OdsBlock, OdsFrf, Unbalance, receptance, run_of, simulate_run, unbalance_unknowns
from femend.model.model import Model, read_model
from femend.model.terms.bushes import bush_groups
from femend.model.terms.configured import ALPHA, BETA, ConfiguredModel, configure, free_model
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.speed_terms import disc_at_node, member_over_speed, rotor_between, springs_over_speed
from femend.model.terms.unknowns import Unknown, Unknowns

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, deck

Array = NDArray[np.float64]
BEARINGS, TOP = (511, 512), 2 * np.pi * 26.0

# a disc on springs: m, Ip = 0.02 about X, Id = 0.03 about Y and Z, k_r = 400 N m/rad
DISC = """SOL 103
CEND
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
CONM2,11,1,,2.
+,0.02,,0.03,,,0.03
CELAS2,21,1.+5,1,1
CELAS2,22,1.+5,1,2
CELAS2,23,1.+5,1,3
CELAS2,24,100.,1,4
CELAS2,25,400.,1,5
CELAS2,26,400.,1,6
SPC1,1,123456,2
ENDDATA
"""


def rig_model(folder: Path) -> Model:
    path = folder / "model.bdf"
    path.write_text(deck(Rig()))
    return free_model(read_model(path).deck, units="SI", parameters=())


def with_terms(free: Model, terms: list[LinearTerm], spc: int | None = 1) -> ConfiguredModel:
    unknowns = Unknowns.of(
        [
            Unknown(ALPHA, 0.5),
            Unknown(BETA, 1e-4),
            *(u for t in terms for u in t.unknowns),
            *unbalance_unknowns(Unbalance(BEARINGS, 0), 1e-3, 1 / 256),
        ]
    )
    held = {511, 512, 505} & set(free.node_ids.tolist())
    g_rows = [free.row(Dof(n, c)) for n in held for c in (1, 2, 3)]
    return configure("operation", free, unknowns, terms, spc=spc, f_max=30.0, g_rows=g_rows)


def at(model: ConfiguredModel, **values: float) -> Array:
    """Unknowns with the ends of names as given, by value; the others at their scale (those of loads at one)."""
    p = np.zeros(len(model.unknowns))
    for i, u in enumerate(model.unknowns.items):
        value = values.get(u.name.split(": ")[-1])
        if value is not None:
            p[i] = np.log(value / u.scale) if u.positive else value / u.scale
    return p


def rows(model: ConfiguredModel, nodes: tuple[int, ...]) -> Array:
    return model.rows([model.model.row(Dof(n, c)) for n in nodes for c in (1, 2, 3)])


def test_a_disc_is_critical_where_theory_has_it(tmp_path: Path) -> None:
    """Forward whirl at sqrt(k_r / (Id - Ip)), backward at sqrt(k_r / (Id + Ip)) (Genta 2005, section 3.3)."""
    (tmp_path / "disc.bdf").write_text(DISC)
    free = free_model(read_model(tmp_path / "disc.bdf").deck, units="SI", parameters=())
    model = with_terms(free, [disc_at_node(free, 1, 0, TOP)])
    p = at(model, Ip=0.02)
    p[model.unknowns.index(ALPHA)] = p[model.unknowns.index(BETA)] = -40.0  # no damping
    tilts = model.rows([free.row(Dof(1, 5)), free.row(Dof(1, 6))])
    for omega, other in ((np.sqrt(400 / 0.01), np.sqrt(400 / 0.05)), (np.sqrt(400 / 0.05), np.sqrt(400 / 0.01))):
        s = 1j * np.array([omega * (1 + 1e-7), 0.5 * (omega + other)])
        near, far = (np.abs(H).max() for H in receptance(model, p, s, np.abs(s)).between(tilts, tilts))
        assert near > 1e4 * far
    # at rest the tilts do not couple, and are critical at sqrt(k_r / Id) alone
    s = np.array([1j * np.sqrt(400 / 0.03) * (1 + 1e-7)])
    H = receptance(model, p, s).between(tilts, tilts)[0]
    assert abs(H[0, 1]) < 1e-9 * abs(H[0, 0])


def test_moments_have_the_sign_of_the_deck_s_own_rotors(tmp_path: Path) -> None:
    (tmp_path / "disc.bdf").write_text(DISC)
    free = free_model(read_model(tmp_path / "disc.bdf").deck, units="SI", parameters=())
    term = disc_at_node(free, 1, 0, TOP)
    T = free.transformation()
    own = (T.T @ term.parts[0].matrix @ T).toarray()
    G, _ = gyroscopic_matrices(free, (1.0, 0.0, 0.0), elements=[11])
    assert np.allclose(0.02 * own, G.toarray(), atol=1e-12)
    assert np.abs(G.toarray()).max() == pytest.approx(0.02)


def test_a_rotor_between_bearings_tilts_as_a_rigid_block_turns(tmp_path: Path) -> None:
    """Both bearings and the node 500 belong to one rigid body, so that the three places are one."""
    free = rig_model(tmp_path)
    terms = [rotor_between(free, BEARINGS, 0, TOP), disc_at_node(free, 511, 0, TOP), disc_at_node(free, 500, 0, TOP)]
    between, bearing, block = (part.matrix for part in with_terms(free, terms).turning)
    assert np.abs(between).max() > 0
    assert np.allclose(between, bearing, atol=1e-9 * np.abs(between).max())
    assert np.allclose(between, block, atol=1e-9 * np.abs(between).max())
    with pytest.raises(ModelError, match="do not lie apart along Y"):
        rotor_between(free, BEARINGS, 1, TOP)


def test_springs_over_speed_are_springs_of_another_stiffness(tmp_path: Path) -> None:
    free = rig_model(tmp_path)
    (group,) = bush_groups(free)
    whole = springs_over_speed(free, group, None, TOP)
    model = with_terms(free, [whole, springs_over_speed(free, group, 1, TOP)])
    s, speed = 2j * np.pi * np.array([7.0, 12.0]), np.array([0.5 * TOP, TOP])
    p = np.zeros(len(model.unknowns))
    p[model.unknowns.index(f"{whole.name}: a2")] = 0.4
    added = model.turning_stiffness(p, s, speed)
    assert np.allclose(added[1], 4 * added[0])
    # a tenth of all the springs' stiffness at half the speed
    springs = sum(
        model.V[g].T @ (B.T @ np.diag([*group.k, 0, 0, 0]) @ B) @ model.V[g]
        for g, B in zip(group.g_rows, group.B, strict=True)
    )
    assert np.allclose(added[0], 0.1 * springs, atol=1e-9 * np.abs(springs).max())
    single = with_terms(free, [member_over_speed(free, e, TOP) for e in group.elements])
    assert np.allclose(sum(part.matrix for part in single.turning[::3]), springs, atol=1e-6 * np.abs(springs).max())


@pytest.mark.parametrize("sense", [1, -1])
def test_shapes_of_a_turning_structure_have_exact_slopes(tmp_path: Path, sense: int) -> None:
    free = rig_model(tmp_path)
    (group,) = bush_groups(free)
    model = with_terms(free, [rotor_between(free, BEARINGS, 0, TOP), springs_over_speed(free, group, 0, TOP)])
    p = at(model, Ip=0.02, a1=0.1, a2=-0.2, a3=0.15) + 0.05 * np.random.default_rng(2).standard_normal(
        len(model.unknowns)
    )
    freq = np.linspace(4.0, 24.0, 30)
    shapes = OdsFrf(freq, np.zeros((30, 6), dtype=complex), np.full((30, 6), 1e-3))
    bearings = rows(model, BEARINGS).reshape(2, 3, -1)
    block = OdsBlock("run", model, shapes, rows(model, (501, 507)), bearings, Unbalance(BEARINGS, 0, sense))
    told = block.linearised(p)
    for k, i in enumerate(told.index):
        d = np.zeros(len(p))
        d[i] = 1e-5
        numeric = (block.linearised(p + d).predicted - block.linearised(p - d).predicted) / 2e-5
        assert np.abs(numeric - told.slopes[k]).max() < 1e-5 * max(np.abs(told.slopes[k]).max(), 1e-6)


def stepped(model: ConfiguredModel, p: Array, run_speed: Array, loads: Array, h: float, sense: int) -> Array:
    """Accelerations (n, r) of the basis by Newmark's method (beta = 1/12) with the speed of every instant."""
    K0, M, C0 = model.matrices(p)
    v = model.unknowns.values(p)
    u, w, a = (np.zeros(model.r) for _ in range(3))
    kept = np.zeros((len(loads), model.r))
    for i, load in enumerate(loads):
        K, C = K0.copy(), C0.copy()
        for part in model.turning:
            weight = float(part.over_speed.at(np.array([sense * run_speed[i]]))[0])
            (C if part.kind == "C" else K)[...] += v[part.unknown] * weight * part.matrix
        u_next, w_next = u + h * w + (5 / 12) * h**2 * a, w + 0.5 * h * a
        a = np.linalg.solve(M + 0.5 * h * C + h**2 / 12 * K, load - C @ w_next - K @ u_next)
        u, w = u_next + h**2 / 12 * a, w_next + 0.5 * h * a
        kept[i] = a
    return kept


@pytest.mark.parametrize("sense", [1, -1])
def test_a_fast_run_follows_the_speed_of_every_instant(tmp_path: Path, sense: int) -> None:
    """At 1 Hz/s modes ring at a speed that has gone on: lines at their own speed alone are off by per cents."""
    free = rig_model(tmp_path)
    (group,) = bush_groups(free)
    model = with_terms(free, [rotor_between(free, BEARINGS, 0, TOP), springs_over_speed(free, group, 1, TOP)])
    values = {"Ip": 0.02, "a2": 0.1}
    p = at(model, **values)
    unbalance = Unbalance(BEARINGS, 0, sense)
    parts = (1.0, 0.3, -0.4, 0.2)
    for name, part in zip(unbalance.names, parts, strict=True):
        p[model.unknowns.index(name)] = part
    rate, fine, n = 128.0, 8, 128 * 22
    t = np.arange(n * fine) / (rate * fine)
    rev, angle = 3.0 + t, 3.0 * t + 0.5 * t**2
    pulses = Speed(t[::fine], rev[::fine], 2 * np.pi * angle[::fine], "tacho", n)
    run = run_of(pulses, n, 1 / rate, onset=1.0)
    out, bearings = rows(model, (501, 507)), rows(model, BEARINGS).reshape(2, 3, -1)
    found = simulate_run(model, p, run, unbalance, out, bearings)
    pattern = np.tensordot(1e-3 * np.array(parts), unbalance.pattern(bearings), 1)
    course = (
        (2 * np.pi * rev) ** 2 * np.minimum(1.0, t) * np.stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)])
    )
    exact = (stepped(model, p, 2 * np.pi * rev, course.T @ pattern, 1 / (rate * fine), sense) @ out.T)[::fine].T
    inside = slice(int(rate), n - int(rate))

    def off(y: Array) -> float:
        return float(np.linalg.norm((y - exact)[:, inside]) / np.linalg.norm(exact[:, inside]))

    assert off(found) < 0.005
    s = 2j * np.pi * run.freq
    X = receptance(model, p, s, unbalance.speed(run.freq)).X
    lines = run.back(np.asarray((np.einsum("kij,kj->ki", X, run.F @ pattern) * (s**2)[:, None]) @ out.T).T)
    assert off(lines) > 0.03
