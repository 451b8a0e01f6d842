"""The motor rig from end to end: hammer test, ambient, run-up; diagnosis in stages; the pictures the field draws.

    python motor_rig.py STUDY OUT

STUDY is the study.toml of a rig (hammer FRFs of the clamped machine, ambient and run-up in operation, a run-down to be
predicted), OUT a folder for the diagnosis and the pictures. See python/docs/operating.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import femend as fe
from femend.study.staged_content import ods_correlation
from femend.study.staged_run import StagedRun


def main(study: Path, out: Path) -> StagedRun:
    """Diagnoses the study into `out`, draws the pictures there and prints what was found."""
    run = fe.diagnose_study(study, out)
    if not isinstance(run, StagedRun):
        raise SystemExit(f"{study} has recordings with measured forces of one configuration only: no stages to show")
    tell(run)
    draw(run, out)
    return run


def tell(run: StagedRun) -> None:
    """The stages, findings and loads as text."""
    for stage in run.result["stages"]:
        print(f"\n{stage['stage']} ({stage['configuration']}: {', '.join(stage['recordings'])})")
        for remark in stage["remarks"]:
            print(f"  {remark}")
    for finding in run.result["findings"]:
        print(f"\n{finding['physics']} in {', '.join(finding['configurations'])}")
        for name, p in finding["parameters"].items():
            print(f"  {name} = {p['value']:.5g} ± {p['sd']:.2g} {p['unit']}")


def draw(run: StagedRun, out: Path) -> list[Path]:
    """One picture a file; the paths."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    made = []
    pictures: dict[str, Any] = {"frf": frf_overlay, "mac": mac_matrix}
    if run.final.runs:
        pictures |= {"waterfall": waterfall, "forces": force_spectra, "ods": ods_overlay, "csac": csac_and_dac}
    for name, picture in pictures.items():
        figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
        picture(run, axes)
        made.append(out / f"rig_{name}.png")
        figure.savefig(made[-1], dpi=120)
        plt.close(figure)
    return made


def frf_overlay(run: StagedRun, axes: Any) -> None:
    """Driving-point-like and weakest of the strong FRFs, measured, as the deck stands, and with the findings."""
    p = next(p for p in run.predictions if p.frf is not None)
    size = (np.abs(p.frf.H) ** 2).sum(axis=0)
    for axis, (i, j) in zip(axes, (np.unravel_index(int(k), size.shape) for k in np.argsort(-size, axis=None)[[0, 5]])):
        inside = (p.frf.freq >= p.band[0]) & (p.frf.freq <= 30.0)
        axis.semilogy(p.frf.freq[inside], np.abs(p.frf.H[inside, i, j]), "k", lw=2, label="measured")
        for stage, style in (("nominal", ":"), ("parameters", "--"), ("final", "-")):
            axis.semilogy(p.frf.freq[inside], np.abs(p.stages[stage][inside, i, j]), style, label=stage)
        axis.set(title=f"{p.frf.outputs[i].dof} / {p.frf.inputs[j].dof}", xlabel="frequency in Hz", ylabel=p.frf.unit)
        axis.legend()


def mac_matrix(run: StagedRun, axes: Any) -> None:
    """MAC of identified modes against the final model's, of every stage with modes."""
    stages = [s for s in run.final.stages if s.table][-2:]
    for axis, stage in zip(axes, stages):
        posterior = run.final.in_configuration(stage.configuration)
        model = run.setup.model(stage.configuration, posterior.unknowns, run.final.terms)
        lam, psi = model.damped_modes(posterior.p)
        assert stage.identified is not None
        phi = run.setup.rows(model, stage.identified.dofs) @ psi[:, :14]
        m = fe_mac(stage.identified.shapes, phi)
        axis.imshow(m, vmin=0, vmax=1, cmap="viridis")
        axis.set_yticks(range(len(m)), [f"{f:.2f}" for f in stage.identified.freq])
        axis.set_xticks(range(m.shape[1]), [f"{abs(x) / 2 / np.pi:.1f}" for x in lam[: m.shape[1]]], rotation=90)
        axis.set(title=f"{stage.name} ({stage.configuration})", xlabel="model, Hz", ylabel="identified, Hz")


