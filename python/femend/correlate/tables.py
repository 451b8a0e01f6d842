"""Tables of what two sets of modes differ in: frequency, damping, shape."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from femend.correlate._arrays import finite, shape_pair
from femend.correlate.assurance import msf
from femend.correlate.pairing import ModePairing
from femend.errors import CorrelationError

__all__ = ["ModeRow", "ModeTable", "mode_table"]


@dataclass(frozen=True, slots=True)
class ModeRow:
    """One pair of modes, numbered from 0, the first set being the reference.

    `freq_difference` is (f_b - f_a) / f_a and `zeta_difference` (zeta_b - zeta_a) / zeta_a, fractions, NaN where the
    reference is 0; `shape_difference` is |a - MSF b| / |a| = sqrt(1 - MAC), in a cluster sqrt(1 - agreement) of the
    pair. `scale` is the modal scale factor that brings `b` to `a`; its modulus compares the scaling of the sets.
    """

    a: int
    b: int
    freq_a: float
    freq_b: float
    freq_difference: float
    zeta_a: float
    zeta_b: float
    zeta_difference: float
    mac: float
    shape_difference: float
    scale: complex
    cluster: int | None


@dataclass(frozen=True, slots=True)
class ModeTable:
    """Rows of pairs, and the frequencies in Hz of modes without a mate."""

    rows: tuple[ModeRow, ...]
    alone_a: tuple[tuple[int, float], ...] = ()
    alone_b: tuple[tuple[int, float], ...] = ()
    notes: tuple[str, ...] = ()

    def text(self, name_a: str = "test", name_b: str = "model") -> str:
        """The table in words and figures, modes numbered from 1; `name_a`, `name_b` head the columns."""
        head = f"{name_a:>6} {name_b:>6} {'f ' + name_a:>12} {'f ' + name_b:>12} {'df %':>8}"
        head += f" {'zeta ' + name_a + ' %':>14} {'zeta ' + name_b + ' %':>14} {'dzeta %':>8} {'MAC':>6} {'shape %':>8}"
        lines = [head]
        for r in self.rows:
            mark = "" if r.cluster is None else f"  cluster {r.cluster + 1}"
            lines.append(
                f"{r.a + 1:>6} {r.b + 1:>6} {r.freq_a:>12.5g} {r.freq_b:>12.5g} {_percent(r.freq_difference, 2):>8}"
                f" {100 * r.zeta_a:>14.3g} {100 * r.zeta_b:>14.3g} {_percent(r.zeta_difference, 0):>8}"
                f" {r.mac:>6.3f} {100 * r.shape_difference:>8.1f}{mark}"
            )
        lines += [f"{k + 1:>6} {'-':>6} {f:>12.5g}" for k, f in self.alone_a]
        lines += [f"{'-':>6} {k + 1:>6} {'':>12} {f:>12.5g}" for k, f in self.alone_b]
        return "\n".join([*lines, *self.notes])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not a number is None, a complex scale is [real, imaginary]."""
        rows = []
        for row in self.rows:
            plain: dict[str, Any] = {k: _plain(v) for k, v in asdict(row).items()}
            rows.append(plain)
        return {
            "rows": rows,
            "alone_a": [list(x) for x in self.alone_a],
            "alone_b": [list(x) for x in self.alone_b],
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        return f"ModeTable({len(self.rows)} pairs)\n{self.text()}"


def mode_table(
    pairing: ModePairing,
    freq_a: ArrayLike,
    freq_b: ArrayLike,
    phi_a: ArrayLike,
    phi_b: ArrayLike,
    zeta_a: ArrayLike | None = None,
    zeta_b: ArrayLike | None = None,
) -> ModeTable:
    """Table of the pairs of `pairing`: `freq_a` (n_a,), `freq_b` (n_b,) in Hz, `zeta_a`, `zeta_b` fractions.

    `phi_a` (n_dof, n_a) and `phi_b` (n_dof, n_b) are the shapes that were paired; the first set is the reference of
    all differences; damping that is not given counts as 0. Raises CorrelationError for sizes that do not fit.

    >>> from femend.correlate import pair_modes
    >>> phi = [[1.0, 0.0], [0.0, 1.0]]
    >>> table = mode_table(pair_modes(phi, phi), [10.0, 20.0], [11.0, 19.0], phi, phi)
    >>> [round(row.freq_difference, 3) for row in table.rows]
    [0.1, -0.05]
    """
    a, b = shape_pair(phi_a, phi_b)
    fa, fb = _per_mode(freq_a, a.shape[1], "frequencies"), _per_mode(freq_b, b.shape[1], "frequencies")
    za = np.zeros_like(fa) if zeta_a is None else _per_mode(zeta_a, a.shape[1], "damping ratios")
    zb = np.zeros_like(fb) if zeta_b is None else _per_mode(zeta_b, b.shape[1], "damping ratios")
    rows = []
    for p in pairing.pairs:
        scale = complex(msf(a[:, p.a], b[:, p.b])[0])
        rows.append(
            ModeRow(
                a=p.a,
                b=p.b,
                freq_a=float(fa[p.a]),
                freq_b=float(fb[p.b]),
                freq_difference=_relative(fa[p.a], fb[p.b]),
                zeta_a=float(za[p.a]),
                zeta_b=float(zb[p.b]),
                zeta_difference=_relative(za[p.a], zb[p.b]),
                mac=p.mac,
                shape_difference=float(np.sqrt(max(0.0, 1.0 - p.agreement))),
                scale=scale,
                cluster=p.cluster,
            )
        )
    alone_a = tuple((i, float(fa[i])) for i in sorted((*pairing.unpaired_a, *pairing.unseen_a)))
    alone_b = tuple((j, float(fb[j])) for j in sorted((*pairing.unpaired_b, *pairing.unseen_b)))
    return ModeTable(tuple(rows), alone_a, alone_b, pairing.notes)


def _per_mode(values: ArrayLike, n_modes: int, what: str) -> np.ndarray:
    array = np.asarray(finite(values, f"the {what}"), dtype=np.float64)
    if array.shape != (n_modes,):
        raise CorrelationError(f"{what} of shape {array.shape} for {n_modes} modes; one per mode")
    return array


def _relative(reference: float, value: float) -> float:
    return float((value - reference) / reference) if reference != 0 else float("nan")


def _percent(value: float, digits: int) -> str:
    return "-" if np.isnan(value) else f"{100 * value:+.{digits}f}"


def _plain(value: Any) -> Any:
    if isinstance(value, complex):
        return [value.real, value.imag] if np.isfinite(value) else None
    return None if isinstance(value, float) and not np.isfinite(value) else value
