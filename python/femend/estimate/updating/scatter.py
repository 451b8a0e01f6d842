"""Weights from test scatter: the same structure tested several times, or several nominally equal ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.correlate import msf, pair_modes
from femend.data import ModeSet
from femend.dof import Dof
from femend.errors import UpdatingError

__all__ = ["Scatter", "scatter_of"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scatter:
    """Means and standard deviations of modes over several tests; `count` (n_modes,) tests have each mode.

    `freq`, `freq_sd` (n_modes,) in Hz, `zeta`, `zeta_sd` (n_modes,) fractions; `phi`, `phi_sd` (n_dof, n_modes) of
    shapes whose mean has largest component 1. Deviations are those of one test (n - 1 in the denominator);
    `of_mean()` gives those of the mean. A mode that one test alone has has NaN.
    """

    dofs: tuple[Dof, ...]
    freq: FloatArray
    freq_sd: FloatArray
    zeta: FloatArray
    zeta_sd: FloatArray
    phi: FloatArray
    phi_sd: FloatArray
    count: NDArray[np.int64]

    def of_mean(self) -> Scatter:
        """The same with the deviations of the means, those of one test over the root of `count`: what repetitions on
        one structure tell it to. For nominally equal structures the deviations of one test are those to weigh by."""
        root = np.sqrt(self.count)
        return Scatter(
            self.dofs, self.freq, self.freq_sd / root, self.zeta, self.zeta_sd / root, self.phi, self.phi_sd / root,
            self.count,
        )  # fmt: skip

    def __repr__(self) -> str:
        lines = [f"{'mode':>4} {'tests':>6} {'f [Hz]':>10} {'sd [%]':>8} {'zeta [%]':>9} {'sd [%]':>8} {'shape sd':>9}"]
        for i in range(self.freq.size):
            lines.append(
                f"{i + 1:4d} {self.count[i]:6d} {self.freq[i]:10.5g} {100 * self.freq_sd[i] / self.freq[i]:8.3f} "
                f"{100 * self.zeta[i]:9.3g} {100 * self.zeta_sd[i]:8.3g} "
                f"{float(np.sqrt(np.mean(self.phi_sd[:, i] ** 2))):9.4f}"
            )
        return "\n".join(lines)


def scatter_of(tests: Sequence[ModeSet], *, mac_min: float = 0.5) -> Scatter:
    """Means and scatter of the modes of `tests` of one set of sensors, in any order and with any signs of shapes.

    Modes are paired with those of the test that has most (`correlate.pair_modes` from `mac_min` on), which leaves out
    what that one lacks; shapes are brought to it by their modal scale factor before they are averaged. Complex shapes
    are to be made real before (`IdentifiedModes.to_mode_set`). Raises UpdatingError for fewer than two tests, other
    sensors, or complex shapes.

    >>> sensors = (Dof(1, 3), Dof(2, 3))
    >>> tests = [ModeSet([f], [0.01], [[1.0], [s]], sensors, "max") for f, s in ((9.9, 0.5), (10.1, 0.5))]
    >>> round(float(scatter_of(tests).freq_sd[0]), 3)
    0.141
    """
    if len(tests) < 2:
        raise UpdatingError(f"scatter takes two tests or more, there is {len(tests)}; state deviations instead")
    first = max(tests, key=lambda t: t.n_modes)
    rows = [_rows(t, first) for t in tests]
    freq, zeta = np.full((2, len(tests), first.n_modes), np.nan)
    phi = np.full((len(tests), len(first.dofs), first.n_modes), np.nan)
    for k, (test, (at, sign)) in enumerate(zip(tests, rows, strict=True)):
        own = test.phi[at] * sign[:, None]
        for pair in pair_modes(first.phi, own, first.freq, test.freq, mac_min=mac_min).pairs:
            freq[k, pair.a], zeta[k, pair.a] = test.freq[pair.b], test.zeta[pair.b]
            scale = float(np.real(msf(first.phi[:, pair.a], own[:, pair.b])[0]))
            phi[k, :, pair.a] = scale * own[:, pair.b]
    count = np.isfinite(freq).sum(axis=0)
    several = count > 1

    def spread(values: FloatArray) -> FloatArray:
        d = np.nansum((values - np.nanmean(values, axis=0)) ** 2, axis=0)
        return np.asarray(np.where(several, np.sqrt(d / np.maximum(count - 1, 1)), np.nan))

    mean = np.nanmean(phi, axis=0)
    size = np.abs(mean).max(axis=0)
    return Scatter(
        first.dofs, np.nanmean(freq, axis=0), spread(freq), np.nanmean(zeta, axis=0), spread(zeta), mean / size,
        spread(phi) / size, count,
    )  # fmt: skip


def _rows(test: ModeSet, first: ModeSet) -> tuple[NDArray[np.int64], FloatArray]:
    """Rows and signs of a test's sensors in the order of the first's."""
    if np.iscomplexobj(test.phi):
        raise UpdatingError("a test has complex shapes; turn them real (IdentifiedModes.to_mode_set)")
    at = {(d.node, d.component): i for i, d in enumerate(test.dofs)}
    missing = [d for d in first.dofs if (d.node, d.component) not in at]
    if missing or len(test.dofs) != len(first.dofs):
        what = f"{missing[0]} is missing" if missing else f"there are {len(test.dofs)} and {len(first.dofs)}"
        raise UpdatingError(f"the tests have other sensors: {what}; scatter is that of the same ones")
    rows = np.array([at[d.node, d.component] for d in first.dofs], dtype=np.int64)
    return rows, np.array([float(d.sign * test.dofs[i].sign) for d, i in zip(first.dofs, rows, strict=True)])
