"""Several set-ups with common reference sensors merged into one set of modes (PoSER).

Post-separate-estimation re-scaling: each set-up is identified alone and its shapes are scaled so that the reference
components agree in the least-squares sense (Reynders, Magalhães, De Roeck and Cunha, Merging strategies for
multi-setup operational modal analysis, IMAC XXVII (2009)). What does not agree is said: a frequency that
moved between set-ups, reference components that no scale brings together, a mode that a set-up did not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2

from femend.data import IdentifiedModes
from femend.data._arrays import frozen
from femend.dof import Dof
from femend.errors import RecordingError
from femend.modal.output_only.result import OutputOnlyModes
from femend.modal.output_only.stabilisation import mac, unit_shapes
from femend.numerals import plain

__all__ = ["MergedModes", "merge_setups"]

# Below this MAC at the references two modes of neighbouring frequency are not the same one.
SAME_MODE_MAC = 0.8
# A disagreement as large as this by chance once in a hundred modes is reported.
SIGNIFICANCE = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class MergedModes:
    """Modes over the sensors of all set-ups.

    `modes` have shapes (n_dof, n_modes) with largest component 1, frequencies and damping weighted by their inverse
    variances; `shape_sd` (n_dof, n_modes); `scales` (n_setups, n_modes) complex, what each set-up's shape was
    multiplied by before the largest component was made 1; `reference_mac` (n_setups, n_modes) of each set-up's
    reference components with the merged ones; `inconsistent` one text per mode, empty where all agreed; `incomplete`
    texts on modes that not every set-up saw, which are left out. `status` is "ok" or "doubtful".
    """

    modes: IdentifiedModes
    shape_sd: NDArray[np.float64]
    scales: NDArray[np.complex128]
    reference_mac: NDArray[np.float64]
    references: tuple[Dof, ...]
    inconsistent: tuple[str, ...]
    incomplete: tuple[str, ...]
    status: str

    def __post_init__(self) -> None:
        for label in ("shape_sd", "scales", "reference_mac"):
            object.__setattr__(self, label, frozen(getattr(self, label)))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the shapes."""
        return {
            **self.modes.to_dict(),
            "references": [str(d) for d in self.references],
            "reference_mac": self.reference_mac.tolist(),
            "inconsistent": list(self.inconsistent),
            "incomplete": list(self.incomplete),
            "status": self.status,
        }


@dataclass(frozen=True, slots=True, eq=False)
class _Setup:
    """One set-up's modes with rows in the positive sense of their axes."""

    name: str
    modes: IdentifiedModes
    shapes: NDArray[np.complex128]
    sd: NDArray[np.float64]
    row: dict[tuple[int, int], int]


def merge_setups(setups: Sequence[OutputOnlyModes], references: Sequence[Dof] | None = None) -> MergedModes:
    """Merges the modes of `setups` by the sensors they share; harmonics are left out.

    `references` are the common DOFs to scale by, all shared ones without; the sign of a sensor's direction is taken
    into account and merged rows point along the positive axes. Raises RecordingError for fewer than two set-ups, no
    common sensor, or a reference that a set-up does not have.
    """
    if len(setups) < 2:
        raise RecordingError(f"{len(setups)} set-up is nothing to merge; give the modes of at least two set-ups")
    parts = [_positive(one) for one in setups]
    shared = _references(parts, references)
    chains, incomplete = _matched(parts, shared)
    places = sorted({place for part in parts for place in part.row})
    columns = [_merged(parts, chain, shared, places) for chain in chains]
    dofs = tuple(Dof(node, component, 1) for node, component in places)
    n = len(columns)
    poles = np.array([c.pole for c in columns], dtype=np.complex128)
    rank = np.argsort(np.abs(poles), kind="stable")
    ordered = [columns[i] for i in rank]
    modes = IdentifiedModes(
        dofs,
        poles[rank],
        np.array([c.shape for c in ordered], dtype=np.complex128).reshape(n, len(dofs)).T,
        freq_sd=np.array([c.freq_sd for c in ordered]),
        zeta_sd=np.array([c.zeta_sd for c in ordered]),
    )
    said = tuple(c.said for c in ordered)
    return MergedModes(
        modes,
        np.array([c.sd for c in ordered]).reshape(n, len(dofs)).T,
        np.array([c.scales for c in ordered]).reshape(n, len(parts)).T,
        np.array([c.macs for c in ordered]).reshape(n, len(parts)).T,
        tuple(Dof(node, component, 1) for node, component in shared),
        said,
        incomplete,
        "doubtful" if incomplete or any(said) else "ok",
    )


