"""Where sensors and exciters may go in a planned test: places, their shapes, and the modes that are aimed at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.analysis.effective_mass import base_directions, effective_mass
from femend.analysis.frf import shapes_at
from femend.analysis.model_modes import model_modes
from femend.bench.reading.models import RIGID
from femend.data import ModeSet
from femend.data.bands import within_band
from femend.dof import Dof
from femend.errors import PairingError, PretestError
from femend.model import Model
from femend.numerals import plain
from femend.pretest import TargetModes, target_modes
from femend.study.file.bench_settings import PretestSettings

__all__ = ["Targets", "found_places", "found_targets"]

FloatArray = NDArray[np.float64]

# target modes where the study names none
FIRST = 8
# modes that a free body has
RIGID_MODES = 6
# modes that are solved beside the targets, since their skirts are in every FRF
ABOVE = 1.5
# more places than MOST are thinned out to KEPT that are spread over the structure before anything is chosen
MOST, KEPT = 3000, 600
# a mode that moves at all places less than this share of its largest motion is seen by no sensor
UNSEEN = 1e-6
# below this share of its largest motion in the target modes a place stands still
STILL = 1e-9


@dataclass(frozen=True, eq=False)
class Targets:
    """All `modes` of the model that were solved, the numbers `at` (n_targets,) of those aimed at, from 0, how many
    `rigid` ones of a free body come first, and the `table` of effective masses."""

    modes: ModeSet
    at: NDArray[np.int64]
    rigid: int
    table: TargetModes

    @property
    def freq(self) -> FloatArray:
        """Frequencies of the targets (n_targets,) in Hz."""
        return self.modes.freq[self.at]

    def shapes(self, dofs: Sequence[Dof]) -> FloatArray:
        """Shapes of the targets (n_dofs, n_targets) at DOFs in their signed directions."""
        return np.ascontiguousarray(shapes_at(self.modes, dofs)[:, self.at])


def found_targets(model: Model, settings: PretestSettings, zeta: float) -> Targets:
    """The modes that the planned test has to find: those of a band, by number, or the first eight elastic ones.

    Modes are numbered from 1 without those of a free body. Raises PretestError for a band without a mode and a number
    that the model does not have.
    """
    if settings.band is not None:
        modes = model_modes(model, f_max=ABOVE * settings.band[1], zeta=zeta)
    else:
        # the modes above the last target are in the FRFs too
        wanted = FIRST if settings.modes is None else max(settings.modes)
        modes = model_modes(model, n_modes=2 * wanted + RIGID_MODES, zeta=zeta)
    rigid = int((modes.freq < RIGID * modes.freq.max(initial=0.0)).sum()) if modes.n_modes else 0
    n = modes.n_modes - rigid
    if settings.band is not None:
        low, high = settings.band
        at = np.flatnonzero(within_band(modes.freq, (max(low, 1e-9), high)) & (np.arange(modes.n_modes) >= rigid))
        if not at.size:
            first = (
                f"the first elastic one is at {plain(modes.freq[rigid])} Hz"
                if n
                else "it has none below: raise the end of the band"
            )
            raise PretestError(f"[pretest] band: the model has no mode from {low:g} to {high:g} Hz; {first}")
    else:
        numbers = tuple(range(1, min(FIRST, n) + 1)) if settings.modes is None else settings.modes
        if not numbers or numbers[-1] > n:
            wanted = numbers[-1] if numbers else 1
            raise PretestError(f"[pretest] modes: mode {wanted} is wanted, the model has {n} elastic modes")
        at = np.array(numbers, dtype=np.int64) - 1 + rigid
    return Targets(modes, at, rigid, _table(model, modes))


def _table(model: Model, modes: ModeSet) -> TargetModes:
    """Effective masses of all modes."""
    from scipy.sparse import csc_array

    _, M = model.matrices()
    fe = model.fe
    R = base_directions(fe.dof_nodes, fe.dof_components, fe.node_ids, model.frames)
    rows = [Dof(int(n), int(c)) for n, c in zip(fe.dof_nodes, fe.dof_components, strict=True)]
    known = {(d.node, d.component): i for i, d in enumerate(modes.dofs)}
    index = np.array([known.get((d.node, d.component), -1) for d in rows])
    phi = np.where((index >= 0)[:, None], modes.phi[np.maximum(index, 0)], 0.0)
    return target_modes(modes.freq, effective_mass(np.asarray(csc_array(M) @ phi), R), fe.total_mass())


def _seen(targets: Targets, dofs: Sequence[Dof]) -> None:
    """Raises PretestError for target modes that move at none of the places: no choice among them tells these."""
    share = np.abs(targets.shapes(dofs)).max(axis=0) / np.abs(targets.modes.phi[:, targets.at]).max(axis=0)
    unseen = np.flatnonzero(share < UNSEEN)
    if not unseen.size:
        return
    said = ", ".join(f"{int(targets.at[i]) - targets.rigid + 1} at {plain(targets.freq[i])} Hz" for i in unseen[:6])
    ways = ", ".join(sorted({str(d.unsigned).split(":+")[1] for d in dofs}))
    rest = [str(int(t) - targets.rigid + 1) for i, t in enumerate(targets.at) if i not in unseen]
    raise PretestError(
        f"[pretest]: no sensor can see target mode{'s' * (unseen.size > 1)} {said}: nothing moves there at the "
        f"{len(dofs)} allowed places (directions {ways}); allow other directions or nodes, or leave the modes out "
        f"(modes = [{', '.join(rest)}] in place of a band)"
    )


def found_places(
    model: Model, targets: Targets, settings: PretestSettings, *, exciting: bool = False
) -> tuple[tuple[Dof, ...], tuple[str, ...]]:
    """DOFs where a sensor may go, or an exciter (`exciting`), those already placed among them, and what was left out.

    Raises PretestError for a node that the model does not have and where no allowed place moves in the target modes.
    """
    given = settings.exciter_nodes if exciting and settings.exciter_nodes is not None else settings.nodes
    directions = settings.directions
    if exciting and settings.exciter_directions is not None:
        directions = settings.exciter_directions
    grid = model.node_ids[~model.is_scalar].tolist()
    key = "exciter_nodes" if exciting and settings.exciter_nodes is not None else "nodes"
    _known(model, given or (), key)
    _known(model, settings.leave_out, "leave_out")
    out = set(settings.leave_out)
    dofs = [Dof(int(n), c) for n in (grid if given is None else given) if n not in out for c in directions]
    placed = () if exciting else settings.placed
    _known(model, [d.node for d in placed], "placed")
    taken = {d.unsigned for d in placed}
    dofs = [*placed, *(d for d in dofs if d not in taken)]
    phi = targets.shapes(dofs)
    moves = np.abs(phi).max(axis=1) > STILL * np.abs(targets.modes.phi).max()
    still = [d for d, m in zip(dofs, moves, strict=True) if not m]
    held = [d for d in placed if d in still]
    if held:
        raise PretestError(f"[pretest] placed: {held[0]} stands still in all target modes; correct it, or leave it out")
    dofs = [d for d, m in zip(dofs, moves, strict=True) if m]
    if not dofs:
        raise PretestError(f"[pretest] {key}: none of the {len(still)} allowed places moves in the target modes")
    if not exciting:
        _seen(targets, dofs)
    n_nodes = KEPT // len(directions) if len(dofs) > MOST else None
    spacing = 0.0 if exciting else settings.spacing
    if n_nodes is None and spacing == 0:
        return tuple(dofs), ()
    nodes = list(dict.fromkeys(d.node for d in dofs))
    kept = _spread(model, nodes, [d.node for d in placed], n_nodes, spacing)
    few = [d for d in dofs if d.node in kept or d in placed]
    if len(few) == len(dofs):
        return tuple(dofs), ()
    why = "spread over the structure; name [pretest] nodes for others" if n_nodes else f"{spacing:g} apart"
    return tuple(few), (f"{len(dofs)} places are thinned out to {len(few)}, {why}",)


def _spread(model: Model, nodes: Sequence[int], placed: Sequence[int], most: int | None, spacing: float) -> set[int]:
    """Nodes that are far from each other: again and again the one that is furthest from those before, from the `placed`
    ones on, until `most` are taken or none is further than `spacing` (farthest points, Gonzalez 1985)."""
    xyz = np.array([model.xyz[model.index(n)] for n in nodes])
    corner = int(np.argmax(np.linalg.norm(xyz - xyz.mean(axis=0), axis=1)))
    chosen = [nodes.index(n) for n in dict.fromkeys(placed)] or [corner]
    distance = np.min([np.linalg.norm(xyz - xyz[k], axis=1) for k in chosen], axis=0)
    while most is None or len(chosen) < most:
        k = int(np.argmax(distance))
        if distance[k] == 0 or distance[k] < spacing * (1 - 1e-9):
            break
        chosen.append(k)
        distance = np.minimum(distance, np.linalg.norm(xyz - xyz[k], axis=1))
    return {nodes[k] for k in chosen}


def _known(model: Model, nodes: Sequence[int], key: str) -> None:
    for node in nodes:
        try:
            model.row(Dof(int(node), 1))
        except PairingError as error:
            raise PretestError(f"[pretest] {key}: {error}") from None
