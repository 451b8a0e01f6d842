"""Masses and springs at nodes without a sensor: which are tried, and that screening finds them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np

from femend import _core
from femend.diagnose.staged import ConfigurationSpec, Setup, setup_of
from femend.diagnose.staged.places import elsewhere, places_tried, screened
from femend.diagnose.staged.prepare import FrfData
from femend.diagnose.staged.select import fit_terms, select_terms
from femend.dof import Dof
from femend.model import Pairing, Parameter
from femend.model.terms.configured import free_model
from femend.model.terms.linear_terms import point_mass

# a beam of ten elements, clamped at node 1, with sensors along Y and Z at three of its nodes
SENSORS = tuple(Dof(n, c) for n in (4, 8, 11) for c in (2, 3))


def beam(folder: Path) -> Setup:
    """The beam as the stages see it, with E as parameter."""
    grids = [f"GRID,{i + 1},,{0.1 * i:.1f},0.,0." for i in range(11)]
    bars = [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 11)]
    cards = ["MAT1,1,2.1+11,,0.3,7850.", "PBAR,1,1,4.-4,1.33-8,2.1-8,3.-8", "SPC1,1,123456,1"]
    path = folder / "beam.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *grids, *bars, *cards, "ENDDATA"]) + "\n")
    E = Parameter("E", "E", "material", (1,), 0.1)
    free = free_model(_core.Deck.read(str(path)), units="SI", parameters=[E])
    pairing = cast(Pairing, {d: SimpleNamespace(dof=d) for d in SENSORS})
    rows = [free.row(Dof(11, c)) for c in (2, 3)]
    return setup_of(free, [ConfigurationSpec("bench", 1)], pairing, band=(3.0, 100.0), zeta=0.01, g_rows=rows)


def with_mass(setup: Setup, node: int, m: float) -> FrfData:
    """FRFs of the beam with a mass (kg) at a node."""
    freq = np.linspace(3.0, 100.0, 100)
    term = point_mass(setup.free, node, m)
    terms = [*setup.idealised, term]
    unknowns = setup.unknowns(terms)
    empty = FrfData("hammer", freq, np.zeros((100, 6, 2), dtype=complex), np.ones((100, 6, 2)), SENSORS, SENSORS[-2:])
    H = empty.block(setup, setup.model("bench", unknowns, terms)).predicted(unknowns.mean)
    return replace(empty, H=H, noise=np.full(H.shape, 1e-3 * float(np.abs(H).mean())))


def test_a_mass_at_a_node_without_a_sensor_is_found_there(tmp_path: Path) -> None:
    setup = beam(tmp_path)
    own, others, n = places_tried(setup, "bench", SENSORS)
    assert (own, others, n) == ([4, 8, 11], [2, 3, 5, 6, 7, 9, 10], 7)
    heavy, terms = with_mass(setup, 6, 0.3), list(setup.idealised)
    blocks = lambda model: [heavy.block(setup, model)]  # noqa: E731
    base = fit_terms(setup, "bench", terms, None, blocks)
    tried = lambda taken: elsewhere(setup, "bench", SENSORS, taken, only_here=False)  # noqa: E731
    assert len(tried(terms)) == 4 * n
    found = screened(setup, "bench", terms, base, blocks, tried(terms))
    assert found[0].name == "mass at 6"
    assert sum(t.physics == "added_mass" for t in found) <= setup.settings.most_fitted
    at_sensors = lambda taken: [point_mass(setup.free, node, 0.1) for node in own]  # noqa: E731
    _, posterior, rounds = select_terms(setup, "bench", terms, None, blocks, at_sensors, rounds=1, elsewhere=tried)
    assert rounds[0].taken is not None
    assert rounds[0].taken.label == "mass at 6"
    assert abs(posterior.values[-1] - 0.3) < 0.01
    # what the fit is without a term stays among the rivals, however far behind
    assert any(r.term is None for r in rounds[0].rivals)


def test_of_many_nodes_those_farthest_from_one_another_are_tried(tmp_path: Path) -> None:
    setup = beam(tmp_path)
    few = replace(setup, settings=replace(setup.settings, most_screened=3))
    assert places_tried(few, "bench", SENSORS[-2:]) == ([11], [2, 6, 4], 9)
