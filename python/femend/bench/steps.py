"""What the commands on a study have in common: reading it, timing the steps, writing what came out."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from femend.model import Model
from femend.model.sensor_point import SensorPoint
from femend.progress import Progress
from femend.report.content import Marker, ReportContent
from femend.report.mesh_view import static_picture, viewer_data
from femend.report.runinfo import RunInfo
from femend.study.shown.picture import mesh_picture

__all__ = ["Steps", "drawn_model", "finite", "marker", "write_csv", "write_json"]


class Steps:
    """Times the steps of a command and tells its progress."""

    def __init__(self, study: Path, progress: Progress) -> None:
        self.info = RunInfo(study=study.name)
        self.progress = progress

    @contextmanager
    def step(self, name: str, total: int | None = None) -> Iterator[None]:
        """The step `name`, told and timed, with `total` pieces of work where that is known."""
        self.progress.start(name, total)
        with self.info.step(name):
            yield


def finite(value: Any) -> Any:
    """`value` for JSON: numbers that are none become None, in lists and tables too."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [finite(v) for v in value]
    if hasattr(value, "tolist"):
        return finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_json(path: Path, content: dict[str, Any]) -> None:
    """`content` at `path`, readable."""
    path.write_text(json.dumps(finite(content), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_csv(path: Path, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """A table at `path`, one header line, commas, points in numbers; what is not a number is empty."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow(["" if finite(v) is None else v for v in row])


def marker(dof: Any, model: Model, label: str = "", point: SensorPoint | None = None) -> Marker:
    """A sensor or shaker at a DOF of the `model`, as the mesh is drawn with, called `label`; at a `point` between
    nodes beside its nearest node."""
    axis = model.frames[model.index(dof.node)][(dof.component - 1) % 3] * dof.sign
    x, y, z = (float(v) for v in axis)
    if point is None:
        return Marker(str(dof), dof.node, label, 0.0, (x, y, z))
    dx, dy, dz = (float(v) for v in point.xyz - model.xyz_of[dof.node])
    return Marker(str(dof), dof.node, label, point.distance, (x, y, z), (dx, dy, dz))


def drawn_model(model: Model, sensors: Sequence[Marker], shakers: Sequence[Marker] = ()) -> str:
    """The mesh with arrows at `sensors` and `shakers`, as SVG."""
    content = ReportContent(
        title="", result={}, mesh=mesh_picture(model), sensors=tuple(sensors), shakers=tuple(shakers)
    )
    data = viewer_data(content)
    return "" if data is None else static_picture(data)
