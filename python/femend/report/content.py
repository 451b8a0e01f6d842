"""What a report shows, as plain values and arrays.

The diagnosis fills a `ReportContent`; `femend.report.page.render` turns it into a page. Nothing here computes: the page
shows what it is given, and leaves out what is absent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Check",
    "FrfOverlay",
    "LawRow",
    "Marker",
    "MeshPicture",
    "MismatchMap",
    "ParameterRow",
    "Picture",
    "Place",
    "ReportContent",
    "RestoringForce",
    "TimeOverlay",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]


def _no_lines() -> IntArray:
    return np.zeros((0, 2), dtype=np.int64)


def _no_faces() -> IntArray:
    return np.zeros((0, 4), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class MeshPicture:
    """The mesh as it is drawn.

    Attributes:
        node_ids: (n,) ids of the deck.
        xyz: (n, 3) coordinates in the basic system, in `unit`.
        lines: (m, 2) indices into `node_ids`, one row per bar, rod, spring or rigid link.
        faces: (f, 4) indices into `node_ids`; a triangle repeats its last index. Give the outer skin of solids.
        supports: ids of nodes that are held.
        unit: of the coordinates.
    """

    node_ids: IntArray
    xyz: FloatArray
    lines: IntArray = field(default_factory=_no_lines)
    faces: IntArray = field(default_factory=_no_faces)
    supports: tuple[int, ...] = ()
    unit: str = "m"

    def __post_init__(self) -> None:
        n = len(self.node_ids)
        if np.shape(self.xyz) != (n, 3):
            raise ValueError(f"MeshPicture.xyz has shape {np.shape(self.xyz)}; {n} node ids need ({n}, 3)")
        for name, width in (("lines", 2), ("faces", 4)):
            index = np.asarray(getattr(self, name))
            if index.ndim != 2 or index.shape[1] != width:
                raise ValueError(f"MeshPicture.{name} has shape {index.shape}; give (count, {width})")
            if index.size and (index.min() < 0 or index.max() >= n):
                raise ValueError(
                    f"MeshPicture.{name} holds index {int(index.max())}; indices into {n} nodes run from 0 to {n - 1}"
                )


@dataclass(frozen=True, eq=False)
class MismatchMap:
    """What a free force at each of the nodes `nodes` (n,) leaves of the updated model's cost: `share` (n,), 0 to 1."""

    nodes: IntArray
    share: FloatArray


@dataclass(frozen=True)
class Marker:
    """A sensor or a shaker at a node.

    Attributes:
        dof: DOF text, "12:+Z".
        node: id of the node of the model.
        label: what it is called in the recordings.
        distance: from the place in the recording to the node, in the mesh's unit.
        vector: (x, y, z) in the basic system, where the node's own system is turned; None takes it from `dof`.
        beside: (x, y, z) from the node to where it is drawn, in the basic system.
    """

    dof: str
    node: int
    label: str = ""
    distance: float = 0.0
    vector: tuple[float, float, float] | None = None
    beside: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class FrfOverlay:
    """Measured and predicted FRF or spectrum of one sensor, all (n_freq,) complex; `freq` in Hz; None: no curve."""

    freq: FloatArray
    measured: ComplexArray
    nominal: ComplexArray | None = None
    parameters: ComplexArray | None = None
    final: ComplexArray | None = None
    label: str = ""
    recording: str = ""
    unit: str = ""


@dataclass(frozen=True, eq=False)
class TimeOverlay:
    """Measured and predicted time trace of one sensor, all (n_samples,); t in s. Absent curves are None."""

    t: FloatArray
    measured: FloatArray | None = None
    nominal: FloatArray | None = None
    parameters: FloatArray | None = None
    final: FloatArray | None = None
    label: str = ""
    recording: str = ""
    role: str = "fit"
    unit: str = "m/s²"


