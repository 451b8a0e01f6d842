#!/usr/bin/env python3
"""How far the model moves with the level of the recordings:  level_drift.py CASES [--only b0003,b0007]

For every case what a slope of the model's unknowns over the logarithm of the level is worth, in units of what noise
does (one is expected of a linear structure), what is allowed beside the misfit of the updated model, and whether that
counts as something that is not linear (femend/diagnose/updating/with_level.py). The truth is read to be printed beside
it.
"""

from __future__ import annotations

import argparse
import json
import pathlib

from scipy.stats import chi2

from femend.diagnose.driven.unrecorded import locate_drive
from femend.diagnose.updating.each_alone import fitted_one_by_one
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.diagnose.updating.with_level import ALIKE, RARE, drift, drifted
from femend.estimate import fit_records, pair_test
from femend.model import read_model
from femend.study import load_study


def updated(study_file: pathlib.Path) -> UpdatedModel:
    """The model of a study updated on its fit recordings, with the drive located where no force was recorded."""
    study = load_study(study_file)
    model, test = read_model(study.model_file, units=study.units, parameters=study.parameters), study.read_recordings()
    records = fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))
    if any(r.driven for r in records):
        return update_model(model, records, study.damping_ratio)
    return locate_drive(model, records, study.damping_ratio).start


def told(start: UpdatedModel) -> str:
    """The drift of an updated model beside what is allowed."""
    fits = fitted_one_by_one(start)
    if fits is None:
        return "the model breaks down on a recording by itself"
    levels, n, misfit = [r.level for r in start.problem.records], len(fits[0].p), start.null.score
    asked = (1 + ALIKE * max(misfit - 1, 0)) * chi2.isf(RARE, n) / n
    moves = drifted(fits, levels, misfit)
    return f"{drift(fits, levels) / n:9.2f} of {asked:8.2f}  misfit {misfit:8.3f}  {'moves' if moves else 'stays'}"


def main() -> None:
    """A line a case."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("cases", type=pathlib.Path)
    ap.add_argument("--only", default="", help="names of cases, separated by commas")
    a = ap.parse_args()
    only = a.only.split(",") if a.only else None
    for case in sorted(p for p in a.cases.iterdir() if (p / "public").is_dir()):
        if only is None or case.name in only:
            truth = json.loads((case / "sealed" / "truth.json").read_text(encoding="utf-8"))
            beyond = truth.get("visibility_beyond_update", 0.0)
            print(
                f"{case.name}  {truth['effect']:20s} {beyond:6.1f}  {told(updated(case / 'public' / 'study.toml'))}",
                flush=True,
            )


if __name__ == "__main__":
    main()