def _positive(one: OutputOnlyModes) -> _Setup:
    keep = np.flatnonzero(~one.harmonic)
    modes = one.modes.select(keep)
    sign = np.array([d.sign for d in modes.dofs], dtype=np.float64)
    row = {(d.node, d.component): i for i, d in enumerate(modes.dofs)}
    return _Setup(one.recording, modes, modes.shapes * sign[:, None], one.shape_sd[:, keep], row)


def _references(parts: list[_Setup], references: Sequence[Dof] | None) -> list[tuple[int, int]]:
    common = set.intersection(*(set(part.row) for part in parts))
    if references is None:
        if not common:
            raise RecordingError(
                f"the {len(parts)} set-ups share no sensor; keep at least one (better as many as there are close "
                "modes) in place while the others rove"
            )
        return sorted(common)
    wanted = [(d.node, d.component) for d in references]
    for dof, place in zip(references, wanted):
        for part in parts:
            if place not in part.row:
                raise RecordingError(
                    f"reference {dof} is no sensor of set-up {part.name!r}; name DOFs that every set-up has",
                    recording=part.name,
                )
    return wanted


def _matched(parts: list[_Setup], shared: list[tuple[int, int]]) -> tuple[list[list[int]], tuple[str, ...]]:
    """Positions of each mode in every set-up, for modes that all saw, and texts on the others. The first set-up leads:
    every other one is assigned to it by least distance in half bandwidths, where the references' MAC allows."""
    lead = parts[0]
    partners: list[dict[int, int]] = []
    unseen: list[str] = []
    for part in parts[1:]:
        f, g = lead.modes.freq, part.modes.freq
        alike = mac(_at(lead, shared), _at(part, shared))
        width = np.maximum.outer(lead.modes.zeta * f, part.modes.zeta * g)
        width = np.maximum(width, 3 * np.hypot.outer(_sd(lead.modes.freq_sd), _sd(part.modes.freq_sd)))
        distance = np.abs(np.subtract.outer(f, g)) / width + (1 - alike)
        allowed = (np.abs(np.subtract.outer(f, g)) <= 2 * width) & (alike >= SAME_MODE_MAC)
        rows, columns = linear_sum_assignment(np.where(allowed, distance, 1e3))
        pairs = {int(r): int(c) for r, c in zip(rows, columns) if allowed[r, c]}
        partners.append(pairs)
        unseen += [
            f"the mode at {plain(g[c])} Hz of set-up {part.name!r} has no partner in {lead.name!r}"
            for c in range(g.size)
            if c not in pairs.values()
        ]
    chains = []
    for i in range(lead.modes.n_modes):
        missing = [part.name for part, pairs in zip(parts[1:], partners) if i not in pairs]
        if missing:
            unseen.append(
                f"the mode at {plain(lead.modes.freq[i])} Hz of {lead.name!r} has no partner in {', '.join(missing)}"
            )
        else:
            chains.append([i, *(pairs[i] for pairs in partners)])
    return chains, tuple(unseen)


def _sd(values: NDArray[np.float64] | None) -> NDArray[np.float64]:
    assert values is not None
    return np.nan_to_num(values)


def _at(part: _Setup, places: list[tuple[int, int]]) -> NDArray[np.complex128]:
    return part.shapes[[part.row[place] for place in places]]


@dataclass(frozen=True, slots=True, eq=False)
class _Column:
    """One merged mode."""

    pole: complex
    shape: NDArray[np.complex128]
    freq_sd: float
    zeta_sd: float
    sd: NDArray[np.float64]
    scales: NDArray[np.complex128]
    macs: NDArray[np.float64]
    said: str


