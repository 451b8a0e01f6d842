"""Make the picture of the README: what a diagnosis found, how the law looks, and what it predicts.

    python benches/readme_picture.py                       # writes python/docs/diagnosis.png
    python benches/readme_picture.py --keep FOLDER         # keeps the case and its diagnosis, and takes them up again

The case is made by `tests/blind/generate.py`, which shares no code with femend: a plate on four corner supports that
touches a stop the deck does not know. Its recording "random" is given to the diagnosis without responses; they are
opened when the diagnosis is finished, to be drawn beside the predictions.
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import femend as fe
from femend.diagnose.deciding.mismatch import mismatch_map
from femend.report.content import MismatchMap
from femend.report.plots import draw_mismatch, paper_style
from femend.report.plots.style import CURVES, SOFT
from femend.report.words import by_importance, mapping, parameter_text, physics_name, place_text
from femend.study.result.predictions import nrmse
from femend.study.result.study_run import StudyRun
from femend.study.shown.curves import restoring_force
from femend.study.shown.picture import markers, mesh_picture

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "python" / "docs" / "diagnosis.png"
CASE = ["--cases", "1", "--seed", "3", "--family", "plate", "--effect", "clearance"]
CASE += ["--noise", "0.01,0.0101", "--beyond", "30"]  # a stop that no updating can make up for
HELD_OUT, CYCLES = "random", 8
# a wide grey line under the two models' curves
MEASURED = "#9aa3ad"
SIZES = {"axes.labelsize": 9.5, "xtick.labelsize": 9, "ytick.labelsize": 9, "legend.fontsize": 9}


@dataclass(frozen=True)
class HeldOut:
    """Responses (n_out, n) of a recording that took no part, m/s², at step `dt` (s): measured, and predicted by the
    updated model without and with what was found."""

    dt: float
    measured: np.ndarray
    updated: np.ndarray
    final: np.ndarray
    channels: tuple[fe.Channel, ...]


def make_case(folder: Path) -> Path:
    """The generated case in `folder`, made unless it is there."""
    case = folder / "b0001"
    if not (case / "sealed" / "truth.json").is_file():
        command = [sys.executable, str(ROOT / "tests" / "blind" / "generate.py"), str(folder), *CASE]
        subprocess.run(command, check=True)
    return case


def held_out(run: StudyRun, sealed: Path | None = None, name: str = HELD_OUT) -> HeldOut:
    """Predictions of the recording `name` beside its responses, those of the file `sealed` where the study has none."""
    prediction = next(p for p in run.predictions if p.name == name)
    measured = prediction.recorded
    if sealed is not None:
        response = fe.read_recording(sealed).response
        assert response is not None
        rows = {c.dof: i for i, c in enumerate(response.channels)}
        measured = response.values[[rows[c.dof] for c in prediction.channels]]
    stages = prediction.stages
    return HeldOut(prediction.dt, np.asarray(measured), stages["parameters"], stages["final"], prediction.channels)


def draw(run: StudyRun, held: HeldOut) -> Figure:
    """The figure: mismatch map, restoring force, and a stretch of the held-out recording."""
    with paper_style(), mpl.rc_context({"font.size": 9.5, "axes.titlesize": 10.5, "axes.titleweight": "bold", **SIZES}):
        drawn = Figure(figsize=(11.4, 3.9), layout="constrained")
        left, middle, right = drawn.subplots(1, 3, width_ratios=[1.12, 0.9, 1.3])
        draw_map(left, run)
        draw_force(middle, run)
        draw_trace(right, held)
    return drawn


def draw_map(ax: Axes, run: StudyRun) -> None:
    """Where: the mesh coloured by what a free force at each node leaves."""
    found = mismatch_map(run.diagnosis)
    assert found is not None, "the updated model explains the recordings; there is nothing to map"
    location = run.result["findings"][0]["location"]
    nodes = [int(n) for n in location["nodes"]]
    sensors, shakers = markers(run.test, run.model, run.pairing)
    mesh = mesh_picture(run.model)
    draw_mismatch(ax, mesh, MismatchMap(*found), located=nodes, sensors=sensors, shakers=shakers)
    handles, labels = ax.get_legend_handles_labels()
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 0.94), "ncols": 4, "markerscale": 0.8}
    ax.legend(handles, labels, **above, handletextpad=0.2, columnspacing=0.9, borderpad=0.0)
    ax.set_title(f"Where: {place_text(location)}")


def draw_force(ax: Axes, run: StudyRun) -> None:
    """What: the force recovered without any law, and the fitted law along the same motion."""
    force = restoring_force(run)
    assert force is not None, "no force was recovered at the place"
    finding = run.result["findings"][0]
    name = physics_name(str(finding["physics"]), mapping(finding["parameters"]))
    step = max(1, len(force.d) // 6000)
    mm = 1e3 * force.d[::step]
    ax.plot(mm, force.f[::step], ".", ms=3.2, mew=0, color=SOFT, alpha=0.55, label="recovered, no law assumed")
    if force.law_f is not None:
        law = force.law_f[::step]
        ax.plot(mm, law, ".", ms=1.8, mew=0, color=CURVES["final"]["color"], label="fitted law, same motion")
    ax.set_xlabel("displacement at the place, mm")
    ax.set_ylabel("force, N")
    ax.grid(visible=True)
    ax.legend(loc="upper left", markerscale=5, handletextpad=0.2, borderpad=0.1)
    ax.set_title(f"What: {name}")
    told = [(k, v) for k, v in by_importance(finding["parameters"]) if k != "sides"][:3]
    text = "\n".join("{} {}".format(*parameter_text(k, v, finding["physics"])) for k, v in told)
    ax.text(0.04, 0.8, text, transform=ax.transAxes, va="top", linespacing=1.5)


def draw_trace(ax: Axes, held: HeldOut) -> None:
    """Whether: the sensor that updating explains worst, around its largest response."""
    power = ((held.updated - held.measured) ** 2).sum(axis=1) / (held.measured**2).sum(axis=1)
    sensor = int(np.argmax(power))
    first, last = stretch(held.measured[sensor])
    t = held.dt * np.arange(first, last)
    curves = (
        ("measured", "measured", held.measured),
        ("parameters", f"updated, nothing added: NRMSE {nrmse(held.updated, held.measured):.2f}", held.updated),
        ("final", f"with the law found: NRMSE {nrmse(held.final, held.measured):.2f}", held.final),
    )
    widths = {"measured": 2.4, "parameters": 1.2, "final": 1.1}
    colours = {"measured": {"color": MEASURED}}
    for stage, label, values in curves:
        look = {**CURVES[stage], "linewidth": widths[stage], **colours.get(stage, {})}
        ax.plot(t, values[sensor, first:last], label=label, **look)
    reach = 1.08 * float(np.abs(np.concatenate([c[2][sensor, first:last] for c in curves])).max())
    ax.set_xlim(t[0], t[-1])
    ax.set_ylim(-reach, 1.9 * reach)  # room for the legend
    ax.set_yticks([tick for tick in ax.get_yticks() if abs(tick) <= reach])
    ax.set_xlabel("time, s")
    ax.set_ylabel("acceleration, m/s²")
    ax.grid(visible=True)
    ax.legend(loc="upper left", borderpad=0.1, title=f"sensor {held.channels[sensor].dof}; NRMSE over all sensors",
              title_fontsize=9, alignment="left")  # fmt: skip
    ax.set_title("Proof: a recording that took no part")


def stretch(y: np.ndarray, cycles: int = CYCLES) -> tuple[int, int]:
    """First and last sample of about `cycles` periods around the largest value of y (n,)."""
    crossings = max(int(np.count_nonzero(np.diff(np.signbit(y)))), 2)
    half = max(int(cycles * len(y) / crossings), 10)
    middle = int(np.clip(np.argmax(np.abs(y)), half, max(half, len(y) - half)))
    return middle - half, min(middle + half, len(y))


def save(drawn: Figure, picture: Path) -> None:
    """Writes the figure with few colours: a third of the size."""
    from PIL import Image

    whole = io.BytesIO()
    drawn.savefig(whole, dpi=150)
    few = Image.open(whole).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=4, dither=Image.Dither.NONE)
    few.save(picture, optimize=True)


def main(keep: Path | None = None, picture: Path = PICTURE) -> None:
    """Makes the case, diagnoses it and draws it."""
    with tempfile.TemporaryDirectory() as temporary:
        case = make_case(keep or Path(temporary))
        run = fe.diagnose_study(case / "public" / "study.toml", case / "diagnosis")
        assert isinstance(run, StudyRun)
        truth = json.loads((case / "sealed" / "truth.json").read_text(encoding="utf-8"))
        print(f"truth     {truth['effect']} at {truth['nodes']}: {truth['parameters']}")
        print(f"found     {run.result['findings'][0]}")
        drawn = draw(run, held_out(run, case / "sealed" / f"{HELD_OUT}.uff"))
        save(drawn, picture)
        print(f"picture   {picture}, {picture.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keep", type=Path, help="folder to keep the case and its diagnosis in")
    parser.add_argument("--picture", type=Path, default=PICTURE, help="file to write")
    given = parser.parse_args()
    main(given.keep, given.picture)
