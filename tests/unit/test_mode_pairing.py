"""Modes find their mates: crossing, close, repeated, missing, unseen and alike ones."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from numpy.typing import NDArray

from femend.correlate import align_cluster, close_groups, mac, pair_modes, principal_cosines, subspace_mac
from femend.errors import CorrelationError

RNG = np.random.default_rng(7)


def mated(pairing) -> dict[int, int]:
    return {p.a: p.b for p in pairing.pairs}


def ring(n: int, turn: float, extra: float = 0.0) -> tuple[NDArray, NDArray]:
    """Frequencies and shapes of a ring of `n` masses on springs to ground and to the next; its modes come in pairs.

    The shapes of a pair are turned by `turn` radians; `extra` is a mass on the first place, which parts the pairs.
    """
    K = 3.0 * np.eye(n) - np.roll(np.eye(n), 1, axis=0) - np.roll(np.eye(n), -1, axis=0)
    M = np.eye(n)
    M[0, 0] += extra
    values, phi = scipy.linalg.eigh(K, M)
    for k in range(1, n - 1, 2):
        c, s = np.cos(turn), np.sin(turn)
        phi[:, k : k + 2] = phi[:, k : k + 2] @ np.array([[c, -s], [s, c]])
    return np.sqrt(values) / (2 * np.pi), phi


def test_modes_that_changed_places_are_found_by_shape() -> None:
    phi = np.linalg.qr(RNG.standard_normal((12, 4)))[0]
    order = [2, 0, 3, 1]
    noisy = phi[:, order] * [3.0, -1.0, 0.5, -2.0] + 0.02 * RNG.standard_normal((12, 4))
    pairing = pair_modes(phi, noisy, [10.0, 12.0, 14.0, 16.0], [9.0, 12.5, 13.0, 18.0])
    assert mated(pairing) == {a: order.index(a) for a in range(4)}
    assert min(p.mac for p in pairing.pairs) > 0.9


@pytest.mark.parametrize("gap", [1.0, 0.3, 0.1, -0.1, -0.3, -1.0])
def test_two_modes_keep_their_names_through_a_veering_free_crossing(gap: float) -> None:
    # Bending in two uncoupled planes, one stiffened: frequencies cross, shapes stay.
    phi = np.eye(4)[:, :2] + 0.01
    f_test, f_model = np.array([10.0, 11.0]), np.array([10.5, 10.5 + gap])
    assert mated(pair_modes(phi, phi, f_test, f_model)) == {0: 0, 1: 1}


def test_close_modes_that_crossed_are_followed_by_their_shapes() -> None:
    # Two torsions 1.2 % apart in the test have changed places in the model, one with a twentieth of a third mode:
    # frequencies, and the space of both, would pair them wrongly.
    test = np.eye(6)[:, :3]
    model = np.eye(6)[:, [1, 0, 3]]
    model[3, 1] = np.sqrt(0.05)
    pairing = pair_modes(test[:, :2], model, [33.13, 33.53], [33.18, 33.46, 48.0])
    assert mated(pairing) == {0: 1, 1: 0}
    assert [round(p.mac, 2) for p in pairing.pairs] == [0.95, 1.0]
    # shapes turned by 45 degrees in their plane say nothing, and frequencies decide
    mixed = np.eye(6)[:, :2] @ np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
    assert mated(pair_modes(test[:, :2], mixed, [33.13, 33.53], [33.18, 33.46])) == {0: 0, 1: 1}


def test_assignment_beats_taking_the_best_first() -> None:
    # Both modes like b0 best (0.90); taking a0-b0 first leaves a1 with 0.15.
    a = np.array([[1.0, 0.8], [0.0, 0.6], [0.0, 0.0]])
    b = np.array([[np.sqrt(0.9), np.sqrt(0.75)], [np.sqrt(0.1), -np.sqrt(0.25)], [0.0, 0.0]])
    table = mac(a, b)
    assert table[0, 0] == pytest.approx(0.9, abs=1e-12)
    assert table[0, 1] + table[1, 0] > table[0, 0] + table[1, 1]
    assert mated(pair_modes(a, b, mac_min=0.0)) == {0: 1, 1: 0}


def test_repeated_modes_of_a_ring_pair_whatever_their_turn() -> None:
    fa, a = ring(9, 0.0)
    fb, b = ring(9, 0.7)
    alone = np.diagonal(mac(a, b))
    assert alone[1:].max() < 0.7, "the test has to be one that plain MAC fails"
    pairing = pair_modes(a, b, fa, 1.01 * fb)
    assert sorted(mated(pairing)) == list(range(9))
    assert all(p.a // 2 == p.b // 2 or (p.a + 1) // 2 == (p.b + 1) // 2 for p in pairing.pairs)
    assert [round(p.agreement, 9) for p in pairing.pairs] == [1.0] * 9
    assert [p.cluster for p in pairing.pairs] == [None, 0, 0, 1, 1, 2, 2, 3, 3]


def test_a_cluster_in_one_set_only_meets_modes_that_are_apart_in_the_other() -> None:
    # The test structure is symmetric and its shapes turned at will; the model carries a mass and has its pairs apart.
    fa, a = ring(9, 0.6)
    fb, b = ring(9, 0.0, extra=0.1)
    pairing = pair_modes(a, b, fa, fb, closeness=0.004)
    assert mated(pairing).keys() == set(range(9))
    assert min(p.agreement for p in pairing.pairs) > 0.95
    assert min(p.mac for p in pairing.pairs) < 0.9, "plain MAC would not do here"
    aligned = align_cluster(b[:, 1:3], a[:, 1:3])
    assert np.diagonal(mac(aligned, b[:, 1:3])).min() > 0.95


def test_a_cluster_does_not_swallow_a_mode_that_is_not_in_it() -> None:
    phi = np.linalg.qr(RNG.standard_normal((20, 5)))[0]
    freq = np.array([10.0, 10.05, 10.1, 30.0, 50.0])
    pairing = pair_modes(phi[:, [0, 2, 3]], phi, freq[[0, 2, 3]], freq)
    assert mated(pairing) == {0: 0, 1: 2, 2: 3}
    assert pairing.unpaired_b == (1, 4)


def test_a_crowd_of_close_modes_does_not_explain_any_shape() -> None:
    # 30 modes within 0.5 % of each other span all that 20 sensors see: everything has its share 1 there.
    rng = np.random.default_rng(3)
    crowd, freq = rng.standard_normal((20, 30)), 100.0 * 1.005 ** np.arange(30)
    strangers = rng.standard_normal((20, 4))
    assert subspace_mac(strangers, crowd) == pytest.approx(np.ones(4), abs=1e-12)
    apart = freq[[0, 8, 16, 24]]
    assert [p for p in pair_modes(strangers, crowd, apart, freq, mac_min=0.0).pairs if p.agreement > p.mac] == []
    known = pair_modes(crowd[:, 3:5] + 0.1 * strangers[:, :2], crowd, freq[3:5], freq)
    assert mated(known) == {0: 3, 1: 4}
    # A smaller crowd holds 9/20 of a stranger on average; that is taken off. (The best single mode of nine has 0.18.)
    values = [pair_modes(x, crowd[:, :9], [100.0], freq[:9], mac_min=0.0).pairs for x in rng.standard_normal((300, 20))]
    assert np.mean([p[0].agreement if p else 0.0 for p in values]) < 0.3 < 9 / 20


def test_what_has_no_mate_stays_alone() -> None:
    phi = np.linalg.qr(RNG.standard_normal((20, 6)))[0]
    pairing = pair_modes(phi[:, :4], phi[:, 2:])
    assert mated(pairing) == {2: 0, 3: 1}
    assert (pairing.unpaired_a, pairing.unpaired_b) == ((0, 1), (2, 3))


def test_a_mode_the_sensors_do_not_see_is_said_and_not_paired() -> None:
    phi = np.linalg.qr(RNG.standard_normal((6, 3)))[0]
    model = np.column_stack([phi[:, 0], 1e-15 * phi[:, 1], phi[:, 2]])
    pairing = pair_modes(phi, model, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    told = pair_modes(phi, phi, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0], seen_b=[True, False, True])
    assert told.notes == pairing.notes
    assert mated(told) == mated(pairing)
    assert mated(pairing) == {0: 0, 2: 2}
    assert (pairing.unpaired_a, pairing.unseen_b) == ((1,), (1,))
    assert "mode 2 of the second set does not move at the DOFs compared" in pairing.notes[0]


def test_frequency_decides_where_too_few_sensors_make_shapes_alike() -> None:
    # Bending modes 1 and 3 of a beam look the same at one pair of sensors.
    a = np.array([[1.0, 1.0], [1.0, 1.0]])
    pairing = pair_modes(a, a[:, ::-1], [10.0, 90.0], [88.0, 10.2])
    assert mated(pairing) == {0: 1, 1: 0}
    assert all("hardly tell them apart" in note for note in pairing.notes)
    assert len(pairing.notes) == 2


def test_one_mode_identified_twice_is_said() -> None:
    phi = np.linalg.qr(RNG.standard_normal((10, 2)))[0]
    twice = np.column_stack([phi[:, 0], phi[:, 0] + 1e-3 * phi[:, 1]])
    pairing = pair_modes(twice, phi, [10.0, 10.01], [10.0, 10.02])
    assert any("one mode seen twice" in note for note in pairing.notes)


def test_pairs_at_one_sensor_are_told_to_be_by_frequency_alone() -> None:
    pairing = pair_modes([[1.0, 0.5, 2.0]], [[1.0, 1.0, -1.0]], [10.0, 10.05, 30.0], [10.1, 10.15, 31.0])
    assert mated(pairing) == {0: 0, 1: 1, 2: 2}
    assert pairing.notes == ("at one DOF every shape is like every other: pairs are told by frequency alone",)


def test_one_shape_does_not_show_two_modes_of_a_cluster() -> None:
    # Two peaks of a run-up have the shape of mode 2, which has a close neighbour: the space of both holds either peak.
    phi = np.linalg.qr(np.random.default_rng(11).standard_normal((12, 3)))[0]
    peaks = np.column_stack([phi[:, 1], phi[:, 1]]) + 0.01 * np.random.default_rng(12).standard_normal((12, 2))
    pairing = pair_modes(peaks, phi, [11.6, 18.2], [3.4, 18.2, 18.38])
    assert mated(pairing) == {1: 1}
    assert (pairing.unpaired_a, pairing.unpaired_b) == ((0,), (0, 2))
    assert "modes 2, 1 are alike" in pairing.notes[0]
    assert "mode 1 has a MAC of 0.00 with mode 3 of the second set and is not paired with it" in pairing.notes[0]


def test_a_shape_of_a_cluster_meets_the_mode_that_it_is_like() -> None:
    # The frequency is that of the close neighbour, which no other mode of the test takes.
    phi = np.linalg.qr(np.random.default_rng(11).standard_normal((12, 3)))[0]
    pairing = pair_modes(phi[:, 1:2], phi, [18.5], [3.4, 18.2, 18.5])
    assert mated(pairing) == {0: 1}
    assert pairing.pairs[0].mac == pytest.approx(1.0)


def test_pairs_do_not_depend_on_scale_sign_phase_or_order() -> None:
    a = RNG.standard_normal((15, 5)) + 1j * RNG.standard_normal((15, 5))
    b = a + 0.3 * (RNG.standard_normal((15, 5)) + 1j * RNG.standard_normal((15, 5)))
    base = mated(pair_modes(a, b))
    turned = b * (np.exp(2j * np.pi * RNG.random(5)) * 10 ** RNG.uniform(-5, 5, 5))
    assert mated(pair_modes(a, turned)) == base
    order = RNG.permutation(5)
    moved = mated(pair_modes(a, b[:, order]))
    assert {i: int(order[j]) for i, j in moved.items()} == base


def test_mass_weight_is_used_for_pairs_and_clusters() -> None:
    phi = np.array([[1.0, 1.0], [0.1, -0.1], [0.1, -0.1]])
    mass = np.array([0.01, 1.0, 1.0])
    assert mac(phi, phi)[0, 1] > 0.9
    pairing = pair_modes(phi, phi[:, ::-1], weight=mass)
    assert mated(pairing) == {0: 1, 1: 0}
    assert pairing.pairs[0].rival == pytest.approx(1 / 9, rel=1e-12)  # (0.01 - 0.02)^2 / (0.01 + 0.02)^2
    pair = RNG.standard_normal((9, 2))
    heavy = RNG.uniform(0.1, 5.0, 9)
    mixed = pair @ np.array([[0.7, -0.7], [0.8, 0.6]])
    for weight in (heavy, np.diag(heavy), scipy.sparse.diags_array(heavy)):
        clustered = pair_modes(pair, mixed, [1.0, 1.001], [1.0, 1.001], weight=weight)
        assert [round(p.agreement, 9) for p in clustered.pairs] == [1.0, 1.0]
        assert min(p.mac for p in clustered.pairs) < 0.9


def test_groups_of_close_modes() -> None:
    assert close_groups([10.0, 10.1, 10.2, 11.0], 0.0101) == ((0, 1, 2),)
    assert close_groups([1e-5, 2e-4, 3e-5, 12.0, 12.01], 0.001) == ((0, 2, 1), (3, 4))
    assert close_groups([0.0, 0.0, 5.0], 0.01) == ((0, 1),)
    assert close_groups([1.0, 2.0, 3.0], 0.1) == ()


def test_s2mac_of_the_publication() -> None:
    # D'Ambrogio and Fregolent 2003: closed form for one vector and two, all at unit length.
    x, y1, y2 = (v / np.linalg.norm(v) for v in RNG.standard_normal((3, 8)))
    p, q, r = x @ y1, x @ y2, y1 @ y2
    published = (p**2 - 2 * p * r * q + q**2) / (1 - r**2)
    assert subspace_mac(x, np.column_stack([y1, y2]))[0] == pytest.approx(published, abs=1e-13)


def test_spans_agree_whatever_their_bases() -> None:
    basis = RNG.standard_normal((9, 3)) + 1j * RNG.standard_normal((9, 3))
    mixed = basis @ (RNG.standard_normal((3, 3)) + 1j * RNG.standard_normal((3, 3)))
    assert principal_cosines(basis, mixed) == pytest.approx(np.ones(3), abs=1e-10)
    a = np.eye(3)[:, :2]
    b = np.array([[1.0, 0.0], [0.0, np.cos(0.3)], [0.0, np.sin(0.3)]])
    assert principal_cosines(a, b) == pytest.approx([1.0, np.cos(0.3) ** 2], abs=1e-14)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pair_modes(np.eye(3), np.eye(2)), "3 and 2 DOFs"),
        (lambda: pair_modes(np.eye(3), np.eye(3), mac_min=1.5), "mac_min is 1.5"),
        (lambda: pair_modes(np.eye(3), np.eye(3), [1.0], [1.0, 2.0, 3.0]), "for 3 modes"),
        (lambda: pair_modes(np.eye(3), np.eye(3), seen_b=[True]), "1 marks of modes"),
        (lambda: close_groups([-1.0, 2.0], 0.01), "least -1 Hz"),
        (lambda: pair_modes([[np.nan]], [[1.0]]), "not finite"),
    ],
)
def test_what_cannot_be_paired_is_refused(call, words: str) -> None:
    with pytest.raises(CorrelationError, match=words):
        call()