def _merged(
    parts: list[_Setup], chain: list[int], shared: list[tuple[int, int]], places: list[tuple[int, int]]
) -> _Column:
    refs = np.stack([_at(part, shared)[:, i] for part, i in zip(parts, chain)], axis=1)
    # The direction that is nearest to all set-ups' reference components, each of unit size.
    common = np.linalg.svd(refs / np.linalg.norm(refs, axis=0))[0][:, 0]
    scales = (refs.conj() * common[:, None]).sum(axis=0) / (np.abs(refs) ** 2).sum(axis=0)
    macs = mac(refs, common[:, None])[:, 0]
    total = np.zeros(len(places), dtype=np.complex128)
    weight, variance = np.zeros(len(places)), np.zeros(len(places))
    for part, i, scale in zip(parts, chain, scales):
        for at, place in enumerate(places):
            if place in part.row:
                total[at] += scale * part.shapes[part.row[place], i]
                variance[at] += (abs(scale) * part.sd[part.row[place], i]) ** 2
                weight[at] += 1
    shape = total / weight
    pivot = shape[np.argmax(np.abs(shape))]
    freq, freq_sd, freq_p = _weighted(parts, chain, "freq")
    zeta, zeta_sd, zeta_p = _weighted(parts, chain, "zeta")
    omega = 2 * np.pi * freq
    return _Column(
        complex(-zeta * omega, omega * np.sqrt(1 - zeta**2)),
        unit_shapes(shape[:, None])[:, 0],
        freq_sd,
        zeta_sd,
        np.sqrt(variance) / weight / abs(pivot),
        scales,
        macs,
        _disagreement(parts, chain, shared, freq_p, zeta_p, refs * scales, common),
    )


def _weighted(parts: list[_Setup], chain: list[int], label: str) -> tuple[float, float, float]:
    """Mean by inverse variance, its deviation, and the probability of a scatter over the set-ups as large as found."""
    values = np.array([getattr(part.modes, label)[i] for part, i in zip(parts, chain)])
    sd = np.array([getattr(part.modes, f"{label}_sd")[i] for part, i in zip(parts, chain)])
    if np.isnan(sd).any() or (sd <= 0).any():
        return float(values.mean()), float("nan"), 1.0
    w = 1 / sd**2
    mean = float((w * values).sum() / w.sum())
    statistic = float((((values - mean) / sd) ** 2).sum())
    return mean, float(w.sum() ** -0.5), float(chi2.sf(statistic, values.size - 1))


def _disagreement(
    parts: list[_Setup],
    chain: list[int],
    shared: list[tuple[int, int]],
    freq_p: float,
    zeta_p: float,
    scaled: NDArray[np.complex128],
    common: NDArray[np.complex128],
) -> str:
    said = []
    names = [part.name for part in parts]
    for label, p, unit, factor in (("freq", freq_p, "Hz", 1.0), ("zeta", zeta_p, "%", 100.0)):
        if p < SIGNIFICANCE:
            each = [factor * float(getattr(part.modes, label)[i]) for part, i in zip(parts, chain)]
            listed = ", ".join(f"{plain(value)} {unit} in {name!r}" for value, name in zip(each, names))
            word = "frequency" if label == "freq" else "damping"
            said.append(f"the {word} moved more than its uncertainty allows: {listed} (p = {plain(p, 1)})")
    if len(shared) > 1:
        for j, (part, i) in enumerate(zip(parts, chain)):
            sd = np.array([part.sd[part.row[place], i] for place in shared])
            size = np.linalg.norm(scaled[:, j]) / np.linalg.norm([part.shapes[part.row[p], i] for p in shared])
            off = np.abs(scaled[:, j] - common)
            worst = int(np.argmax(off / np.maximum(sd * size, 0.02 * np.abs(common).max())))
            if off[worst] > 4 * max(sd[worst] * size, 0.02 * float(np.abs(common).max())):
                dof = Dof(*shared[worst], 1)
                said.append(
                    f"reference {dof} of set-up {part.name!r} is off by {100 * off[worst] / np.abs(common).max():.0f} "
                    "% of the largest reference component: sensor moved, turned or of another sensitivity?"
                )
    return "; ".join(said)
