"""The generator of cases: plans, files that are repeated to the byte, readable, and without the answer."""

from __future__ import annotations

import pathlib

import numpy as np
import one_record
import pytest
from blindgen import case, excite, frfs, integrate, plan, respond, uff58

import femend as fe


def test_blocks_hold_every_effect_once() -> None:
    """A third controls by default, fourteen effects and two rare ones in every block; other shares and kinds."""
    labels = plan.block(3, 2)
    assert sum(q.startswith("none") for q in labels) == 8
    assert len(labels) == 24
    assert all(labels.count(q) == 1 for q in plan.EFFECTS)
    assert sum(q in plan.RARE for q in labels) == 2
    assert all(q.startswith("none") for q in plan.block(3, 2, controls=1.0))
    assert sum(q.startswith("outside:") for q in plan.block(1, 0, 0.2, "outside")) == 16
    for q in plan.block(1, 0, 0.0, "two"):
        for family in case.FAMILIES:
            a, b = plan.suited(q, family).removeprefix("two:").split("+")
            assert a != b
            assert not {a, b} & set(plan.LONE.get(family, ()))
    families = [plan.family(1, i, list(case.FAMILIES)) for i in range(10)]
    assert all(families.count(f) == 2 for f in case.FAMILIES)


def test_same_seed_same_bytes(written: tuple[pathlib.Path, dict], tmp_path: pathlib.Path) -> None:
    """Every file of a case is repeated bit by bit, and another number gives another case."""
    folder, _ = written
    again = tmp_path / "b0001"
    case.write_case(again, 7, 0, "cantilever", "none:parameters")
    files = sorted(p.relative_to(folder) for p in folder.rglob("*.*") if p.is_file())
    assert len(files) == 7 + 3
    assert all((folder / f).read_bytes() == (again / f).read_bytes() for f in files)
    other = tmp_path / "b0002"
    case.write_case(other, 7, 1, "cantilever", "none:parameters")
    assert (other / "public/high.uff").read_bytes() != (folder / "public/high.uff").read_bytes()


def test_files_are_readable_and_hide_the_answer(written: tuple[pathlib.Path, dict]) -> None:
    """pyuff reads what we wrote; predict recordings hold the force alone; noise is where it should be."""
    pyuff = pytest.importorskip("pyuff")
    folder, told = written
    sets = pyuff.UFF(str(folder / "public/high.uff")).read_sets()
    mine = uff58.read(folder / "public/high.uff")
    assert [(s["rsp_node"], s["rsp_dir"], s["ordinate_spec_data_type"]) for s in sets] == [
        (c.node, c.direction, c.kind) for c in mine
    ]
    assert all(
        np.array_equal(np.asarray(s["data"], np.float32), c.data.astype(np.float32))
        for s, c in zip(sets, mine, strict=True)
    )
    assert abs(1 / sets[0]["abscissa_inc"] / told["rate"] - 1) < 1e-5
    assert [c.kind for c in uff58.read(folder / "public/sweep.uff")] == [uff58.FORCE]
    assert len(uff58.read(folder / "sealed/sweep.uff")) == len(mine)
    assert not (folder / "public/truth.json").exists()
    assert 9.8 < mine[0].data.std() < 10.2
    deck = (folder / "public/model.bdf").read_text()
    assert deck.count("CBAR") == 18
    assert deck.count("CONM2") == 1
    assert "ENDDATA" in deck


@pytest.mark.parametrize("kind", ["multisine", "noise"])
def test_frfs_are_those_of_the_truth(kind: str, short: None) -> None:
    """Averages of either kind come near to the modal sum, nearer than their coherence says of one average."""
    rng = np.random.default_rng(3)
    test, _ = case.make(rng, "cantilever", "none:exact", 0.01)
    m = respond.modal_of(test, ())

    def recorder(force: excite.Force, n: int) -> tuple[np.ndarray, np.ndarray]:
        # steady motion in place of an integration, which a test without compiled loops has no time for
        period = 4 * n
        s = 2j * np.pi * np.fft.rfftfreq(period, 1 / test.rate)
        u = np.resize(force.at(test.rate, n), period)
        return u[-n:], np.fft.irfft(accelerance(m, s) * np.fft.rfft(u), period)[:, -n:]

    made = frfs.measured(rng, test, kind, recorder)
    H, coherence = made[: len(test.sensors)], made[len(test.sensors) :]
    assert [f.at for f in H] == test.sensors
    assert all(f.force == test.drive for f in made)
    assert all(c.coherence for c in coherence)
    exact = accelerance(m, 2j * np.pi * H[0].freq)
    size = np.abs(exact).max()
    for f, c, right in zip(H, coherence, exact, strict=True):
        assert c.data.max() <= 1 + 1e-9
        assert np.median(np.abs(f.data - right)) < 0.02 * size


def accelerance(m: integrate.Modal, s: np.ndarray) -> np.ndarray:
    """Accelerances (n_out, K) of the truth's modes, and of what is above them, to its first force."""
    q = s**2 / (m.omega[:, None] ** 2 + s**2 + 2 * (m.zeta * m.omega)[:, None] * s)
    return (m.sensor * m.load[0]) @ q + m.carried[:, :1]


def test_a_case_of_frfs_holds_two_places_of_the_shaker(
    tmp_path: pathlib.Path, short: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frfs, "AVERAGES", 2)
    monkeypatch.setattr(frfs, "block_seconds", lambda _: 0.25)
    monkeypatch.setattr(frfs, "WAIT", 1)
    case.write_case(tmp_path / "b0001", 7, 0, "cantilever", "none:exact", case.Options(frf=True))
    public = tmp_path / "b0001" / "public"
    assert sorted(p.name for p in public.glob("*.uff")) == ["frf1.uff", "frf2.uff", "random.uff", "sweep.uff"]
    first, second = (fe.read_recording(public / f"frf{i}.uff").frf for i in (1, 2))
    assert first.coherence is not None
    assert first.inputs != second.inputs
    assert first.outputs == second.outputs
    assert first.kind == "accelerance"
    study = (public / "study.toml").read_text()
    assert study.count('role = "fit"') == 2
    assert 'name = "frf2"' in study


def test_one_recording_is_left_to_fit() -> None:
    block = '[[recording]]\nname = "{}"\nrole = "{}"\n\n'
    head = 'title = "c"\n\n'
    study = head + "".join(block.format(*r) for r in (("low", "fit"), ("high", "fit"), ("sweep", "predict")))
    left = head + block.format("high", "fit") + block.format("sweep", "predict")
    assert one_record.kept_alone(study, "high") == left
    with pytest.raises(ValueError, match="no recording 'sweep' with role"):
        one_record.kept_alone(study, "sweep")
