"""`femend pretest`: a test planned on the model of a study."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.bench.page import render_page
from femend.bench.planning.explanations import told_apart
from femend.bench.planning.places import Targets, found_places, found_targets
from femend.bench.planning.pretest_content import pretest_page, write_tables
from femend.bench.planning.pretest_result import pretest_result
from femend.bench.planning.pretest_run import Plan, PretestRun
from femend.bench.planning.rehearsal import rehearse
from femend.bench.reading.models import Models
from femend.bench.steps import Steps, write_json
from femend.dof import Dof
from femend.errors import FemendError, PretestError, UpdatingError
from femend.estimate.updating import deck_system, unknowns_of
from femend.io import OutputDirectory, refuse_unwritable
from femend.model import Model
from femend.pretest import (
    MassLoading,
    Placement,
    PlannedTest,
    driving_point_residues,
    effective_independence,
    exciters,
    iterative_guyan,
    mac_elimination,
    mass_loading,
    parameter_sensors,
    planned_test,
    qr_placement,
)
from femend.progress import Progress, SilentProgress
from femend.study.doubts.added_masses import added_mass_doubts, planned_mass_doubts
from femend.study.doubts.sound import deck_warnings
from femend.study.file.load import load_study
from femend.study.file.study import AS_MODELLED, Study
from femend.threads import one_blas_thread

__all__ = ["pretest"]

FloatArray = NDArray[np.float64]

# what the command writes: entries of these names from an earlier run are replaced
OWNED = ("pretest.json", "pretest.html", "pretest.run.json", "pretest.*.csv")


@one_blas_thread
def pretest(study: str | Path, out: str | Path | None = None, progress: Progress | None = None) -> PretestRun:
    """Plans a test on the model of `study` as its table [pretest] says; recordings are not needed.

    With a folder `out` everything is written there: pretest.json, pretest.html, tables of sensors, exciters and target
    modes as CSV, pretest.run.json. Raises StudyError, DeckError and ModelError as the readers do, and PretestError for
    a test that cannot be planned; nothing is written then.
    """
    if out is not None:
        refuse_unwritable(out, owned=OWNED)
    steps = Steps(Path(study), progress or SilentProgress())
    with steps.step("read the study and the deck"):
        content = load_study(Path(study), recordings=False)
        model, still = _model(content)
    with steps.step("solve the modes"):
        targets = found_targets(model, content.pretest, content.damping_ratio)
    with steps.step("choose sensors and exciters"):
        try:
            plan, told = _plan(content, model, targets)
        except UpdatingError as error:
            if not model.morphs:
                raise
            # a place that a sensor may take hangs on a rigid element at a node that moves
            left = ", ".join(m.name for m in model.morphs)
            model = still
            plan, told = _plan(content, model, targets)
            told = (*told, f"the plan leaves {left} of [[updating.morph]] where the deck has them: {error}")
    masses = (*added_mass_doubts(content, model), *planned_mass_doubts(content, model))
    told = (*deck_warnings(content, model.deck), *masses, *told, *_of_update_alone(content))
    virtual, note = None, "not asked for"
    if content.pretest.virtual_test:
        with steps.step("rehearse the test"):
            virtual, note = rehearse(content, model, targets, plan.sensors, plan.exciters)
    result = pretest_result(content, model, plan, virtual, note, told)
    run = PretestRun(content, model, plan, virtual, result)
    if out is not None:
        with steps.step("write"), OutputDirectory(out, owned=OWNED) as folder:
            write_json(folder / "pretest.json", result)
            names = ("pretest.json", *write_tables(folder, run))
            page = pretest_page(run, steps.info.as_dict(), names)
            (folder / "pretest.html").write_text(render_page(page), encoding="utf-8")
            steps.info.write(folder / "pretest.run.json")
    steps.progress.done()
    return run


def _model(study: Study) -> tuple[Model, Model]:
    """The model in the configuration of the plan, with the positions that an update may move, and without them."""
    name = study.pretest.configuration or AS_MODELLED
    still = Models(study).of(name)
    return (Models(study, morphs=True).of(name) if study.updating.morph else still), still


def _of_update_alone(study: Study) -> list[str]:
    """That the plan is made without fields and links, where the study has any."""
    tables = {"[[updating.field]]": study.updating.field, "[[updating.link]]": study.updating.link}
    names = " and ".join(name for name, given in tables.items() if given)
    return [f"the plan leaves {names} out: it is made for each [[parameter]] by itself"] if names else []


def _plan(study: Study, model: Model, targets: Targets) -> tuple[Plan, tuple[str, ...]]:
    s = study.pretest
    places, told = found_places(model, targets, s)
    if len(places) < s.sensors:
        raise PretestError(
            f"[pretest] sensors = {s.sensors} are wanted, and there are {len(places)} places for them"
            f"{''.join(f' ({why})' for why in told)}: take fewer, or allow more nodes, directions or less spacing"
        )
    phi = targets.shapes(places)
    planned = None
    if model.parameters or model.morphs:
        system = deck_system(model, places, targets.modes.n_modes)
        planned = planned_test(
            system, unknowns_of(model), modes=targets.at.tolist(), freq_sd=s.freq_sd, shape_sd=s.shape_sd
        )
    # sensors that tell parameters may not tell modes apart; who wants them says so
    few = s.sensors < targets.at.size
    method = s.method or ("QR" if few else "effective independence")
    if s.method is None and few:
        told += (
            f"[pretest] sensors = {s.sensors} are fewer than the {targets.at.size} target modes, which they cannot "
            "tell apart, and effective independence, the method without another one, does not work: they are placed by "
            f"QR; take {targets.at.size} sensors or more, or fewer target modes ([pretest] band or modes)",
        )

    def placed_by(way: str) -> Placement:
        return _placed(way, model, places, phi, planned, s.sensors, len(s.placed))

    placement, others = placed_by(method), _others(placed_by, method, planned is not None)
    drives, more = found_places(model, targets, s, exciting=True)
    at_drives = targets.shapes(drives)
    omega = 2 * np.pi * targets.freq
    driven = exciters(at_drives, omega, s.exciters, zeta=study.damping_ratio, kind="accelerance")
    residues = driving_point_residues(at_drives, omega, kind="accelerance")
    residues = residues / np.maximum(residues.max(axis=0), 1e-300)
    loading = _loading(targets, placement.dofs(places), s.sensor_mass)
    explained = told_apart(model, s, targets, places, placement.rows.tolist(), zeta=study.damping_ratio)
    plan = Plan(targets, places, placement, others, planned, drives, driven, residues, loading, explained)
    return plan, tuple(dict.fromkeys([*told, *more]))


def _placed(
    method: str,
    model: Model,
    places: Sequence[Dof],
    phi: FloatArray,
    planned: PlannedTest | None,
    n: int,
    n_placed: int,
) -> Placement:
    """`n` of the places by a method, the first `n_placed` of them being there already."""
    kept = list(range(n_placed))
    if method == "parameters":
        if planned is None:
            raise PretestError(
                '[pretest] method = "parameters", but the study has no [[parameter]]; add them or take another method'
            )
        return parameter_sensors(planned, n, placed=kept)
    if method == "QR":
        return qr_placement(phi, n, placed=kept)
    if method == "MAC":
        return mac_elimination(phi, n, placed=kept)
    if method == "Guyan":
        return _guyan(model, places, n, kept)
    return effective_independence(phi, n, placed=kept)


def _guyan(model: Model, places: Sequence[Dof], n: int, kept: Sequence[int]) -> Placement:
    """Iterative Guyan reduction on the model's own DOFs, told in rows of the places."""
    row = {
        (int(a), int(c)): i for i, (a, c) in enumerate(zip(model.fe.dof_nodes, model.fe.dof_components, strict=True))
    }
    at = [row.get((d.node, d.component), -1) for d in places]
    tied = [d for d, r in zip(places, at, strict=True) if r < 0]
    free = {r: i for i, r in enumerate(at) if r >= 0}
    if any(at[i] < 0 for i in kept):
        raise PretestError(
            f'[pretest] method = "Guyan": the placed {tied[0]} hangs on a rigid element; take another method'
        )
    K, M = model.matrices()
    found = iterative_guyan(K, M, n, allowed=sorted(free), placed=[at[i] for i in kept])
    rows = np.array(sorted(free[int(r)] for r in found.rows), dtype=np.int64)
    return Placement(found.method, rows, np.array(list(kept), dtype=np.int64), found.score, found.measure)


def _others(placed_by: Callable[[str], Placement], method: str, telling: bool) -> dict[str, Placement]:
    """What methods other than `method` choose, as far as they apply, for comparison; `telling` says that there are
    parameters to be told."""
    found = {}
    for other in ("parameters", "effective independence", "QR", "MAC"):
        if other == method or (other == "parameters" and not telling):
            continue
        try:
            found[other] = placed_by(other)
        except FemendError:
            continue  # too few sensors for this one, or a single mode
    return found


def _loading(targets: Targets, sensors: Sequence[Dof], mass: float) -> MassLoading | None:
    if mass == 0:
        return None
    known = {(d.node, d.component) for d in targets.modes.dofs}
    nodes = dict.fromkeys(d.node for d in sensors)
    rows = [Dof(n, c) for n in nodes for c in (1, 2, 3) if (n, c) in known]
    # as many bodies as sensors stand at a node
    count = {n: sum(d.node == n for d in sensors) for n in nodes}
    index = {(d.node, d.component): i for i, d in enumerate(targets.modes.dofs)}
    at = [index[d.node, d.component] for d in rows]
    return mass_loading(targets.modes.phi, targets.modes.freq, at, [mass * count[d.node] for d in rows])
