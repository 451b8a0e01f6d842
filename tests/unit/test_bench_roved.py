"""Recordings of a point each, by a hammer or a sensor that goes from one to the next, are one modal test."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import SENSORS, TABLES, Recorded, measured_frf
from femend import Channel, Dof, functions_of, load_study, write_uff
from femend.bench.reading.measured import MeasuredModes, measured_modes
from femend.data import FRF
from femend.progress import SilentProgress


def point_by_point(folder: Path, moved: str, cut: int = 0, structures: str = "") -> list[MeasuredModes]:
    """What is measured where each of six points has a recording; the hammer strikes node 5 downwards, and the last
    recording lacks `cut` lines at its end. `structures` ends the study."""
    (folder / "model.bdf").write_text(small_study.deck())
    whole = measured_frf(folder, Recorded("tip"))
    text = small_study.study_text({})
    for i, node in enumerate(SENSORS):
        one = whole.select([i])
        if moved == "hammer":
            sign = -1 if node == 5 else 1
            struck, sensor = Channel(Dof(node, 3, sign), "force", "N"), Channel(Dof(13, 3), "acceleration", "m/s^2")
            one = FRF(f"p{node}", one.freq, sign * one.H, [sensor], [struck], one.kind, one.unit)
        if cut and node == SENSORS[-1]:
            one = replace(one, freq=one.freq[:-cut], H=one.H[:-cut])
        write_uff(folder / f"p{node}.uff", functions_of(one))
        text += f'[[recording]]\nname = "p{node}"\nfile = "p{node}.uff"\n'
    path = folder / "study.toml"
    path.write_text(text + TABLES + structures)
    found, passed = measured_modes(load_study(path), SilentProgress())
    assert passed == ()
    return list(found)


@pytest.mark.parametrize("moved", ["hammer", "sensor"])
def test_points_that_are_recorded_one_by_one_are_one_test(tmp_path: Path, moved: str) -> None:
    [one] = point_by_point(tmp_path, moved)
    assert one.name == "p3"
    assert {d.node for d in one.modes.dofs} == set(SENSORS)
    # deviations of the shapes count in an update
    assert one.shape_sd is not None
    assert one.shape_sd.shape == one.modes.shapes.shape
    assert any("with 5 more" in w and f"the {moved} went from point to point: 6 points" in w for w in one.warnings)
    signs = {d.node: d.sign for d in one.modes.dofs}
    assert signs[5] == (-1 if moved == "hammer" else 1)
    order = np.argsort([d.node for d in one.modes.dofs])
    # the first bending mode of a cantilever: all points move one way, the further out the more
    first = (one.modes.to_mode_set().phi[:, 0] * [d.sign for d in one.modes.dofs])[order]
    assert (np.diff(np.abs(first)) > 0).all()
    assert len(set(np.sign(first))) == 1


def test_recordings_with_other_lines_stay_for_themselves_and_are_told(tmp_path: Path) -> None:
    found = point_by_point(tmp_path, "hammer", cut=200)
    assert [m.name for m in found] == [f"p{n}" for n in SENSORS]
    assert any("not taken as one: 'p13' has other lines" in w for w in found[0].warnings)


def test_structures_of_a_population_stay_apart(tmp_path: Path) -> None:
    halves = [("a", SENSORS[:3]), ("b", SENSORS[3:])]
    tables = "".join(
        f'[[updating.structure]]\nname = "{name}"\nrecordings = {[f"p{n}" for n in nodes]}\n' for name, nodes in halves
    )
    more = '[[updating.structure]]\nname = "c"\nrecordings = ["again"]\n'
    whole = measured_frf(tmp_path, Recorded("tip"))
    write_uff(tmp_path / "again.uff", functions_of(whole))
    text = '[[recording]]\nname = "again"\nfile = "again.uff"\n'
    found = point_by_point(tmp_path, "hammer", structures=text + tables + more)
    assert [(m.name, {d.node for d in m.modes.dofs}) for m in found] == [
        ("p3", set(SENSORS[:3])), ("p9", set(SENSORS[3:])), ("again", set(SENSORS)),
    ]  # fmt: skip