def fe_mac(a: Any, b: Any) -> Any:
    """MAC (n_a, n_b)."""
    from femend.correlate import mac

    return mac(a, b)


def waterfall(run: StagedRun, axes: Any) -> None:
    """Spectra over the run (Campbell) with the first orders, recorded and computed."""
    from scipy.signal import spectrogram

    _, result = run.final.runs[0]
    row = int(np.argmax((result.data.y**2).sum(axis=1)))
    for axis, y, title in zip(axes, (result.data.y, result.predicted), ("recorded", "computed")):
        f, t, S = spectrogram(y[row], 1 / result.data.dt, nperseg=256, noverlap=192)
        axis.pcolormesh(t, f, 10 * np.log10(S + 1e-8), shading="auto")
        speed = np.interp(t, result.data.speed.t, result.data.speed.rev_per_s)
        for order in (1, 2):
            axis.plot(t, order * speed, "w:", lw=0.8)
        axis.set(title=f"{title}, {result.data.sensors[row]}", xlabel="time in s", ylabel="frequency in Hz")
        axis.set_ylim(0, f[-1])


def force_spectra(run: StagedRun, axes: Any) -> None:
    """Bearing forces line by line with the law fitted over the whole run."""
    _, result = run.final.runs[0]
    U, phase = result.unbalances()
    lines = result.after.unbalances(result.unbalance.sense)
    ok, omega = result.after.reliable, 2 * np.pi * result.after.freq
    for b, node in enumerate(result.unbalance.nodes):
        axes[0].loglog(result.after.freq[ok], (np.abs(lines[:, b]) * omega**2)[ok], "o", ms=3, label=f"node {node}")
        axes[0].loglog(result.after.freq, U[b] * omega**2, "k-", lw=0.8)
        axes[1].plot(result.after.freq[ok], np.degrees(np.angle(lines[ok, b])), "o", ms=3)
        axes[1].axhline(np.degrees(phase[b]), color="k", lw=0.8)
    n, sd = result.exponent
    axes[0].set(title=f"|F| ~ speed^({n:.3f} ± {sd:.3f})", xlabel="speed in Hz", ylabel="force")
    axes[1].set(title="phase against the tacho", xlabel="speed in Hz", ylabel="degrees")
    axes[0].legend()


def ods_overlay(run: StagedRun, axes: Any) -> None:
    """Operating shapes per speed squared at the two strongest sensors."""
    configuration, result = run.final.runs[0]
    computed = ods_correlation(run, configuration, result)["shapes"]
    order = np.argsort(-(np.abs(result.shapes.Y) ** 2).sum(axis=0))
    for axis, i in zip(axes, order[:2]):
        axis.semilogy(result.shapes.freq, np.abs(result.shapes.Y[:, i]), "k", lw=2, label="recorded")
        axis.semilogy(result.shapes.freq, np.abs(computed[:, i]), label="final")
        axis.set(title=str(result.data.sensors[i]), xlabel="frequency in Hz", ylabel="acceleration / speed²")
        axis.legend()


def csac_and_dac(run: StagedRun, axes: Any) -> None:
    """CSAC over frequency, and the DAC matrix of recorded against computed operating shapes."""
    configuration, result = run.final.runs[0]
    c = ods_correlation(run, configuration, result)
    axes[0].plot(c["freq"], c["csac"])
    axes[0].set(title="CSAC", xlabel="frequency in Hz", ylim=(0, 1.02))
    image = axes[1].imshow(
        fe_mac(result.shapes.Y.T, c["shapes"].T), vmin=0, vmax=1, origin="lower",
        extent=(c["freq"][0], c["freq"][-1], c["freq"][0], c["freq"][-1]),
    )  # fmt: skip
    axes[1].set(title="DAC", xlabel="computed, Hz", ylabel="recorded, Hz")
    axes[1].figure.colorbar(image, ax=axes[1])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
