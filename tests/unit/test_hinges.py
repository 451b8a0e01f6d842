"""A soft joint in the middle of a beam, where the deck has none, is told as one and not as a weak stretch around it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting.predict import predict_model
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.naming.name_at import name_at
from femend.diagnose.updating.update import update_model
from femend.estimate import FitRecord, Problem
from femend.model import find_places, reduce_model
from femend.model.places.places import inner_joints

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

# stiffness of the joint at node 4, N m/rad; a bar has four times 3900
K = 900.0


def test_a_joint_inside_a_member_is_told(tmp_path: Path) -> None:
    model, rows = small_study.cantilever(tmp_path)
    stretch = next(p for p in find_places(model) if p.kind == "member" and p.nodes == (3, 5))
    cuts = inner_joints(model, stretch)
    assert {p.nodes for p in cuts} == {(4,)}
    assert all(p.release is not None for p in cuts)
    reduced = reduce_model(model, small_study.BAND[1], rows.tolist())
    cut = next(p for p in cuts if p.direction == "RY")
    joint = open_joint(cut, reduced, small_study.BAND[1], rows.tolist()).held_by(np.full(1, K))
    n, one, rng = 1024, np.ones(len(rows)), np.random.default_rng(0)
    records = []
    for i, level in enumerate((2.0, 4.0)):
        u = small_study.force(level, i, n)[None]
        blank = FitRecord(
            f"r{i}", u, np.zeros((len(rows), n)), 1 / small_study.RATE, rows[-1:], rows, np.ones(1), one, one
        )
        problem = Problem([blank], small_study.BAND, 0.012, 3)
        hypothesis = joint.hypothesis(("support_stiffness",), np.log([K]), np.ones(1))
        y = predict_model(problem, hypothesis, problem.prior(joint.reduced)[0], np.log([K]), blank)
        noise = 0.01 * y.std(axis=1)
        records.append(replace(blank, y=y + noise[:, None] * rng.standard_normal(y.shape), noise=noise))
    found = name_at(update_model(model, records, 0.01), stretch)
    best = found.best
    assert best.name == "joint_stiffness"
    assert best.located.place.kind == "end"
    assert best.located.place.nodes == (4,)
    assert best.candidate.values["k"] == pytest.approx(K, rel=0.1)
    member = next(r for r in found.ranked if r.located.place is stretch)
    assert member.score > best.score + 40