@dataclass(frozen=True, eq=False)
class RestoringForce:
    """Force the missing term has to carry, recovered from the recordings, over its own displacement and velocity.

    Attributes:
        d, v, f: (n,) recovered relative displacement, velocity and force.
        law_d, law_v, law_f: (m,) the same three as the fitted law gives them; None without a law.
        d_unit, v_unit, f_unit: units of the three.
        recording: where they were recovered from.
    """

    d: FloatArray
    v: FloatArray
    f: FloatArray
    law_d: FloatArray | None = None
    law_v: FloatArray | None = None
    law_f: FloatArray | None = None
    d_unit: str = "m"
    v_unit: str = "m/s"
    f_unit: str = "N"
    recording: str = ""


@dataclass(frozen=True)
class Place:
    """A candidate place with its cost J (lower is better), all with the same number of unknowns.

    `in_set` marks the places the recordings cannot tell from the best one.
    """

    label: str
    cost: float
    nodes: tuple[int, ...] = ()
    direction: str = ""
    in_set: bool = False


@dataclass(frozen=True)
class LawRow:
    """One law at one place that was fitted: misfit on the data it was fitted to and on the data used to choose.

    `chosen` marks the one the verdict names; `remark` says in words why one was not. What was not fitted has no figures
    but a probability.
    """

    physics: str
    place: str
    n_parameters: int | None
    misfit_fit: float | None
    misfit_choose: float | None
    probability: float | None = None
    remark: str = ""
    chosen: bool = False


@dataclass(frozen=True)
class ParameterRow:
    """An updated parameter as a factor of the deck's value, with its relative 1-sigma before and after.

    `z` is how many prior standard deviations it moved.
    """

    name: str
    factor: float
    sd: float
    prior_sd: float | None = None
    z: float | None = None


@dataclass(frozen=True)
class Check:
    """A question the diagnosis asked of the data, its answer and the figure behind it."""

    question: str
    answer: str
    figure: str = ""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture as PNG with its caption."""

    caption: str
    png: bytes


@dataclass(frozen=True, eq=False)
class ReportContent:
    """Everything the page shows.

    Attributes:
        title: of the study.
        result: the content of result.json (format "femend-diagnosis/1").
        mesh: the picture of the mesh; None leaves the picture out.
        located: ids of the nodes of the first finding (two for a pair of nodes).
        ambiguous: ids of further nodes the recordings cannot tell from it.
        direction: direction text of the first finding, "Z".
        further: nodes and direction text of each further finding.
        sensors, shakers: where was measured and driven.
        overlays, traces: curves of frequency and time, in the order they are to be shown.
        restoring: force over displacement and velocity.
        places, laws, parameters, checks: tables; `places` sorted by cost on the page.
        mismatch: the map of the places on the mesh.
        place_threshold: cost difference to the best place up to which places count as not told apart.
        run: content of run.json (`femend.report.runinfo`).
        references: methods used, one citation per entry.
        notes: remarks on reading (cards without influence, paired sensors, ...).
        pictures: further pictures with their captions.
    """

    title: str
    result: Mapping[str, Any]
    mesh: MeshPicture | None = None
    located: tuple[int, ...] = ()
    ambiguous: tuple[int, ...] = ()
    direction: str = ""
    further: tuple[tuple[tuple[int, ...], str], ...] = ()
    sensors: tuple[Marker, ...] = ()
    shakers: tuple[Marker, ...] = ()
    overlays: tuple[FrfOverlay, ...] = ()
    traces: tuple[TimeOverlay, ...] = ()
    restoring: RestoringForce | None = None
    places: tuple[Place, ...] = ()
    place_threshold: float | None = None
    mismatch: MismatchMap | None = None
    laws: tuple[LawRow, ...] = ()
    parameters: tuple[ParameterRow, ...] = ()
    checks: tuple[Check, ...] = ()
    run: Mapping[str, Any] = field(default_factory=dict)
    references: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
