"""Running a study of several configurations or of operating recordings: stage after stage."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.data import Test
from femend.diagnose.staged import (
    ConfigurationSpec,
    Setup,
    StagedData,
    run_stages,
    runs_at_their_nodes,
    setup_of,
    staged_data,
)
from femend.dof import Dof
from femend.errors import RecordingError, StudyError
from femend.estimate import pair_test
from femend.io import OutputDirectory
from femend.io.deck import patch_deck, read_deck
from femend.io.updated_files import updated_files
from femend.model import Model, Pairing
from femend.model.model import model_of
from femend.model.terms.configured import free_model
from femend.model.terms.rotors import deck_rotors
from femend.progress import Progress, say
from femend.report.page import render
from femend.report.runinfo import RunInfo
from femend.study.doubts.corrections import Correction, Corrections, corrections_of, left_out_unseen
from femend.study.doubts.mended import mended, without
from femend.study.doubts.plausible import doubts_found
from femend.study.doubts.rotor_doubts import SHAFT
from femend.study.doubts.sound import deck_warnings, warnings_of
from femend.study.file.study import Study
from femend.study.result.deck_told import deck_told
from femend.study.result.predictions import write_predictions
from femend.study.staged.content import staged_content
from femend.study.staged.doubts import not_held_out, taken_back, without_use
from femend.study.staged.patch import staged_cards, staged_changes, staged_factors, staged_told
from femend.study.staged.predictions import predict_staged
from femend.study.staged.result import staged_result
from femend.study.staged.study_run import StagedRun
from femend.study.steps import Steps
from femend.threads import one_blas_thread

__all__ = ["diagnose_staged", "is_staged"]

FloatArray = NDArray[np.float64]
# damped motion of the updated model without additions need not be followed to the last digit
PLAIN_STEPS = 5


def is_staged(study: Study) -> bool:
    """Does the study need stages: fit recordings without measured force, or in more than one configuration?"""
    fit = [r for r in study.recordings if r.role == "fit"]
    return any(r.excitation != "measured" for r in fit) or len({r.configuration for r in fit}) > 1


@one_blas_thread
def diagnose_staged(
    study: Study, steps: Steps, info: RunInfo, progress: Progress, out: Path | None, told: Sequence[str] = ()
) -> StagedRun:
    """Runs a study stage by stage and writes what the contract asks for, `told` among the warnings; raises what the
    readers raise."""
    with steps.step("read the deck and the recordings"):
        free = free_model(read_deck(study.model_file), units=study.units, parameters=study.parameters)
        test = study.read_recordings()
        pairing = pair_test(test, free)
        whole = test
        doubts, right = _doubts(study, test, free, pairing)
        test = right.test
    doubts = [*pairing.warnings, *doubts]
    for text in (*deck_warnings(study, free.deck), *doubts):
        say(progress, text)
    with steps.step("identify modes and prepare runs"):
        data = staged_data(test)
        setup = _setup(study, test, free, pairing, data)
    with steps.step("diagnose"):
        plain = final = run_stages(setup, data, naming=not right.whole, tell=progress.start)
        data = runs_at_their_nodes(data, final)
        if final.named or any(r.other_law for _, r in final.runs):
            plain = run_stages(setup, data, naming=False, iterations=PLAIN_STEPS, tell=progress.start)
        progress.done()
    with steps.step("predict"):
        predictions = predict_staged(setup, test, data, final, plain)
        unproved = without_use(test, predictions, final)
        if unproved:
            final = plain = taken_back(final, plain, unproved)
            predictions = predict_staged(setup, test, data, final, plain)
        else:
            final = replace(final, beside=not_held_out(test, predictions, final))
        warnings = [*warnings_of(study, free.deck, whole), *doubts, *told]
        result = right.told_in(staged_result(setup, data, final, predictions, warnings))
    run = StagedRun(study, free, test, pairing, setup, data, final, plain, predictions, result)
    if out is not None:
        _write(run, out, info)
    return run


def _doubts(study: Study, test: Test, free: Model, pairing: Pairing) -> tuple[list[str], Corrections]:
    """What recordings contradict in the deck as it stands, held and loaded as in their configuration, and what is
    corrected or left out for it."""
    told: list[str] = []
    single: list[Correction] = []
    whole: list[Correction] = []
    for name in dict.fromkeys(r.configuration for r in test if r.role == "fit"):
        own = study.configuration(name)
        model = model_of(
            free.deck, units=free.units, parameters=free.parameters, spc=own.spc, added_mass=own.added_mass
        )
        of_it = Test(tuple(r for r in test if r.configuration == name))
        found = doubts_found(model, of_it, pairing, study.damping_ratio)
        told += found.texts
        if all(r.excitation == "measured" for r in of_it if r.role == "fit"):
            single += corrections_of(model, pairing, study.damping_ratio, of_it, found.of_recordings).single
        else:
            of_shapes = left_out_unseen(of_it, found.of_recordings)
            single, whole = [*single, *of_shapes.single], [*whole, *of_shapes.whole]
    names = [name for one in single for name in one.sensors]
    right = mended(without(test, names), [one.doubted for one in whole])
    return list(dict.fromkeys(told)), Corrections(right, tuple(single), tuple(whole))


def _setup(study: Study, test: Test, free: Model, pairing: Pairing, data: StagedData) -> Setup:
    names = data.configurations
    if not names:
        fit = [r for r in study.recordings if r.role == "fit"]
        if not fit:
            fact = 'no recording has role = "fit"; at least one is needed to estimate anything'
            raise StudyError(fact, key="recording")
        if data.left_out:
            raise RecordingError(f"nothing to fit is left: {'; '.join(data.left_out)}", recording=fit[0].name)
        said = f'recording {fit[0].name!r} has excitation = "{fit[0].excitation}"'
        raise RecordingError(
            f"{said} and no mode could be identified in it, so that nothing can be estimated; record longer, or give "
            "it another role and add a recording with its force",
            recording=fit[0].name,
        )
    used = dict.fromkeys([*names, *(r.configuration for r in test)])
    specs = [ConfigurationSpec(n, study.configuration(n).spc, study.configuration(n).added_mass) for n in used]
    rows = [free.row(pairing[c.dof].dof) for r in test for c in r.inputs if c.dof is not None]
    rows += [free.row(Dof(n, c)) for r in test if r.rotating is not None for n in r.rotating.nodes for c in (1, 2, 3)]
    frfs = [f for group in data.frfs.values() for f in group]
    runs = [r for group in data.runs.values() for r in group]
    modes = [m for group in data.output_only.values() for m in group]
    ends = [*(float(f.freq[-1]) for f in frfs), *(r.f_max for r in runs), *(float(m.modes.freq.max()) for m in modes)]
    starts = [*(float(f.freq[0]) for f in frfs), *(float(r.rev_per_s.min()) for r in runs)]
    starts += [float(m.modes.freq.min()) for m in modes]
    band = (max(min(starts), 1e-3 * max(ends)), max(ends))
    axis = next((r.rotating.axis for r in study.recordings if r.rotating is not None), None)
    spinning = () if axis is None else deck_rotors(free.deck).parts(SHAFT[axis])
    return setup_of(free, specs, pairing, band=band, zeta=study.damping_ratio, g_rows=rows, spinning=spinning)


def _write(run: StagedRun, out: Path, info: RunInfo) -> None:
    patched = patch_deck(run.model.deck, staged_changes(run.setup, run.final), staged_cards(run.setup, run.final))
    told = deck_told(run.model, staged_factors(run.setup, run.final), patched)
    run.result["warnings"] = [*run.result["warnings"], *told, *staged_told(run.setup, run.final)]
    # before anything is written, since pictures that cannot be drawn are told among the warnings
    content = staged_content(run, info.as_dict())
    with OutputDirectory(out) as folder:
        (folder / "result.json").write_text(json.dumps(run.result, indent=2) + "\n", encoding="utf-8")
        write_predictions(folder, run.predictions)
        for name, text in updated_files(Path(run.model.deck.path), patched).items():
            (folder / name).write_bytes(text)
        info.write(folder / "run.json")
        (folder / "report.html").write_text(render(content), encoding="utf-8")
