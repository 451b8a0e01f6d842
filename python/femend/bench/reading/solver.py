"""The user's own solver in the place of the deck's model: its runs as a system, its modes, its input files back."""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import ModeSet
from femend.dof import Dof
from femend.errors import StudyError
from femend.estimate.updating import Command, ExternalSystem, Unknowns, UpdatedDeck, factor
from femend.estimate.updating.command import fill
from femend.io.solver_results import read_solver_modes
from femend.model import Model
from femend.study.file.study import AS_MODELLED, Study

__all__ = ["Solver", "solver_of"]

# below this share of the highest measured frequency a mode is one of a free body
RIGID = 1e-4
# responses that its runs give
GIVES = ("frequencies", "shapes", "mac")


class Solver:
    """The solver that a `study` names: the `system` that its runs are, in the place of the deck's model.

    Rows of shapes are those of `sensors`, the measured DOFs, at their `places` of the model, in the directions of the
    solver's results.
    """

    def __init__(self, study: Study, places: Mapping[Dof, Dof]) -> None:
        assert study.solver is not None
        self.study, self.settings = study, study.solver
        self.sensors = tuple(places)
        self.places = tuple(places[d] for d in self.sensors)

    @cached_property
    def texts(self) -> dict[str, str]:
        """The input files by name; raises StudyError for one that is no text, a value without a field and a field
        without a value."""
        found = {}
        for path in self.settings.files:
            try:
                found[path.name] = path.read_text(encoding="utf-8")
            except UnicodeDecodeError as error:
                raise StudyError(
                    f"{self.study.file}: solver.files: {path} is not UTF-8 text (byte {error.start}); fields stand in "
                    "text files alone",
                    key="solver.files",
                ) from None
        return found

    @cached_property
    def system(self) -> ExternalSystem:
        """The runs; those made once are kept in the folder of the study's settings."""
        s = self.settings
        read = s.result, s.format, [str(d) for d in self.places]
        scripts = [hashlib.sha256(path.read_bytes()).hexdigest() for path in s.scripts]
        command = Command(
            s.arguments, self.texts, self._read, time_limit=s.time_limit, depends_on=repr((read, scripts))
        )
        self._complete(command)
        values = {v.name: v.value for v in s.values}
        return ExternalSystem(command, values, self.study.file.parent / s.folder, step=s.step, workers=s.parallel)

    def _complete(self, command: Command) -> None:
        names = [v.name for v in self.settings.values]
        files = ", ".join(self.texts)
        for name in names:
            if name not in command.fields:
                there = ", ".join(f"{{{{{f}}}}}" for f in command.fields) or "none"
                raise StudyError(
                    f"{self.study.file}: solver.value: {name!r} has no field {{{{{name}}}}} in {files} (there: "
                    f"{there}); put it where the value stands",
                    key="solver.value",
                )
        for name in command.fields:
            if name not in names:
                raise StudyError(
                    f"{self.study.file}: solver.files: {files} has a field {{{{{name}}}}}, and no [[solver.value]] is "
                    "called so; give its value",
                    key="solver.value",
                )

    def _read(self, folder: Path) -> dict[str, NDArray[np.float64]]:
        freq, phi = read_solver_modes(folder / self.settings.result, self.settings.format, self.places)
        return {"freq": freq, "phi": phi}

    @property
    def warnings(self) -> list[str]:
        """That parameters of the deck have no part, where there are any."""
        names = ", ".join(p.name for p in self.study.parameters)
        said = f"{names}: a [[parameter]] of the deck has no part beside [solver], which has its own values"
        return [said] if names else []

    def as_dict(self) -> dict[str, Any]:
        """What updating.json holds of it."""
        s = self.settings
        return {
            "command": list(s.arguments),
            "files": [path.name for path in s.files],
            "result": s.result,
            "values": {v.name: v.value for v in s.values},
            "runs": self.system.n_runs,
            "failed": self.system.n_failed,
            "folder": s.folder,
        }

    @property
    def unknowns(self) -> Unknowns:
        """A factor for each value of the input files."""
        return Unknowns.of([factor(v.name, v.prior_sd, v.bounds) for v in self.settings.values])

    def modes(self, factors: Mapping[str, float] | None, zeta: float, f_max: float) -> ModeSet:
        """Elastic modes at `factors` of the values by name (1 where not given), with damping ratio `zeta`; `f_max` Hz
        tells them from those of a free body. Raises ExternalSolverError as `ExternalSystem.solve`."""
        given = dict(factors or {})
        state = self.system.solve(np.array([given.get(n, 1.0) for n in self.system.names]))
        freq, phi = state.value("freq"), state.value("phi")
        rows = {d.unsigned: d.sign * phi[i] for i, d in enumerate(self.places)}
        keep = freq > RIGID * f_max
        shapes = np.array(list(rows.values()))[:, keep]
        return ModeSet(freq[keep], np.full(int(keep.sum()), zeta), shapes, tuple(rows), "unscaled")

    def written(self, factors: Mapping[str, float]) -> UpdatedDeck:
        """The input files at `factors` of the values, and what differs from them as they are."""
        now = {v.name: v.value for v in self.settings.values}
        new = {n: x * factors.get(n, 1.0) for n, x in now.items()}
        files, diff = {}, list[str]()
        for path in self.settings.files:
            text = self.texts[path.name]
            before, after = fill(text, now), fill(text, new)
            files[path] = after.encode("utf-8")
            diff += difflib.unified_diff(
                before.splitlines(keepends=True),
                after.splitlines(keepends=True),
                path.name,
                f"{path.name} (updated)",
                n=1,
            )
        return UpdatedDeck(files, "".join(diff), ())


def solver_of(
    study: Study, places: Mapping[Dof, Dof], model: Model, dofs: Iterable[Dof], *, updating: bool
) -> Solver | None:
    """The solver of a study with measured `dofs`, whose `places` are in `model`; None where it names none. Raises
    StudyError for a sensor between nodes, of which a solver writes nothing, recordings in other configurations, and
    where it is for `updating` for what its runs do not give."""
    if study.solver is None:
        return None
    _fits(study, updating)
    nodes = set(model.node_ids.tolist())
    used = {d: places[d] for d in dict.fromkeys(dofs)}
    between = next((d for d, place in used.items() if place.node not in nodes), None)
    if between is not None:
        raise StudyError(
            f"{study.file}: solver: sensor {between} lies between nodes, where the solver writes nothing; give it the "
            "number of a node, or the deck a node there",
            key="solver",
        )
    return Solver(study, used)


def _fits(study: Study, updating: bool) -> None:
    """Refuses what no solver of the user's own is asked for."""

    def fail(key: str, fact: str) -> StudyError:
        return StudyError(f"{study.file}: {key}: {fact}", key=key)

    other = next((r for r in study.recordings if r.role != "predict" and r.configuration != AS_MODELLED), None)
    if other is not None:
        raise fail(
            "solver",
            f"computes one structure, and recording {other.name!r} is of configuration {other.configuration!r}; take "
            "that into a study of its own, with its own input files",
        )
    if not updating:
        return
    for name in study.updating.responses:
        if name not in GIVES:
            raise fail(
                "updating.responses",
                f"[solver] gives frequencies and shapes, not {name!r}; leave out the one or the other",
            )
    for key in ("morph", "field", "link"):
        if getattr(study.updating, key):
            raise fail(
                f"updating.{key}",
                "acts on the deck, and [solver] has values of its own; leave out the one or the other",
            )
