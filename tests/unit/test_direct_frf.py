"""Direct FRFs of models and of matrices against dense solutions on every line; laws of stiffness over frequency."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from femend.analysis.complex_frf import complex_frf
from femend.analysis.direct_frf import direct_frf, reduced_frf
from femend.data import Channel
from femend.dof import Dof
from femend.errors import ModelError, PairingError, RecordingError, SingularModelError
from femend.model import Model, Parameter, read_model

FREQ = np.linspace(5.0, 400.0, 120)


def at(node: int, component: int, sign: int = 1) -> Channel:
    return Channel(Dof(node, component, sign), "acceleration", "m/s^2")


OUT, IN = (at(9, 2), at(6, 3, -1), at(3, 2)), (at(9, 2), at(4, 3))


def deck(folder: Path, *, loss: float = 0.0, free: bool = False) -> Path:
    """A cantilever of two materials on a damper and a spring; the outer half is the one that gets laws."""
    cards = ["SOL 103", "CEND", *([] if free else ["SPC = 1"]), "BEGIN BULK", "PARAM,COUPMASS,1", "SPC1,1,123456,1"]
    cards += [f"MAT1,1,2.1+11,,0.3,7850.,,,0.01\nMAT1,2,7.+10,,0.33,2700.,,,{loss}"]
    cards += [f"PBAR,{p},{p},6.-4,5.-8,2.-8,3.-8" for p in (1, 2)]
    cards += [f"GRID,{i + 1},,{0.15 * i!r},0.,0." for i in range(9)]
    cards += [f"CBAR,{i},{1 if i < 5 else 2},{i},{i + 1},0.,1.,0." for i in range(1, 9)]
    cards += ["CDAMP2,20,40.,9,2", "CELAS2,21,3.+4,9,3", "PSHELL,3,2,0.002,2", "GRID,20,,1.2,0.1,0."]
    cards += ["GRID,21,,1.05,0.1,0.", "CQUAD4,30,3,8,9,20,21", "ENDDATA", ""]
    path = folder / "beam.bdf"
    path.write_text("\n".join(cards))
    return path


def parameters() -> list[Parameter]:
    made = [("E2", "E", "material", (2,)), ("E1", "E", "material", (1,)), ("rho", "rho", "material", (2,))]
    made += [("t", "t", "property_id", (3,)), ("bar 7", "E", "elements", (7,))]
    return [Parameter(*p) for p in made]


@pytest.fixture
def model(tmp_path: Path) -> Model:
    return read_model(deck(tmp_path), parameters=parameters())


def dense(model: Model, factors: dict[str, float] | None = None) -> dict[str, np.ndarray]:
    """K, M, C and H in full."""
    indptr, indices, *values = model.fe.assemble(model.factors(factors))
    shape = (model.fe.n_a, model.fe.n_a)
    return {n: sp.csc_matrix((v, indices, indptr), shape).toarray() for n, v in zip("KMCH", values, strict=True)}


def forces(model: Model, channels: tuple[Channel, ...]) -> np.ndarray:
    T = model.transformation().toarray()
    return np.array([T[6 * model.index(c.dof.node) + c.dof.component - 1] * c.dof.sign for c in channels if c.dof]).T


def exact(model: Model, law: Any = None) -> np.ndarray:
    """Accelerances, dense; `law` on E2, whose part of K is what doubling E2 adds to it."""
    m, double = dense(model), dense(model, {"E2": 2.0})
    part, loss = double["K"] - m["K"], double["H"] - m["H"]
    out = []
    for f in FREQ:
        s = 2j * np.pi * f
        Z = m["K"] + 1j * m["H"] + s * m["C"] + s * s * m["M"]
        if law is not None:
            Z = Z + (law(f) - 1) * part - 1j * loss
        out.append(s * s * forces(model, OUT).T @ np.linalg.solve(Z, forces(model, IN)))
    return np.array(out)


def rubber(f: Any) -> Any:
    """Standard linear solid, stiffer by half above its relaxation."""
    r = 2j * np.pi * f * 2e-3
    return 1 + 0.5 * r / (1 + r)


def close(found: Any, expected: np.ndarray, tolerance: float) -> None:
    size = np.abs(expected).max(axis=(1, 2))
    assert (np.abs(found.frf.H - expected).max(axis=(1, 2)) < tolerance * size).all()


def test_a_model_with_all_its_damping_is_the_dense_solution(model: Model) -> None:
    found = direct_frf(model, FREQ, OUT, IN, tolerance=1e-8)
    assert found.converged
    assert found.advice == ""
    assert found.error <= 1e-8
    assert 5 <= found.solved.size < 40
    assert set(found.solved) <= set(FREQ)
    assert (found.frf.kind, found.frf.unit) == ("accelerance", "m/s^2/N")
    # the tolerance binds the lines that were measured; others may be a little worse
    close(found, exact(model), 1e-7)


@pytest.mark.parametrize("as_array", [False, True])
def test_a_law_replaces_the_modulus_on_every_line(tmp_path: Path, as_array: bool) -> None:
    """The deck's own loss factor of these elements goes, that of the others stays."""
    model = read_model(deck(tmp_path, loss=0.3), parameters=parameters())
    law = rubber(FREQ) if as_array else rubber
    found = direct_frf(model, FREQ, OUT, IN, laws={"E2": law}, tolerance=1e-8)
    assert found.converged
    close(found, exact(model, rubber), 1e-7)


