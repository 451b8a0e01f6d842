"""The motor rig from end to end: hammer test, ambient, run-up; diagnosis in stages; the pictures the field draws.

    python motor_rig.py STUDY OUT

STUDY is the study.toml of a rig (hammer FRFs of the clamped machine, ambient and run-up in operation, a run-down to be
predicted), OUT a folder for the diagnosis and the pictures. See python/docs/operating.md.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import femend as fe
from femend.study.staged.content import ods_correlation
from femend.study.staged.pictures import staged_pictures
from femend.study.staged.study_run import StagedRun


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
        rows = [[m[k] for k in ("freq", "zeta", "model_freq", "model_zeta", "mac")] for m in stage.get("modes", ())]
        table(rows)
    for finding in run.result["findings"]:
        print(f"\n{finding['physics']} in {', '.join(finding['configurations'])}")
        for name, p in finding["parameters"].items():
            print(f"  {name} = {p['value']:.5g} ± {p['sd']:.2g} {p['unit']}")
    for configuration, modes in run.result["modes"].items():
        listed = ", ".join(f"{m['freq']:.2f}" for m in modes)
        print(f"\nfinal model, {configuration}: {listed} Hz")
        posterior = run.final.in_configuration(configuration)
        model = run.setup.model(configuration, posterior.unknowns, run.final.terms)
        for d in (*run.data.test_modes.get(configuration, ()), *run.data.output_only.get(configuration, ())):
            lam, _, mac = d.block(run.setup, model).pairs(posterior.p)
            size = np.abs(lam)
            print(f"  against the modes of {d.name}")
            table(list(zip(d.modes.freq, d.modes.zeta, size / (2 * np.pi), -lam.real / size, mac)))
    for _, result in run.final.runs:
        c = ods_correlation(run, result)
        print(f"\noperating shapes of {result.data.name} against the final model, least CSAC (the DAC's diagonal)")
        for low, high in ((5.0, 6.5), (9.5, 13.0), (5.0, 25.0)):
            inside = (c["freq"] >= low) & (c["freq"] <= high)
            if inside.any():
                print(f"  {low:4.1f} to {high:4.1f} Hz: {np.min(c['csac'][inside]):.4f}")
    for warning in run.result["warnings"]:
        print(f"\nwarning: {warning}")
    print()


def table(rows: Sequence[Sequence[float]]) -> None:
    """Rows of frequency in Hz and damping, identified and of the model, and MAC."""
    if rows:
        print("  identified Hz   model Hz        off  damping %   model %    MAC")
    for freq, zeta, model_freq, model_zeta, mac in rows:
        off = 100 * (model_freq / freq - 1)
        print(f"  {freq:13.3f} {model_freq:10.3f} {off:+8.2f} % {100 * zeta:10.2f} {100 * model_zeta:9.2f} {mac:6.3f}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
