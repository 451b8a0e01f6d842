"""The motor rig from end to end: hammer test, ambient, run-up; diagnosis in stages; the pictures the field draws.

    python motor_rig.py STUDY OUT

STUDY is the study.toml of a rig (hammer FRFs of the clamped machine, ambient and run-up in operation, a run-down to be
predicted), OUT a folder for the diagnosis and the pictures. See python/docs/operating.md.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import femend as fe
from femend.study.staged_content import ods_correlation
from femend.study.staged_pictures import staged_pictures
from femend.study.staged_run import StagedRun


def main(study: Path, out: Path) -> StagedRun:
    """Diagnoses the study into `out`, draws the pictures there and prints what was found."""
    run = fe.diagnose_study(study, out)
    if not isinstance(run, StagedRun):
        raise SystemExit(f"{study} has recordings with measured forces of one configuration only: no stages to show")
    tell(run)
    for name, caption, figure in staged_pictures(run):
        figure.savefig(out / f"rig_{name}.png", dpi=150)
        print(f"rig_{name}.png  {caption}")
    print(f"report: {out / 'report.html'}")
    return run


def tell(run: StagedRun) -> None:
    """The stages, their modes, findings, loads and the correlation of the operating shapes as text."""
    for stage in run.result["stages"]:
        print(f"\n{stage['stage']} ({stage['configuration']}: {', '.join(stage['recordings'])})")
        for remark in stage["remarks"]:
            print(f"  {remark}")
        if stage.get("modes"):
            print("  identified Hz   model Hz       off   damping %   model %    MAC")
        for m in stage.get("modes", ()):
            off = 100 * (m["model_freq"] / m["freq"] - 1)
            print(
                f"  {m['freq']:13.3f} {m['model_freq']:10.3f} {off:+8.2f} % {100 * m['zeta']:9.2f} "
                f"{100 * m['model_zeta']:9.2f} {m['mac']:6.3f}"
            )
    for finding in run.result["findings"]:
        print(f"\n{finding['physics']} in {', '.join(finding['configurations'])}")
        for name, p in finding["parameters"].items():
            print(f"  {name} = {p['value']:.5g} ± {p['sd']:.2g} {p['unit']}")
    for configuration, modes in run.result["modes"].items():
        listed = ", ".join(f"{m['freq']:.2f}" for m in modes)
        print(f"\nfinal model, {configuration}: {listed} Hz")
    for configuration, result in run.final.runs:
        c = ods_correlation(run, configuration, result)
        print(f"\noperating shapes of {result.data.name} against the final model, least CSAC (the DAC's diagonal)")
        for low, high in ((5.0, 6.5), (9.5, 13.0), (5.0, 25.0)):
            inside = (c["freq"] >= low) & (c["freq"] <= high)
            if inside.any():
                print(f"  {low:4.1f} to {high:4.1f} Hz: {np.min(c['csac'][inside]):.4f}")
    for warning in run.result["warnings"]:
        print(f"\nwarning: {warning}")
    print()


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