def test_constant_laws_are_what_the_deck_can_say_itself(tmp_path: Path, model: Model) -> None:
    plain = direct_frf(model, FREQ, OUT, IN, factors={"E2": 1.3}, tolerance=1e-9)
    by_law = direct_frf(model, FREQ, OUT, IN, laws={"E2": 1.3}, tolerance=1e-9)
    close(by_law, plain.frf.H, 1e-8)
    # a law is a factor on the deck's value, and that one may have a factor of its own
    both = direct_frf(model, FREQ, OUT, IN, factors={"E2": 2.0}, laws={"E2": 0.65}, tolerance=1e-9)
    close(both, plain.frf.H, 1e-8)
    lossy = read_model(deck(tmp_path, loss=0.2), parameters=parameters())
    own = direct_frf(lossy, FREQ, OUT, IN, tolerance=1e-9)
    close(direct_frf(model, FREQ, OUT, IN, laws={"E2": 1 + 0.2j}, tolerance=1e-9), own.frf.H, 1e-8)


def test_two_laws_on_different_elements_act_together(model: Model) -> None:
    found = direct_frf(model, FREQ, OUT, IN, laws={"E2": 1.3, "E1": 0.9 * (1 + 0.01j)}, tolerance=1e-9)
    plain = direct_frf(model, FREQ, OUT, IN, factors={"E2": 1.3, "E1": 0.9}, tolerance=1e-9)
    close(found, plain.frf.H, 1e-8)


def test_what_is_not_reached_is_told_with_advice(model: Model) -> None:
    found = direct_frf(model, FREQ, OUT, IN, tolerance=1e-13, max_solutions=6)
    assert not found.converged
    assert "asked 1.0e-13); raise max_solutions" in found.advice
    assert found.advice.startswith(f"{found.solved.size} lines solved")


def test_laws_that_cannot_be_are_refused(model: Model) -> None:
    def refused(laws: dict[str, Any], said: str, kind: type[Exception] = ModelError) -> None:
        with pytest.raises(kind, match=said):
            direct_frf(model, FREQ, OUT, IN, laws=laws)

    refused({"E3": 1.0}, "no parameter is called 'E3'; the parameters are E2, E1")
    refused({"rho": 2.0}, r"parameter 'rho' \(rho\): it has no part in the stiffness")
    refused({"t": 2.0}, r"parameter 't' \(t\): it changes mass")
    refused({"E2": 1.1, "bar 7": 1.2}, "belongs to another law too; take a modulus")
    refused({"E2": [1.0, 2.0]}, r"the law on 'E2' has coefficients of shape \(2,\) for 120 lines", ValueError)
    refused({"E2": lambda f: np.where(f > 300, np.nan, 1.0)}, "law on 'E2' is not a number at 300.4", ValueError)


