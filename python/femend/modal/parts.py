"""Modes looked for in parts of a band that holds more of them than one pLSCF model has poles for.

A model of order n with n_ref references has n n_ref / 2 pairs of poles, and needs two or three times as many as there
are modes before these stand still. Of a wide band the strongest modes are found then, those of its lower end, whose
accelerance is small, not at all, and the fit takes neighbours for one. A part of the band has fewer modes at the same
order (Peeters and Van der Auweraer, "PolyMAX: a revolution in operational modal analysis", IOMAC (2005), analyse band
by band for it); the modal model is fitted to the whole band all the same, so that parts only say where poles are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.modal.choose import DroppedMode, choose_modes
from femend.modal.lsfd import ModalFit, synthesise
from femend.modal.plscf import PoleTable, plscf_poles
from femend.modal.refine import RefinedModes, shape_deviations
from femend.modal.stabilisation import Stabilisation, stabilise

__all__ = ["FEWEST_LINES", "FoundModes", "find_modes", "misses", "octaves"]

# lines of a band that modes are looked for in at least: fewer are explained by residual terms and a mode of noise
FEWEST_LINES = 12
# lines an order, which leave room for noise, and the order that is enough
LINES_AN_ORDER, ORDER = 4, 60
# the modal model misses modes where it leaves more than this share, and so many times the scatter from line to line
MISSED, OVER_SCATTER = 0.2, 3.0
# a part is analysed with so much of its neighbours on each side, since poles at the ends of a band are poorly known
BESIDE = 0.125

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Span = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class FoundModes:
    """The `fitted` modes by frequency, the `diagram` their candidates are from, and those that were `dropped`."""

    diagram: Stabilisation
    fitted: RefinedModes
    dropped: tuple[DroppedMode, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _Band:
    """What modes are looked for in: `freq` (n_freq,) in Hz, `H` (n_freq, n_out, n_ref) of kind s^d times receptance,
    the deviations `noise` (n_out,), and how."""

    freq: Real
    H: Complex
    d: int
    noise: Real
    max_order: int | None
    residuals: str
    max_zeta: float


def find_modes(
    freq: Real, H: Complex, d: int, noise: Real, max_order: int | None, residuals: str, max_zeta: float
) -> FoundModes:
    """The modes of H (n_freq, n_out, n_ref), `noise` (n_out,), `d`, `residuals` and `max_zeta` as in `choose_modes`.

    Poles are looked for in the whole band up to `max_order` (None: 60, fewer for few lines). With None, where the fit
    misses modes (`misses`), they are looked for again in each octave with the same order, octaves that are missed
    halved, and so on with halves of halves, as long as what is found more earns its unknowns in the fit to the whole
    band by the Bayesian information criterion. Raises RecordingError for too few lines for the order.
    """
    band = _Band(freq, H, d, noise, max_order, residuals, max_zeta)
    parts = [(0, freq.size)]
    found = _found(band, parts)
    while max_order is None:
        missed = _missed(band, found.fitted.fit)
        finer = [half for part in (octaves(freq) if len(parts) == 1 else parts) for half in _halves(part, missed)]
        if len(finer) == len(parts) or not missed.any():
            break
        more = _found(band, finer)
        if not _earned(band, found.fitted.fit, more.fitted.fit):
            break
        parts, found = finer, more
    return found


def misses(left: float, size: float, scatter: float) -> bool:
    """Whether a modal model that leaves `left` of FRFs of `size`, all squares, misses modes: it leaves more than a
    fifth, and more than three times what the `scatter` from line to line explains. Raises nothing."""
    return left > MISSED**2 * size and left > OVER_SCATTER**2 * scatter


def _found(band: _Band, parts: Sequence[Span]) -> FoundModes:
    diagram = _joined([_of_part(band, part) for part in parts])
    candidates = diagram.chosen
    poles = np.array([c.pole for c in candidates], dtype=np.complex128)
    participation = np.array([c.participation for c in candidates], dtype=np.complex128)
    fitted, dropped = choose_modes(
        band.freq, band.H, band.d, poles, participation.reshape(poles.size, band.H.shape[2]), band.residuals,
        band.noise, band.max_zeta,
    )  # fmt: skip
    shape_sd = shape_deviations(band.freq, band.H, band.d, fitted, band.residuals)
    order = np.argsort(np.abs(fitted.fit.poles), kind="stable")
    fitted = replace(
        fitted, fit=_ordered(fitted.fit, order), pole_cov=fitted.pole_cov[order], shape_sd=shape_sd[:, order]
    )
    return FoundModes(diagram, fitted, dropped)


def _ordered(fit: ModalFit, order: NDArray[np.int64]) -> ModalFit:
    return replace(fit, poles=fit.poles[order], shapes=fit.shapes[:, order], participation=fit.participation[order])


def _of_part(band: _Band, part: Span) -> Stabilisation:
    """The diagram of the lines of a part and some beside it, with the clusters and the poles of the part alone."""
    whole = band.freq.size
    beside = int(np.ceil(BESIDE * (part[1] - part[0])))
    low, high = max(0, part[0] - beside), min(whole, part[1] + beside)
    H = band.H[low:high] / band.noise[:, None]
    diagram = stabilise(_poles(band.freq[low:high], H, band.max_order), max_zeta=band.max_zeta)
    if part == (0, whole):
        return diagram
    # ends of the band are no ends of a part: what lies beyond them is judged with the others
    least = -np.inf if part[0] == 0 else band.freq[part[0]]
    most = np.inf if part[1] == whole else band.freq[part[1]]
    own = [c for c in diagram.clusters if least <= c.freq < most]
    rows = np.sort(np.concatenate([np.zeros(0, dtype=np.int64), *(c.rows for c in own)]))
    at = np.zeros(diagram.table.order.size, dtype=np.int64)
    at[rows] = np.arange(rows.size)
    table = diagram.table
    return replace(
        diagram,
        table=PoleTable(table.order[rows], table.poles[rows], table.participation[rows]),
        level=diagram.level[rows],
        clusters=tuple(replace(c, rows=at[c.rows]) for c in own),
    )


def _joined(diagrams: Sequence[Stabilisation]) -> Stabilisation:
    """One diagram of those of all parts."""
    if len(diagrams) == 1:
        return diagrams[0]
    tables = [d.table for d in diagrams]
    first = np.concatenate([[0], np.cumsum([t.order.size for t in tables])])
    return Stabilisation(
        PoleTable(
            np.concatenate([t.order for t in tables]),
            np.concatenate([t.poles for t in tables]),
            np.concatenate([t.participation for t in tables]),
        ),
        np.concatenate([d.level for d in diagrams]),
        tuple(replace(c, rows=c.rows + n) for d, n in zip(diagrams, first, strict=False) for c in d.clusters),
        max(d.max_order for d in diagrams),
        diagrams[0].settings,
    )


def _poles(freq: Real, H: Complex, max_order: int | None) -> PoleTable:
    """Four lines per order leave room for noise; short bands get what orders the count of lines allows, up to 16."""
    if max_order is None:
        max_order = max(min(ORDER, freq.size // LINES_AN_ORDER), min(16, freq.size // 2 - 1))
    return plscf_poles(freq, H, max(2, max_order))


def _missed(band: _Band, fit: ModalFit) -> NDArray[np.bool_]:
    """The lines (n_freq,) in octaves of the band that the modal model misses; none where it does not miss the whole:
    octaves without modes are left for what is weak there (drift, a table that moves), which no parts explain."""
    left = np.abs(band.H - synthesise(band.freq, band.d, fit)) ** 2
    size = np.abs(band.H) ** 2
    scatter = float(np.sum(band.noise**2)) * band.H.shape[2]
    missed = np.zeros(band.freq.size, dtype=bool)
    if not misses(float(left.sum()), float(size.sum()), scatter * band.freq.size):
        return missed
    for low, high in octaves(band.freq, FEWEST_LINES):
        missed[low:high] = misses(float(left[low:high].sum()), float(size[low:high].sum()), scatter * (high - low))
    return missed


def octaves(freq: Real, least: int = LINES_AN_ORDER * ORDER) -> list[Span]:
    """The octaves of a band of lines `freq` (n_freq,) in Hz from its upper end down, as (first line, behind the last);
    what has less than `least` lines goes with the one above. Raises nothing."""
    octave = np.floor(np.log2(freq[-1] / freq) * (1.0 - 1e-12)).astype(np.int64)
    ends = [freq.size]
    for at in np.nonzero(np.diff(octave))[0][::-1] + 1:
        if ends[-1] - at >= least and at >= least:
            ends.append(int(at))
    return list(pairwise([0, *ends[::-1]]))


def _halves(part: Span, missed: NDArray[np.bool_]) -> list[Span]:
    """The halves of a part that reaches into `missed` lines, if each has the lines that the full order needs."""
    low, high = part
    middle = (low + high) // 2
    if not missed[low:high].any() or middle - low < LINES_AN_ORDER * ORDER:
        return [part]
    return [(low, middle), (middle, high)]


def _earned(band: _Band, fit: ModalFit, more: ModalFit) -> bool:
    """Whether the squares that `more` leaves are lower than those of `fit` by what its further modes, or one, cost."""
    left, now = (
        float(np.sum(np.abs((band.H - synthesise(band.freq, band.d, f)) / band.noise[:, None]) ** 2))
        for f in (fit, more)
    )
    n_data = 2 * band.H.size
    further = max(more.poles.size - fit.poles.size, 1)
    cost = 2 * further * (band.H.shape[1] + band.H.shape[2]) * np.log(n_data)
    return bool(n_data * np.log(max(left, 1e-300) / max(now, 1e-300)) > cost)
