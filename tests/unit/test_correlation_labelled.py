"""Labelled modes and FRFs meet by DOF, direction, line and unit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from femend.correlate import compare_frfs, compare_modes, mac_of_modes, match_dofs, match_frfs
from femend.data import FRF, Channel, ModeSet
from femend.dof import Dof
from femend.errors import CorrelationError, PairingError, UnitError

RNG = np.random.default_rng(5)
DOFS = tuple(Dof(n, c) for n in range(1, 6) for c in (1, 2, 3))
PHI = np.linalg.qr(RNG.standard_normal((15, 4)))[0]
MODEL = ModeSet([5.0, 7.0, 9.0, 14.0], [0.01] * 4, PHI, DOFS)


def measured(rows: list[int], turned: list[int], order: list[int], factor: float = 1.02) -> ModeSet:
    """A test of `MODEL` at some of its DOFs; sensors `turned` (positions in rows) are mounted the other way round."""
    sign = np.array([-1.0 if k in turned else 1.0 for k in range(len(rows))])
    dofs = tuple(Dof(DOFS[i].node, DOFS[i].component, int(s)) for i, s in zip(rows, sign, strict=True))
    phi = sign[:, None] * PHI[rows][:, order] * [2.0, -0.5, 1.0, 3.0][: len(order)]
    return ModeSet(factor * MODEL.freq[order], [0.02] * len(order), phi, dofs, "unscaled")


def test_a_sensor_mounted_the_other_way_round_counts_with_its_sign() -> None:
    test = measured([9, 0, 4, 14, 7, 2], turned=[1, 3], order=[1, 0, 3])
    table = mac_of_modes(test, MODEL)
    assert table[[0, 1, 2], [1, 0, 3]] == pytest.approx(np.ones(3), abs=1e-12)
    unsigned = ModeSet(test.freq, test.zeta, test.phi, tuple(d.unsigned for d in test.dofs), "unscaled")
    assert mac_of_modes(unsigned, MODEL)[[0, 1, 2], [1, 0, 3]].max() < 0.95


def test_comparison_pairs_and_tabulates() -> None:
    found = compare_modes(measured([9, 0, 4, 14, 7, 2], [1, 3], [1, 0, 3]), MODEL)
    rows = found.table.rows
    assert [(r.a, r.b) for r in rows] == [(0, 1), (1, 0), (2, 3)]
    assert [r.freq_difference for r in rows] == pytest.approx([1 / 1.02 - 1] * 3, rel=1e-12)
    assert [r.zeta_difference for r in rows] == pytest.approx([-0.5] * 3, rel=1e-12)
    assert [r.scale for r in rows] == pytest.approx([2.0, -0.5, 1.0], rel=1e-12)
    assert max(r.shape_difference for r in rows) < 1e-6
    assert found.table.alone_b == ((2, 9.0),)
    lines = found.table.text().splitlines()
    assert lines[1].split() == ["1", "2", "7.14", "7", "-1.96", "2", "1", "-50", "1.000", "0.0"]
    assert lines[-1].split() == ["-", "3", "9"]
    assert json.loads(json.dumps(found.table.to_dict()))["rows"][1]["scale"] == pytest.approx([-0.5, 0.0])


def test_shape_difference_is_what_the_scale_factor_leaves() -> None:
    phi = MODEL.phi + 0.05 * RNG.standard_normal(MODEL.phi.shape)
    found = compare_modes(ModeSet(MODEL.freq, MODEL.zeta, phi, DOFS), MODEL)
    for r in found.table.rows:
        left = phi[:, r.a] - r.scale.real * PHI[:, r.b]
        assert r.shape_difference == pytest.approx(np.linalg.norm(left) / np.linalg.norm(phi[:, r.a]), rel=1e-9)


def test_sensors_with_other_names_meet_through_places() -> None:
    test = measured([0, 4, 8, 9], [2], [0, 1])
    renamed = tuple(Dof(d.node + 100, d.component, d.sign) for d in test.dofs)
    moved = ModeSet(test.freq, test.zeta, test.phi, renamed, "unscaled")
    with pytest.raises(PairingError, match="share none of their 4 and 15 DOFs"):
        mac_of_modes(moved, MODEL)
    places = dict(zip(renamed, test.dofs, strict=True))
    assert np.diagonal(mac_of_modes(moved, MODEL, places=places)) == pytest.approx([1.0, 1.0], abs=1e-12)
    # the same map, written for the unsigned sensors
    plain = {k.unsigned: v.unsigned for k, v in places.items()}
    assert np.diagonal(mac_of_modes(moved, MODEL, places=plain)) == pytest.approx([1.0, 1.0], abs=1e-12)


def test_rotations_stay_out_unless_asked_for() -> None:
    dofs = (Dof(1, 3), Dof(1, 5), Dof(2, 3))
    match = match_dofs(dofs, dofs)
    assert (match.dofs, match.n_rotations) == ((Dof(1, 3), Dof(2, 3)), 1)
    assert len(match_dofs(dofs, dofs, rotations=True).dofs) == 3
    with pytest.raises(PairingError, match="1 shared rotations are left out"):
        match_dofs(dofs[1:2], dofs)
    with pytest.raises(PairingError, match="DOF 1:-Z stands twice in the second set, at 0 and 1"):
        match_dofs(dofs, (Dof(1, 3), Dof(1, 3, -1)))


def test_a_mode_that_the_sensors_cannot_see_is_said() -> None:
    # Yaw of a block with vertical sensors only: the vertical part of the mode is rounding.
    phi = np.array([[1.0, 1.0, 1e-9], [1.0, -1.0, -2e-9], [0.0, 0.0, 1.0]])
    model = ModeSet([8.0, 11.0, 15.0], [0.0] * 3, phi, (Dof(1, 3), Dof(2, 3), Dof(1, 2)))
    test = ModeSet([8.1, 11.2], [0.01] * 2, phi[:2, :2], (Dof(1, 3), Dof(2, 3)), "unscaled")
    found = compare_modes(test, model)
    assert found.pairing.unseen_b == (2,)
    assert [(r.a, r.b) for r in found.table.rows] == [(0, 0), (1, 1)]
    assert "mode 3 of the second set does not move at the DOFs compared" in found.table.text()


def channels(dofs: list[Dof], quantity: str, unit: str) -> tuple[Channel, ...]:
    return tuple(Channel(d, quantity, unit) for d in dofs)


def frf(freq, H, outputs, inputs, unit: str = "m/s^2/N", kind: str = "accelerance") -> FRF:
    return FRF("some", freq, H, channels(outputs, "acceleration", "m/s^2"), channels(inputs, "force", "N"), kind, unit)


def test_frfs_meet_by_dof_direction_line_and_unit() -> None:
    freq = np.arange(1.0, 6.0)
    H = RNG.standard_normal((5, 3, 2)) + 1j * RNG.standard_normal((5, 3, 2))
    outputs, inputs = [Dof(1, 3), Dof(2, 3), Dof(3, 3)], [Dof(1, 3), Dof(2, 1)]
    model = frf(freq, H, outputs, inputs)
    # measured: other order, second output and first input turned, in g, at every second line only
    turned = np.array([1.0, -1.0])[:, None] * np.array([1.0, -1.0])[None, :]
    test = frf(
        freq[[1, 3]],
        H[np.ix_([1, 3], [2, 1], [1, 0])] * turned / 9.80665,
        [Dof(3, 3), Dof(2, 3, -1)],
        [Dof(2, 1), Dof(1, 3, -1)],
        "g/N",
    )
    m = match_frfs(test, model)
    assert m.freq.tolist() == [2.0, 4.0]
    assert m.outputs == (Dof(3, 3), Dof(2, 3, -1))
    np.testing.assert_allclose(m.H_b, m.H_a, rtol=1e-12)
    found = compare_frfs(test, model)
    for value in (found.csac, found.csf, found.frac, found.faac):
        np.testing.assert_allclose(value, 1.0, atol=1e-12)
    assert found.frac.shape == (2, 2)
    assert found.band(3.5, 5.0) == {
        "n_freq": 1,
        "csac": {"least": pytest.approx(1.0), "mean": pytest.approx(1.0)},
        "csf": {"least": pytest.approx(1.0), "mean": pytest.approx(1.0)},
    }
    with pytest.raises(CorrelationError, match="no line lies from 10 to 20 Hz"):
        found.band(10.0, 20.0)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"kind": "mobility", "unit": "m/s/N"}, CorrelationError, "is accelerance and 'some' mobility"),
        ({"unit": "V/N"}, UnitError, "measure different things"),
        ({"freq": [1.5, 2.5]}, CorrelationError, "have no line in common"),
        ({"inputs": [Dof(9, 1)]}, PairingError, "inputs of the FRFs: the two sets share none"),
    ],
)
def test_frfs_that_do_not_meet_are_refused(change: dict, error: type[Exception], words: str) -> None:
    whole = {"freq": [1.0, 2.0], "outputs": [Dof(1, 3)], "inputs": [Dof(1, 3)]}
    H = np.ones((2, 1, 1))
    with pytest.raises(error, match=words):
        match_frfs(frf(H=H, **whole), frf(H=H, **{**whole, **change}))


@pytest.mark.parametrize("n_lines", [1, 2, 7])
def test_lines_match_whatever_their_number(n_lines: int) -> None:
    freq = 3.0 + 0.25 * np.arange(n_lines)
    one = frf(freq, np.ones((n_lines, 1, 1)), [Dof(1, 3)], [Dof(1, 3)])
    wide = frf(0.25 * np.arange(40) + 1e-6, np.ones((40, 1, 1)), [Dof(1, 3)], [Dof(1, 3)])
    assert match_frfs(one, wide).freq.tolist() == freq.tolist()
    assert match_frfs(wide, one).freq == pytest.approx(freq, abs=1e-5)