def test_places_and_kinds_that_cannot_be_are_refused(tmp_path: Path, model: Model) -> None:
    with pytest.raises(PairingError, match="no node 77"):
        direct_frf(model, FREQ, [at(77, 1)], IN)
    with pytest.raises(ValueError, match="has no DOF; FRFs are between DOFs"):
        direct_frf(model, FREQ, OUT, [Channel(None, "force", "N", label="hammer")])
    with pytest.raises(RecordingError, match="'inertance' is none of"):
        direct_frf(model, FREQ, OUT, IN, kind="inertance")
    free = read_model(deck(tmp_path, free=True))
    with pytest.raises(SingularModelError, match="has no inverse on a line: .*leave out the line") as error:
        direct_frf(free, [0.0, 1.0], OUT, IN)
    assert all(":" in dof for dof in error.value.dofs)


def test_matrices_of_ones_own_take_any_function_of_the_line() -> None:
    n = 80
    k = 1e5 * np.ones(n)
    K = sp.diags_array([-k[1:], k + np.r_[k[1:], 0.0], -k[1:]], offsets=[-1, 0, 1]).tocsc()
    last = sp.csc_array(([2e4], ([n - 1], [n - 1])), shape=(n, n))
    M = sp.csc_array(sp.eye_array(n))
    dofs = [Dof(i + 1, 1) for i in range(n)]
    freq = np.linspace(0.0, 60.0, 90)
    s = 2j * np.pi * freq
    layer = np.sqrt(1 + s)  # a fractional element, at the end
    terms = [(K, 1 + 0.02j), (M, s**2), (last, layer)]
    found = reduced_frf(terms, dofs, freq, [at(80, 1, -1), at(40, 1)], [at(80, 1)], kind="receptance")
    assert found.converged
    for i in range(freq.size):
        Z = (1 + 0.02j) * K.toarray() + s[i] ** 2 * M.toarray() + layer[i] * last.toarray()
        X = np.linalg.inv(Z)
        expected = np.array([[-X[79, 79]], [X[39, 79]]])
        assert np.abs(found.frf.H[i] - expected).max() < 1e-5 * np.abs(expected).max()
    with pytest.raises(PairingError, match=r"no DOF 81:\+X; give one of the 80 rows"):
        reduced_frf(terms, dofs, freq, [at(81, 1)], [at(80, 1)])


@pytest.mark.parametrize(("out", "into"), [(at(1, 2), at(9, 2)), (at(9, 2), at(1, 2)), (at(1, 2), at(1, 3))])
def test_ends_that_are_held_do_not_move(model: Model, out: Channel, into: Channel) -> None:
    found = direct_frf(model, FREQ, [out], [into])
    assert found.converged
    assert np.all(found.frf.H == 0.0)
    assert np.all(complex_frf(model, FREQ, [out], [into]).H == 0.0)


def test_planes_that_know_nothing_of_each_other(tmp_path: Path) -> None:
    path = deck(tmp_path)
    alone = ("PSHELL", "CQUAD4", "GRID,20", "GRID,21")
    kept = [line for line in path.read_text().splitlines() if not line.startswith(alone)]
    path.write_text("\n".join([*kept[:-1], "SPC1,1,4,9", "ENDDATA", ""]))
    beam = read_model(path)
    own = np.abs(complex_frf(beam, FREQ, [at(9, 2)], [at(9, 2)]).H).max()
    across = np.abs(complex_frf(beam, FREQ, [at(9, 2)], [at(9, 3)]).H).max()
    assert across < 1e-9 * own
