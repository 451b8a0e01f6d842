"""A force that acts a few degrees off the axis it was said to act along."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.bent_beam import BAND, RATE, N, answers, bent_beam, burst, record, row

from femend.diagnose.locating import locate
from femend.diagnose.recordings.tilted import ForceTilt, _as_few, force_tilt
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import _updated, modelled
from femend.estimate import FitRecord
from femend.model import Place, ReducedModel
from femend.report.headline import headline
from femend.study.result.turned_force import turned_force

Array = NDArray[np.float64]
SENSORS = [(7, 1), (5, 1), (3, 1), (7, 2), (5, 2), (4, 2)]
OWN = row(5, 1)


@pytest.fixture(scope="module")
def reduced(tmp_path_factory: pytest.TempPathFactory) -> ReducedModel:
    """A cantilever that bends in Y and in Z."""
    return bent_beam(tmp_path_factory.mktemp("beam"), (1, 2), BAND[1])


def recorded(reduced: ReducedModel, seed: int, share: float, spring: float = 0.0) -> FitRecord:
    """Accelerations under a burst at node 5, in Y and a `share` of that in Z, and a spring across Y and Z at node 3."""
    across = reduced.rows(np.array([row(3, 1), row(3, 2)])).sum(axis=0)[None]
    rows, U = np.array([row(*s) for s in SENSORS]), burst(seed)
    into = reduced.rows(np.array([OWN, OWN + 1]), np.array([1.0, share])).sum(axis=0) / np.hypot(1.0, share)
    y = answers(reduced, U, into, reduced.rows(rows), spring * across.T @ across)
    return record(seed, np.fft.irfft(U)[:N], y, OWN, rows, 1e-3)


def found(reduced: ReducedModel, share: float, spring: float = 0.0) -> ForceTilt | None:
    start = _updated(*modelled(reduced.model, [recorded(reduced, s, share, spring) for s in (0, 1)], 0.01))
    places = [
        Place("ground", (n,), "XYZ"[axis], "ground", (np.array([row(n, axis)]),), (np.ones(1),))
        for n in range(2, 8)
        for axis in (1, 2)
    ]
    pair = (np.array([row(3, 1), row(3, 2)]),)
    places.append(Place("ground", (3,), "Y", "ground", pair, (np.ones(2),)))
    located = locate.locate(start.problem, start.reduced, places, start.null)
    out = force_tilt(start, located, places, 0.01, Settings())
    if out is None:
        return None
    assert out[1].null.score < 1.5 < Settings().far < start.null.score
    return out[0]


@pytest.mark.parametrize("share", [0.1, -0.06])
def test_a_force_that_is_a_few_degrees_off_is_turned(reduced: ReducedModel, share: float) -> None:
    tilt = found(reduced, share)
    assert tilt is not None
    assert dict(tilt.others)[OWN + 1] == pytest.approx(share, abs=0.003)


@pytest.mark.parametrize("share", [1.0, -2.2])
def test_a_force_far_off_its_axis_is_turned(reduced: ReducedModel, share: float) -> None:
    tilt = found(reduced, share)
    assert tilt is not None
    assert dict(tilt.others)[OWN + 1] == pytest.approx(share, rel=0.02)


@pytest.mark.parametrize(
    ("share", "sense", "vector"), [(0.1, 1.0, ""), (0.75, 1.0, "+0.80 Y +0.60 Z"), (0.75, -1.0, "-0.80 Y -0.60 Z")]
)
def test_a_force_far_off_its_axis_is_a_finding(share: float, sense: float, vector: str) -> None:
    off = ForceTilt(OWN, ((OWN - 1, 0.0), (OWN + 1, share)))
    model = SimpleNamespace(node_ids=np.arange(1, 8))
    diagnosis = cast(Any, SimpleNamespace(off=off, reduced=SimpleNamespace(model=model)))
    finding = turned_force(diagnosis, [cast(Any, SimpleNamespace(in_signs=np.array([sense]), driven=True))])
    if not vector:
        assert finding is None
        return
    assert finding is not None
    assert finding["physics"] == "load_misplaced"
    assert finding["location"]["nodes"] == [5]
    own = "+Y" if sense > 0 else "-Y"
    told = headline({"verdict": "missing-physics", "findings": [finding], "fit": [], "parameters": {}})
    assert told.startswith(f"The force recorded at node 5 in {own} acts there along {vector}")


def test_a_share_that_explains_nothing_is_left_out(reduced: ReducedModel) -> None:
    records = [recorded(reduced, s, 0.1) for s in (0, 1)]
    start = _updated(*modelled(reduced.model, records, 0.01))
    # the beam hardly moves along itself in the band
    tilt = ForceTilt(OWN, ((OWN - 1, -0.05), (OWN + 1, 0.1)))
    turned = _updated(*modelled(reduced.model, [tilt.on(r) for r in records], 0.01))
    few, again = _as_few(start, tilt, turned, 0.01, Settings())
    assert few.others == ((OWN - 1, 0.0), (OWN + 1, 0.1))
    assert again.null.score < 1.5


def test_what_couples_two_directions_elsewhere_turns_nothing(reduced: ReducedModel) -> None:
    assert found(reduced, 0.0) is None
    assert found(reduced, 0.0, spring=2e3) is None


def test_what_is_said_of_a_force_that_was_turned() -> None:
    said = ForceTilt(OWN, ((OWN + 1, 0.1), (OWN - 1, -0.05))).text(["a", "b"], range(1, 8), 1 / RATE)
    assert "the force at node 5 acts 6.4° off Y, with 10 % along Z and -5 % along X (recordings 'a', 'b')" in said


def test_records_of_other_forces_stay(reduced: ReducedModel) -> None:
    record, tilt = recorded(reduced, 1, 0.0), ForceTilt(OWN, ((OWN + 1, 0.1),))
    turned = tilt.driving(replace(record, in_signs=-record.in_signs))
    np.testing.assert_allclose(turned.u, np.array([-1.0, -0.1])[:, None] / np.hypot(1.0, 0.1) * record.u)
    assert turned.in_rows.tolist() == [OWN, OWN + 1]
    assert ForceTilt(row(7, 1), ((row(7, 2), 0.1),)).driving(record) is record
