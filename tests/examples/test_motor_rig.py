"""The motor rig: what issue-size rigs must show, on synthetic ones with known truth and on the shared recordings."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from femend.model.model import read_model
from femend.model.terms.configured import free_model
from femend.study.run import diagnose
from femend.study.staged.content import ods_correlation
from femend.study.staged.study_run import StagedRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_rig

OTHER = Rig(
    mass=30.0, lx=0.6, k=(15000.0, 18000.0, 40000.0), factors=(0.93, 1.1, 1.12), layer=(4e5, 6e5, 1.5e6),
    dashpots=(500.0, 700.0, 2000.0), unbalance=(4e-3, 2e-3), phase=(1.0, -2.0), sense=-1,
)  # fmt: skip
RIGS = {
    "bending springs on a layer": (OTHER, ["compliant_support", "spring_bending"]),
    "bending springs, no layer": (Rig(layer=None, factors=(1.1, 0.95, 1.05)), ["spring_bending"]),
    "plain springs on a layer": (
        Rig(bends=False, factors=(1.05, 0.92, 1.1), mass_factor=1.02, layer=(1.2e6, 9e5, 5e6), onset=2.0),
        ["compliant_support"],
    ),
    "nothing missing": (Rig(bends=False, layer=None, factors=(0.95, 1.03, 0.9), mass_factor=0.98), []),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(RIGS))
def test_a_synthetic_rig_is_told_for_what_it_is(name: str, tmp_path: Path) -> None:
    rig, expected = RIGS[name]
    run = diagnose(write_rig(tmp_path, rig))
    assert isinstance(run, StagedRun)
    assert sorted(f["physics"] for f in run.result["findings"]) == expected
    assert run.result["verdict"] == ("missing-physics" if expected else "parameters-only")
    for finding in run.result["findings"]:
        if finding["physics"] == "compliant_support":
            assert finding["configurations"] == ["operation"]
            assert rig.layer is not None
            found = [finding["parameters"][f"k_{a}"]["value"] for a in "xyz"]
            assert found == pytest.approx(rig.layer, rel=0.1)
    (load,) = run.result["loads"]
    assert load["sense"] == rig.sense
    assert load["exponent"] == pytest.approx(2.0, abs=0.1)
    assert load["laws"]["named"] == "unbalance"
    assert all(part["left_out"] in (None, "adds nothing", "noise") for part in load["data"])
    assert load["unbalance"] == pytest.approx(rig.unbalance, rel=0.1)
    assert np.angle(np.exp(1j * (np.radians(load["phase_deg"]) - rig.phase))) == pytest.approx(0.0, abs=np.radians(10))
    assert [result.onset for _, result in run.final.runs] == [rig.onset]
    true = np.load(tmp_path / "rundown.true.npy")
    (rundown,) = [p for p in run.predictions if p.name == "rundown"]
    assert np.linalg.norm(rundown.stages["final"] - true) < 0.15 * np.linalg.norm(true)


@pytest.mark.slow
def test_forces_that_grow_with_another_power_are_named_and_predicted(tmp_path: Path) -> None:
    """Forces that grow with Omega^3 on a rig without other gaps: the law is the finding, the run-down follows."""
    rig = Rig(bends=False, layer=None, factors=(0.95, 1.03, 0.9), power=3.0)
    run = diagnose(write_rig(tmp_path, rig))
    assert isinstance(run, StagedRun)
    (finding,) = run.result["findings"]
    assert finding["physics"] == "unbalance_law"
    assert finding["location"]["nodes"] == [511, 512]
    assert finding["parameters"]["exponent"]["value"] == pytest.approx(3.0, abs=0.05)
    assert run.result["verdict"] == "missing-physics"
    (load,) = run.result["loads"]
    assert load["laws"]["named"] == "power"
    true = np.load(tmp_path / "rundown.true.npy")
    (rundown,) = [p for p in run.predictions if p.name == "rundown"]
    assert np.linalg.norm(rundown.stages["final"] - true) < 0.15 * np.linalg.norm(true)


@pytest.mark.slow
def test_the_shared_rig(script: Callable[[str], ModuleType], shared: Callable[[str], Path], tmp_path: Path) -> None:
    """Named findings, law of the force, correlation; nothing here opens what is sealed."""
    study = shared("cases/rig/public/study.toml")
    run = script("motor_rig").main(study, tmp_path)
    by_name = {f["physics"]: f for f in run.result["findings"]}
    assert list(by_name) == ["compliant_support", "spring_bending"]
    assert by_name["compliant_support"]["configurations"] == ["operation"]
    (load,) = run.result["loads"]
    assert load["exponent"] == pytest.approx(2.0, abs=0.1)
    assert load["laws"]["named"] == "unbalance"
    first = run.result["stages"][0]
    assert len(first["modes"]) == 5
    assert all(abs(m["model_freq"] / m["freq"] - 1) < 0.01 and m["mac"] > 0.95 for m in first["modes"])
    assert any("cannot see" in remark for remark in first["remarks"])
    (_, result) = run.final.runs[0]
    c = ods_correlation(run, result)
    for low, high in ((5.0, 6.5), (9.5, 13.0)):
        assert c["csac"][(c["freq"] >= low) & (c["freq"] <= high)].min() > 0.95
    assert result.error < 0.02
    assert {p.name for p in tmp_path.glob("rig_*.png")} == {
        f"rig_{n}.png"
        for n in ("stabilisation", "frf", "mac", "waterfall", "forces", "ods", "csac", "sensitivity", "shapes")
    }
    assert (tmp_path / "report.html").read_text().count("data:image/png") == 8
    # the tacho's pulses are shorter than a sample at the highest speed: told, and the only thing to tell beside what
    # the patched deck has as comments
    (warning, *of_the_deck) = run.result["warnings"]
    assert [said for said in of_the_deck if "the updated deck" not in said] == []
    assert any("do nothing until case control selects" in said for said in of_the_deck)
    assert "'runup'" in warning
    assert "tacho" in warning
    # the patched deck stands on its layer once nothing is held, with the modes of operation
    free = free_model(read_model(tmp_path / "model.updated.bdf").deck, units="SI", parameters=[])
    K, M = (A.toarray() for A in free.matrices())
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(K, M)).real)[::-1]
    found = 1 / np.sqrt(squares[:8]) / (2 * np.pi)
    omega, _ = result.model.modes(result.posterior.p)
    assert found == pytest.approx(omega[:8] / (2 * np.pi), rel=0.01)


@pytest.mark.slow
def test_what_a_run_alone_cannot_tell_is_said(tmp_path: Path) -> None:
    """A run-up on a layer without any other recording: never a sure verdict about a model that does not explain it."""
    study = write_rig(tmp_path, OTHER)
    text = study.read_text()
    head, *recordings = text.split("[[recording]]")
    kept = [r for r in recordings if '"runup"' in r]
    study.write_text(head + "".join(f"[[recording]]{r}" for r in kept))
    run = diagnose(study)
    assert isinstance(run, StagedRun)
    (_, result) = run.final.runs[0]
    unsure = run.result["verdict"] in ("undetermined", "located-not-named")
    if result.error > 0.15:
        assert unsure
        assert "ambient" in run.result["advice"]
    else:
        assert unsure or [f["physics"] for f in run.result["findings"]][:1] == ["compliant_support"]
