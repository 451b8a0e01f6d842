"""What a place was read to do, on every line, and the law that follows it where no simulation stays with the motion."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.deciding import as_read as deciding
from femend.diagnose.deciding.as_read import as_read, settles
from femend.diagnose.fitting.candidates import Start, left_of, starts
from femend.diagnose.fitting.known_force import rows_of
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import shortlist
from femend.diagnose.locating.recovered import recover
from femend.diagnose.locating.split import split_records
from femend.diagnose.naming.followed import AsRead, Followed, There, followed_there, held_near, held_to_all
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.model import Place, find_places
from femend.physics import nearby, physics, shapes

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

# a bush of the deck whose bolt is loose: within the play it carries nothing
BUSH = ("PELAS,9,20000.", "CELAS1,901,9,10,3")
LOOSE = [(10, "clearance", {"k": 2e4, "gap": 1.5e-4, "sides": 2.0})]


def loose(folder: Path) -> tuple[UpdatedModel, Place]:
    """The updated study of the loose bush, and the place of it."""
    path = small_study.write_study(folder, small_study.Truth(laws=LOOSE))
    (folder / "model.bdf").write_text(small_study.deck(more=BUSH))
    start = small_study.updated_on(path)
    places = find_places(start.reduced.model)
    return start, next(p for p in places if p.kind == "ground" and p.nodes == (10,) and p.direction == "Z")


def test_a_place_is_read_on_every_line_where_that_is_asked_for(tmp_path: Path) -> None:
    start, place = loose(tmp_path)
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    p = start.problem.prior(joint.reduced)[0]
    few = start.problem.thinned(40)
    whole, sparse, dense = (
        recover(start.problem, joint, p),
        recover(few, joint, p),
        recover(few, joint, p, densely=True),
    )
    assert whole is not None
    assert sparse is not None
    assert dense is not None
    size = [float(np.linalg.norm(d)) for d in whole.d]
    off = [
        max(float(np.linalg.norm(a - b)) / s for a, b, s in zip(one.d, whole.d, size, strict=True))
        for one in (sparse, dense)
    ]
    assert off[0] > 0.5
    assert off[1] < 0.2


def test_a_loose_bush_is_told_by_the_force_it_was_read_to_make(tmp_path: Path) -> None:
    start, place = loose(tmp_path)
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    (fit,) = start.problem.fit([joint.hypothesis(None)], [(start.problem.prior(joint.reduced)[0], np.zeros(0))])
    assert fit is not None
    laws, springs = followed_there(There(split_records(start.problem), joint, fit.p))
    first, second = laws[:2]
    assert first.name == "clearance"
    assert first.start.values["gap"] == pytest.approx(1.5e-4, rel=0.2)
    assert first.start.k == pytest.approx(-2e4, rel=0.2)
    assert first.start.values["k"] == pytest.approx(2e4, rel=0.25)
    assert first.left < 0.8 * second.left
    assert first.left < 0.5 * springs


def test_a_law_is_fitted_while_its_motion_is_held_near_what_was_read(tmp_path: Path) -> None:
    start, place = loose(tmp_path)
    joint = open_joint(place, start.reduced, start.problem.band[1], rows_of((place,), start.g_rows))
    (fit,) = start.problem.fit([joint.hypothesis(None)], [(start.problem.prior(joint.reduced)[0], np.zeros(0))])
    assert fit is not None
    # as it is read off by regression: too soft
    stop = {"k": 1.6e4, "gap": 1.3e-4, "sides": 2.0}
    laws = [
        Followed(name, Start(physics(name), values, k, 0.0, 0.2), 0.2)
        for name, values, k in (("cubic_stiffness", {"k3": 3e11}, -1.6e4), ("clearance", stop, -1.8e4))
    ]
    split = split_records(start.problem)
    (first, chosen), *others = held_near(There(split, joint, fit.p), laws)
    assert first.name == "clearance"
    assert all(other.chosen > 2.0 * chosen.chosen for _, other in others)
    held = held_to_all(split, joint, first, chosen)
    assert held.values["gap"] == pytest.approx(1.5e-4, rel=0.04)
    assert held.values["k"] == pytest.approx(2e4, rel=0.06)
    assert held.k == pytest.approx(-2e4, rel=0.06)
    assert held.p_sd is not None
    assert held.fitted < 0.5


def test_gaps_are_looked_for_between_those_of_the_grid(tmp_path: Path) -> None:
    gaps = [s.terms[0]["gap"] for s in shapes(physics("clearance"), amplitude=1.0, band=(10.0, 100.0))]
    (between, *_) = [s.terms[0]["gap"] for s in nearby(shapes(physics("clearance"), amplitude=1.0, band=(10, 100))[2])]
    assert between not in gaps
    assert nearby(shapes(physics("cubic_stiffness"), amplitude=1.0, band=(10, 100))[0]) == []
    start, place = loose(tmp_path)
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    recovered = recover(start.problem, joint, start.problem.prior(joint.reduced)[0])
    assert recovered is not None
    (best, *_) = starts(physics("clearance"), joint, recovered, 3)
    # a regression leaves what its start does
    assert left_of(best, recovered) == pytest.approx(best.left, rel=1e-6)


@dataclass(frozen=True)
class Found:
    """What is asked of a diagnosis."""

    place: Any
    best: Any = None
    verdict: str = "located-not-named"
    read: Any = None
    advice: str = "no law"
    rival: Any = None
    further: Any = None
    load: Any = None
    interrupted: bool = False
    settings: Settings = field(default_factory=Settings)
    reduced: Any = field(default_factory=lambda: SimpleNamespace(model=SimpleNamespace(units="SI")))

    @property
    def given(self) -> Any:
        whole = SimpleNamespace(
            load=None, band=(1.0, 100.0), records=[SimpleNamespace(frf=None)], prior_cost=lambda reduced, p: float(p[0])
        )
        return SimpleNamespace(
            split=SimpleNamespace(whole=whole), settings=self.settings, reduced=self.reduced, g_rows=()
        )


def place_with(score: float, prior: float) -> Any:
    fit = SimpleNamespace(score=score, p=np.array([prior]), hypothesis=SimpleNamespace(reduced=None), prior=prior)
    return SimpleNamespace(place=SimpleNamespace(n_w=1, scaled=False, kind="ground", direction="Z"), fit=fit)


def followed(name: str, left: float, k: float = 0.0) -> Followed:
    values = {"k": 4e4, "gap": 1e-4, "sides": 2.0, "c": 1.0, "f": 1.0, "kt": 1.0}
    own = {q: values[q] for q in physics(name).parameter_names}
    return Followed(name, Start(physics(name), own, k, 0.0, left), left)


CLEAR = [followed("clearance", 0.14, -4e4), followed("quadratic_damping", 0.4)]
CLOSE = [followed("clearance", 0.35), followed("quadratic_damping", 0.38)]
SPRINGS = 0.41


@pytest.mark.parametrize(
    ("place", "best", "laws", "name", "read"),
    [
        # none could be followed; one was, in the beginning, that is not what was read
        (place_with(1.0, 5.0), None, CLEAR, "clearance", True),
        (place_with(1.0, 5.0), ("quadratic_damping", 0.5, 1.0), CLEAR, "clearance", True),
        # what is told by a fit stays where it is what was read, or follows that as well, or explains whole recordings
        (place_with(1.0, 5.0), ("clearance", 0.5, 1.0), CLEAR, None, False),
        (place_with(1.0, 5.0), ("quadratic_damping", 0.5, 1.0), CLOSE, None, False),
        (place_with(1.0, 5.0), ("quadratic_damping", 0.0, 1.1), CLEAR, None, False),
        # no force there explains the recordings, or only one that bends the model
        (place_with(4.0, 5.0), None, CLEAR, None, False),
        (place_with(1.0, 5000.0), None, CLEAR, None, False),
        # nothing follows what was read: the model is told as it is beside the force
        (place_with(1.0, 5.0), None, [followed("clearance", 0.6)], None, True),
    ],
)
def test_the_law_that_follows_the_force_is_told_where_none_can_be_simulated(
    monkeypatch: pytest.MonkeyPatch, place: Any, best: Any, laws: list[Followed], name: str | None, read: bool
) -> None:
    monkeypatch.setattr(deciding, "open_joint", lambda *a: None)
    monkeypatch.setattr(deciding, "followed_there", lambda *a: (laws, SPRINGS))
    monkeypatch.setattr(deciding, "held_near", lambda *a: [])
    monkeypatch.setattr(deciding, "rows_of", lambda *a: [])
    told = best and SimpleNamespace(name=best[0], sigma=best[1], fitted=best[2])
    out = as_read(cast(Any, Found(place, told)))
    assert (out.read is not None) == read
    if not read:
        assert out.best is told
        return
    assert out.best is None
    assert out.read is not None
    assert out.read.fit is place.fit
    assert (out.read.law.name if out.read.law is not None else None) == name
    if name:
        assert "clearance (k 40000 N/m, gap 0.0001 m, where the deck is 40000 N/m too stiff)" in out.advice
        assert "14 %" in out.advice


@pytest.mark.parametrize(("chosen", "settled"), [(None, False), (4.0, True), (30.0, False), (300.0, False)])
def test_nothing_else_is_looked_for_where_the_law_that_was_read_takes_most_away(
    chosen: float | None, settled: bool
) -> None:
    place = place_with(1.0, 5.0)
    held = None if chosen is None else SimpleNamespace(chosen=chosen)
    assert settles(AsRead(place.place, place.fit, CLEAR[0], cast(Any, held)), 220.0, Settings()) == settled
    assert not settles(None, 220.0, Settings())
    # nor where the model leaves nothing without it
    assert not settles(AsRead(place.place, place.fit, CLEAR[0], cast(Any, held)), 1.0, Settings())


def test_several_forces_do_not_go_before_one_that_explains_all() -> None:
    def one(n_w: int, cost: float, score: float, prior: float) -> Any:
        fit = SimpleNamespace(score=score, prior=prior)
        return SimpleNamespace(place=SimpleNamespace(n_w=n_w, kind="pair"), cost=cost, fit=fit)

    three, right, wrong, bent = (
        one(3, 400.0, 0.6, 4.0),
        one(1, 740.0, 1.0, 4.0),
        one(1, 740.0, 1.6, 4.0),
        one(1, 740.0, 1.0, 90.0),
    )
    assert shortlist([three, right, wrong]) == [right, three, wrong]
    assert shortlist([three, wrong]) == [three, wrong]
    assert shortlist([three, bent]) == [three, bent]
