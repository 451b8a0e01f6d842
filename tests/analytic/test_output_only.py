"""Output-only modes of chains whose modes are known: inside the stated uncertainty, close ones told apart."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.errors import RecordingTooShortError
from femend.modal.output_only import identify_output_only, merge_setups
from femend.modal.output_only.stabilisation import mac

sys.path.insert(0, str(Path(__file__).parents[1]))
import oma_chain as oma

CHAIN = oma.Chain()
BAND = (0.5, 11.0)
METHODS = ("ssi", "plscf", "efdd")


def test_truth_lies_inside_the_stated_uncertainty_as_often_as_it_should() -> None:
    """40 recordings, 4 modes each. The deviations come from 50 neighbouring blocks of which some 12 are independent, so
    that 1.96 of them hold the truth in 92.5 % of all cases (Student's t) and not in 95 %: of 160 intervals fewer than
    137 do once in two thousand times. The scatter over the stated deviation is 1.1 then, its standard error 6 %."""
    freq, _ = CHAIN.modes()
    off_f, off_z = [], []
    for seed in range(40):
        found = identify_output_only(oma.ambient(CHAIN, seed, 300.0), BAND, max_order=30)
        at = oma.nearest(found.freq, freq)
        assert len(set(at.tolist())) == CHAIN.n
        off_f.append((found.freq[at] - freq) / found.modes.freq_sd[at])
        off_z.append((found.zeta[at] - CHAIN.zeta) / found.modes.zeta_sd[at])
    for off in (np.ravel(off_f), np.ravel(off_z)):
        assert np.count_nonzero(np.abs(off) < 1.96) >= 137
        assert 0.8 < np.sqrt(np.mean(off**2)) < 1.35


@pytest.mark.parametrize("method", METHODS)
def test_every_method_finds_the_modes_and_no_others(method: str) -> None:
    freq, phi = CHAIN.modes()
    found = identify_output_only(oma.ambient(CHAIN, 3, 400.0), BAND, method)
    assert found.modes.n_modes == CHAIN.n
    assert (np.abs(found.freq - freq) < 4 * found.modes.freq_sd).all()
    assert (np.abs(found.zeta - CHAIN.zeta) < 4 * found.modes.zeta_sd).all()
    assert np.diag(mac(found.modes.shapes, phi)).min() > 0.995
    # stated deviations are of the size of Au's law: not below it by more than their own scatter, not ten times it
    best = freq * np.sqrt(CHAIN.zeta / (4 * np.pi * freq * 400.0))
    assert (found.modes.freq_sd > 0.5 * best).all()
    assert (found.modes.freq_sd < 8 * best).all()


def test_shapes_lie_inside_their_uncertainty() -> None:
    _, phi = CHAIN.modes()
    found = identify_output_only(oma.ambient(CHAIN, 5, 400.0), BAND)
    true = phi / phi[np.argmax(np.abs(found.modes.shapes), axis=0), np.arange(CHAIN.n)]
    known = found.shape_sd > 1e-6  # the largest component is 1 by definition
    off = np.abs(found.modes.shapes - true)[known] / found.shape_sd[known]
    assert np.mean(off < 2.5) > 0.8  # 12 complex components: chi with two degrees of freedom stays below 2.5 in 95.6 %


def test_two_close_modes_are_two() -> None:
    chain = oma.Chain(k=(400.0, 20.0, 400.0, 400.0, 20.0), m=(1.0,) * 5)
    freq, phi = chain.modes()
    assert (freq[3] - freq[2]) / freq[2] < 0.04  # closer than two bandwidths of 2 %
    found = identify_output_only(oma.ambient(chain, 2, 600.0), (0.2, 11.0))
    at = oma.nearest(found.freq, freq)
    assert len(set(at.tolist())) == chain.n
    assert (np.abs(found.freq[at] - freq) < 4 * found.modes.freq_sd[at]).all()
    assert mac(found.modes.shapes[:, at], phi).diagonal().min() > 0.98


@pytest.mark.parametrize("method", ["ssi", "plscf"])
def test_a_run_up_is_taken_as_it_is(method: str) -> None:
    chain = oma.Chain(k=(1.0, 0.8, 1.4, 0.6), m=(1.0, 1.2, 0.9, 1.0))
    freq, phi = chain.modes()
    data, speed = oma.sweep(chain, 150.0, 0.8, 14.0)
    found = identify_output_only(data, (1.0, 12.0), method, speed=speed)
    at = oma.nearest(found.freq, freq)
    # a mode passed in a few periods at the start of the sweep is the least known
    assert np.abs(found.freq[at] / freq - 1)[1:].max() < 3e-3
    assert mac(found.modes.shapes[:, at], phi).diagonal()[1:].min() > 0.98
    assert np.isnan(found.modes.freq_sd).all()
    assert any("not stationary" in note for note in found.notes)


def test_too_short_a_recording_names_the_length_it_needs() -> None:
    freq, _ = CHAIN.modes()
    with pytest.raises(RecordingTooShortError, match="record at least") as caught:
        identify_output_only(oma.ambient(CHAIN, 1, 20.0), BAND)
    error = caught.value
    assert error.duration == 20.0
    assert error.freq == pytest.approx(freq[0], rel=0.05)
    # 1 / (2 pi zeta f cov^2), cov = 1/2, at the true damping; the estimate allows for a lower one
    assert error.needed > 0.9 * 4 / (2 * np.pi * CHAIN.zeta * freq[0])
    enough = identify_output_only(oma.ambient(CHAIN, 1, 1.5 * error.needed), BAND)
    assert enough.freq[0] == pytest.approx(freq[0], rel=0.02)


def test_set_ups_are_merged_by_their_references() -> None:
    chain = oma.Chain(k=(1.0,) * 6, m=(1.0,) * 6)
    freq, phi = chain.modes()
    first = identify_output_only(oma.ambient(chain, 1, 500.0).select([0, 1, 2, 5]), (0.5, 11.0))
    second = identify_output_only(oma.ambient(chain, 2, 500.0).select([0, 3, 4, 5]), (0.5, 11.0))
    merged = merge_setups([first, second])
    assert merged.modes.n_modes == chain.n
    assert merged.incomplete == ()
    assert [str(d) for d in merged.references] == ["1:+X", "6:+X"]
    assert np.diag(mac(merged.modes.shapes, phi)).min() > 0.99
    assert (np.abs(merged.modes.freq - freq) < 4 * merged.modes.freq_sd).all()
    # both recordings say it together better than either alone
    assert (merged.modes.freq_sd < np.minimum(first.modes.freq_sd, second.modes.freq_sd)).all()


def test_what_set_ups_disagree_about_is_said() -> None:
    stiffer = oma.Chain(k=(1.08,) * 4, top=10.0 * 1.08**0.5)
    first = identify_output_only(oma.ambient(CHAIN, 1, 400.0), BAND)
    second = identify_output_only(oma.ambient(stiffer, 2, 400.0), BAND)
    moved = merge_setups([first, second])
    assert moved.status == "doubtful"
    assert all("no partner" in text for text in moved.incomplete) or all(
        "frequency moved" in text for text in moved.inconsistent
    )
    again = oma.ambient(CHAIN, 3, 400.0)
    wrong = again.with_values(again.values * np.array([[1.0], [1.0], [1.6], [1.0]]), name="wrong gain")
    gain = merge_setups([first, identify_output_only(wrong, BAND)])
    assert sum("reference 3:+X" in text for text in gain.inconsistent) >= 2
