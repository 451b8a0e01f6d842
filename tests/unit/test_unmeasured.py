"""What forces of several recordings have in common, line by line."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.unmeasured import _mean_force

N, RECORDS = 2000, 3


def recovered(forces: list[NDArray[np.complex128]], index: list[NDArray[np.int64]]) -> Any:
    """Forces against the motion on the lines `index` of every record, seen alike on all of them."""
    record = SimpleNamespace(n=N, dt=1 / 500)
    return cast(
        Any,
        SimpleNamespace(
            records=[record] * RECORDS,
            F=[-f[:, None] for f in forces],
            weight=[np.ones((len(f), 1)) for f in forces],
            index=index,
        ),
    )


def spectra(seed: int, n: int) -> NDArray[np.complex128]:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.standard_normal(n) + 1j * rng.standard_normal(n))


def test_the_same_force_is_found_in_all_recordings() -> None:
    index = np.arange(20, 420)
    same = spectra(0, 400)
    mean, alike, ratio = _mean_force(recovered([same] * RECORDS, [index] * RECORDS))
    np.testing.assert_allclose(alike, 1.0)
    np.testing.assert_allclose(ratio, 1.0)
    np.testing.assert_allclose(np.fft.rfft(mean)[index], same)


def test_forces_of_their_own_have_nothing_in_common() -> None:
    index = np.arange(20, 420)
    own = [spectra(i, 400) for i in range(RECORDS)]
    _, alike, _ = _mean_force(recovered(own, [index] * RECORDS))
    assert max(alike) < 0.7


def test_lines_of_one_recording_alone_agree_with_nothing() -> None:
    """Of four hundred lines every recording keeps another third, and forty that are the same for all."""
    lines = np.arange(20, 420)
    common = lines[::10]
    index = [np.union1d(lines[i::RECORDS], common) for i in range(RECORDS)]
    own = [spectra(i, len(x)) for i, x in enumerate(index)]
    _, alike, _ = _mean_force(recovered(own, index))
    assert max(alike) < 0.7
