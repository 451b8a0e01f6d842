"""Gyroscopic pair and stiffness over speed against direct matrices."""

from __future__ import annotations

import numpy as np
import pytest

from femend.errors import LawParameterError
from femend.physics import SpeedStiffness, gyroscopic_matrix, receptance_with_pair

IT, IP, K, C = 0.03, 0.05, 2e3, 0.4


def test_a_rotor_on_springs_has_its_two_whirls() -> None:
    # It theta'' + G theta' + K theta = 0 whirls at omega = (+-Ip W + sqrt((Ip W)^2 + 4 It K)) / (2 It)
    speed = 400.0
    G = gyroscopic_matrix(IP, speed)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K / IT * np.eye(2), -G / IT]])
    omega = np.sort(np.abs(np.linalg.eigvals(A).imag))[::2]
    root = np.sqrt((IP * speed) ** 2 + 4 * IT * K)
    assert omega == pytest.approx([(root - IP * speed) / (2 * IT), (root + IP * speed) / (2 * IT)], rel=1e-12)
    v = np.array([0.3, -1.2])
    assert v @ G @ v == pytest.approx(0.0, abs=1e-15)


def test_a_closed_pair_is_the_model_with_the_matrix_in_it() -> None:
    rng = np.random.default_rng(2)
    n, omega = 5, np.linspace(10.0, 600.0, 40)
    A = rng.normal(size=(n, n))
    M, stiffness = np.eye(n) * IT, A @ A.T * 100 + K * np.eye(n)
    w = rng.normal(size=(2, n))
    G = gyroscopic_matrix(IP, 300.0)
    s = 1j * omega[:, None, None]
    Z = stiffness + s * C * np.eye(n) + s**2 * M
    closed = receptance_with_pair(np.linalg.inv(Z), w, s * G)
    assert closed == pytest.approx(np.linalg.inv(Z + s * (w.T @ G @ w)), rel=1e-8)


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(LawParameterError, match=r"must be \(2, 3\)"):
        receptance_with_pair(np.zeros((4, 3, 3), dtype=complex), np.zeros((3, 2)), np.zeros((4, 2, 2), dtype=complex))


def test_stiffness_over_speed_is_linear_in_its_values() -> None:
    speeds, k = np.array([0.0, 50.0, 120.0, 300.0]), np.array([1e6, 1.4e6, 1.1e6, 3e6])
    law = SpeedStiffness(speeds, k)
    asked = np.array([-10.0, 0.0, 20.0, 50.0, 90.0, 299.0, 400.0])
    assert law.weights(asked) @ k == pytest.approx(law.at(asked), rel=1e-13)
    assert law.weights(asked).sum(axis=-1) == pytest.approx(1.0)
    for i in range(4):
        step = np.zeros(4)
        step[i] = 1.0
        difference = (SpeedStiffness(speeds, k + step).at(asked) - SpeedStiffness(speeds, k - step).at(asked)) / 2
        assert law.weights(asked)[:, i] == pytest.approx(difference, abs=1e-9)
    line = 2.0 + 3.0 * speeds
    assert line @ law.roughness() @ line == pytest.approx(0.0, abs=1e-15 * float(line @ line))
    assert k @ law.roughness() @ k > 0
    with pytest.raises(LawParameterError, match="rising speeds"):
        SpeedStiffness(speeds[::-1], k)
