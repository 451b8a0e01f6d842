"""FRF criteria on labelled FRFs: outputs, inputs and lines matched, signs and units applied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.correlate.labelled import DofMatch, match_dofs
from femend.correlate.responses import csac, csf, faac, frac
from femend.data.bands import within_band
from femend.data.frf import FRF
from femend.dof import Dof
from femend.errors import CorrelationError, PairingError, UnitError
from femend.units import parse_unit

__all__ = ["FrfComparison", "MatchedFrf", "compare_frfs", "match_frfs"]


@dataclass(frozen=True, slots=True, eq=False)
class MatchedFrf:
    """Two FRFs over the same lines, outputs and inputs: `H_a`, `H_b` (n_freq, n_out, n_in) in the unit of the first.

    `freq` (n_freq,) in Hz; `outputs` and `inputs` are the DOFs in the directions of the first set.
    """

    freq: NDArray[np.float64]
    H_a: NDArray[np.complex128]
    H_b: NDArray[np.complex128]
    outputs: tuple[Dof, ...]
    inputs: tuple[Dof, ...]
    kind: str
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class FrfComparison:
    """Criteria of two FRFs: `csac`, `csf` (n_freq,) over frequency, `frac`, `faac` (n_out, n_in) per DOF pair."""

    matched: MatchedFrf
    csac: NDArray[np.float64]
    csf: NDArray[np.float64]
    frac: NDArray[np.float64]
    faac: NDArray[np.float64]

    def band(self, low: float, high: float) -> dict[str, Any]:
        """Least and mean CSAC and CSF over the lines from `low` to `high` in Hz, NaN left out.

        Raises CorrelationError where no line lies there.
        """
        inside = within_band(self.matched.freq, (low, high))
        if not inside.any():
            raise CorrelationError(
                f"no line lies from {low:g} to {high:g} Hz; the FRFs go from {self.matched.freq[0]:.6g} to "
                f"{self.matched.freq[-1]:.6g} Hz"
            )
        found: dict[str, Any] = {"n_freq": int(inside.sum())}
        for name in ("csac", "csf"):
            values = getattr(self, name)[inside]
            values = values[np.isfinite(values)]
            found[name] = {"least": float(values.min()), "mean": float(values.mean())} if values.size else None
        return found

    def __repr__(self) -> str:
        m = self.matched
        return (
            f"FrfComparison({len(m.outputs)} outputs, {len(m.inputs)} inputs, {m.freq.size} lines: mean CSAC "
            f"{np.nanmean(self.csac):.3f}, mean CSF {np.nanmean(self.csf):.3f})"
        )


def match_frfs(a: FRF, b: FRF, *, places: Mapping[Dof, Dof] | None = None, rotations: bool = False) -> MatchedFrf:
    """Brings `b` to the lines, DOFs, directions and unit of `a`; `places` and `rotations` as in `match_dofs`.

    Lines match within 1e-3 of the distance to the next one; the rest is left out. Channels without a DOF are left
    out. Raises CorrelationError for another kind of FRF or no common line, UnitError for units that do not convert,
    PairingError where no output or no input is shared.
    """
    if a.kind != b.kind:
        raise CorrelationError(
            f"{a.name!r} is {a.kind} and {b.name!r} {b.kind}; bring both to one kind (divide by i omega, or compute "
            f"the model's as {a.kind})"
        )
    factor = _unit_factor(a, b)
    lines_a, lines_b = _common_lines(a, b)
    rows_a, outputs = _match(a.output_dofs, b.output_dofs, "output", places, rotations)
    rows_b, inputs = _match(a.input_dofs, b.input_dofs, "input", places, rotations)
    sign = outputs.sign[:, None] * inputs.sign[None, :]
    H_a = a.H[np.ix_(lines_a, rows_a[0][outputs.rows_a], rows_b[0][inputs.rows_a])]
    H_b = b.H[np.ix_(lines_b, rows_a[1][outputs.rows_b], rows_b[1][inputs.rows_b])] * (factor * sign)
    return MatchedFrf(a.freq[lines_a], H_a, H_b, outputs.dofs, inputs.dofs, a.kind, a.unit)


def compare_frfs(a: FRF, b: FRF, *, places: Mapping[Dof, Dof] | None = None, rotations: bool = False) -> FrfComparison:
    """CSAC, CSF, FRAC and FAAC of `b` with `a` (the reference); `places` and `rotations` as in `match_dofs`.

    Raises what `match_frfs` raises.
    """
    m = match_frfs(a, b, places=places, rotations=rotations)
    return FrfComparison(m, csac(m.H_a, m.H_b), csf(m.H_a, m.H_b), frac(m.H_a, m.H_b), faac(m.H_a, m.H_b))


def _match(
    dofs_a: Sequence[Dof | None],
    dofs_b: Sequence[Dof | None],
    what: str,
    places: Mapping[Dof, Dof] | None,
    rotations: bool,
) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], DofMatch]:
    """Positions of the channels that have a DOF, in both sets, and the match among them."""
    kept = [np.array([i for i, d in enumerate(dofs) if d is not None], dtype=np.int64) for dofs in (dofs_a, dofs_b)]
    named = [[d for d in dofs if d is not None] for dofs in (dofs_a, dofs_b)]
    try:
        return (kept[0], kept[1]), match_dofs(named[0], named[1], places=places, rotations=rotations)
    except PairingError as error:
        raise PairingError(f"{what}s of the FRFs: {error}") from None


def _common_lines(a: FRF, b: FRF) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    step = np.gradient(a.freq) if a.freq.size > 1 else np.full(1, max(float(a.freq[0]), 1e-12))
    nearest = np.clip(np.searchsorted(b.freq, a.freq), 1, max(b.freq.size - 1, 1))
    nearest = np.minimum(nearest, b.freq.size - 1)
    before = np.maximum(nearest - 1, 0)
    nearest = np.where(np.abs(b.freq[before] - a.freq) < np.abs(b.freq[nearest] - a.freq), before, nearest)
    lines = np.nonzero(np.abs(b.freq[nearest] - a.freq) <= 1e-3 * step)[0]
    if lines.size == 0:
        raise CorrelationError(
            f"{a.name!r} ({a.freq.size} lines, {a.freq[0]:.6g} to {a.freq[-1]:.6g} Hz) and {b.name!r} ({b.freq.size} "
            f"lines, {b.freq[0]:.6g} to {b.freq[-1]:.6g} Hz) have no line in common; compute the model's FRF at the "
            "measured lines"
        )
    return lines, nearest[lines]


def _unit_factor(a: FRF, b: FRF) -> float:
    if a.unit == b.unit:
        return 1.0
    one, other = parse_unit(a.unit), parse_unit(b.unit)
    if one.dims != other.dims:
        raise UnitError(f"{a.name!r} is in {a.unit!r} and {b.name!r} in {b.unit!r}, which measure different things")
    return other.factor / one.factor
