"""The pictures of a staged study as the field draws them; the report and the example of the motor rig show them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femend.correlate import csac, csf, mac
from femend.data.bands import within_band
from femend.diagnose.staged.loads import predicted_ods
from femend.modal import identify_modes
from femend.modal.output_only import identify_output_only
from femend.model.model import model_of
from femend.report import plots
from femend.study.shown.picture import mesh_picture
from femend.units import unit_system

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from femend.diagnose.staged import Stage
    from femend.study.staged.study_run import StagedRun

__all__ = ["PICTURES", "not_drawn", "staged_pictures"]

FloatArray = NDArray[np.float64]

# modes of the model that stand beside identified ones: up to this multiple of the highest of them
ABOVE = 1.15
# step of the sensitivities, in the logarithm of an unknown; rows and columns that are shown
STEP, MODES_SHOWN, UNKNOWNS_SHOWN = 1e-3, 12, 14
# samples of a spectrum over the speed, so many at least, and how many such pieces stand end to end in a run at least
PIECE, LEAST_PIECE, FEWEST_PIECES = 256, 16, 4
# points between axes and title where a legend or the orders stand
PAD = 20.0
STATUS = ("new", "freq", "zeta", "stable")


def staged_pictures(run: StagedRun, told: list[str] | None = None) -> Iterator[tuple[str, str, Figure]]:
    """(name, caption, figure) of every picture that the run's recordings allow; one that cannot be drawn is left out,
    and `told` says so."""
    with plots.paper_style():
        for name, (caption, draw) in PICTURES.items():
            try:
                made = draw(run)
            except Exception as error:  # no picture is worth a finished diagnosis
                if told is not None:
                    told.append(not_drawn(caption, error))
                continue
            if made is not None:
                yield name, caption, made


def not_drawn(caption: str, error: Exception) -> str:
    """That a picture is left out, and why."""
    return (
        f'the picture "{caption.split(":")[0]}" could not be drawn and is left out of the report '
        f"({type(error).__name__}: {error}); nothing else depends on it"
    )


def _identifying(run: StagedRun) -> list[Stage]:
    return [s for s in run.final.stages if s.table and s.identified is not None]


def _shapes(run: StagedRun, configuration: str) -> tuple[Any, NDArray[np.complex128], NDArray[np.complex128]]:
    """The final model of a configuration, its poles and complex shapes in its basis."""
    posterior = run.final.in_configuration(configuration)
    model = run.setup.model(configuration, posterior.unknowns, run.final.terms)
    return model, *model.damped_modes(posterior.p)


def stabilisation(run: StagedRun) -> Figure | None:
    """Poles over the model order, of the first modal test and of the first output-only recording."""
    tests = [(c, r) for c, own in run.data.frfs.items() for r in own]
    ambient = [r for r in run.test if r.role == "fit" and r.excitation not in ("measured", "rotating")]
    tests = [(c, own) for c, own in tests[:1] if not run.test[own.name].is_time]
    alone = [(r, m) for r in ambient[:1] if (m := identify_output_only(r.time)).stabilisation is not None]
    if not tests and not alone:
        return None
    made = _panels(len(tests) + len(alone), 70)
    axes = iter(made.axes)
    for configuration, own in tests:
        found = identify_modes(run.test[own.name].frf, (float(own.freq[0]), float(own.freq[-1])))
        table, level = found.stabilisation.table, found.stabilisation.level
        power = np.sqrt((np.abs(own.H) ** 2).sum(axis=(1, 2)))
        axis = next(axes)
        plots.draw_stabilisation(
            axis, table.freq, table.order, [STATUS[i] for i in level],
            chosen=found.modes.freq, background=(own.freq, power), background_label="root of summed |FRF|²",
        )  # fmt: skip
        axis.set_title(f"{own.name} ({configuration})", pad=PAD)
    for recording, modes in alone:
        s = modes.stabilisation
        assert s is not None
        status = ["stable" if c >= 0 else "freq" if d else "new" for c, d in zip(s.cluster, s.determined)]
        axis = next(axes)
        plots.draw_stabilisation(axis, s.freq, s.order, status, chosen=modes.freq)
        axis.set_title(f"{recording.name} ({recording.configuration})", pad=PAD)
    return made


def _panels(n: int, height: float) -> Figure:
    """A figure of `n` panels side by side over the page: an empty one says that something is amiss, and one narrower
    than the page is blown up there."""
    return plots.figure("page", height, 1, n)


def frf_overlay(run: StagedRun) -> Figure | None:
    """The strongest FRF and a weaker one: measured, as the deck stands, updated, with the findings."""
    p = next((p for p in run.predictions if p.frf is not None), None)
    if p is None or p.frf is None:
        return None
    made = plots.figure("page", 85, 2, 2, sharex="col", height_ratios=(3, 1))
    inside = within_band(p.frf.freq, p.band)
    size = (np.abs(p.frf.H[inside]) ** 2).sum(axis=0)
    order = np.argsort(-size, axis=None)
    for k, at in enumerate((order[0], order[min(5, len(order) - 1)])):
        i, j = np.unravel_index(int(at), size.shape)
        curves = {"measured": p.frf.H[inside, i, j]} | {s: p.stages[s][inside, i, j] for s in p.stages}
        title = f"{p.frf.outputs[int(i)].dof} / {p.frf.inputs[int(j)].dof}"
        plots.draw_frf(
            made.axes[k], made.axes[k + 2], p.frf.freq[inside], curves,
            unit=p.frf.unit, quantity=p.frf.kind, title=title,
        )  # fmt: skip
    return made


def mac_matrix(run: StagedRun) -> Figure | None:
    """MAC of identified modes against the final model's, of the last two stages with modes."""
    stages = _identifying(run)[-2:]
    if not stages:
        return None
    made = _panels(len(stages), 85)
    for axis, stage in zip(made.axes, stages):
        assert stage.identified is not None
        model, lam, psi = _shapes(run, stage.configuration)
        freq = np.abs(lam) / (2 * np.pi)
        shown = freq < ABOVE * stage.identified.freq.max()
        phi = run.setup.rows(model, stage.identified.dofs) @ psi[:, shown]
        plots.draw_mac(axis, mac(stage.identified.shapes, phi), list(stage.identified.freq), list(freq[shown]))
        axis.set_title(f"{stage.name}, {stage.recordings[0]} ({stage.configuration})")
    return made


def campbell(run: StagedRun) -> Figure | None:
    """Spectra over the speed of the run, recorded and computed, with the first orders and the model's modes."""
    from scipy.signal import spectrogram

    if not run.final.runs:
        return None
    configuration, result = run.final.runs[0]
    row = int(np.argmax((result.data.y**2).sum(axis=1)))
    _, lam, _ = _shapes(run, configuration)
    modes = np.abs(lam) / (2 * np.pi)
    # a short run has shorter pieces, so that there are some to go over
    piece = min(PIECE, result.data.y.shape[1] // FEWEST_PIECES)
    if piece < LEAST_PIECE:
        return None
    made = plots.figure("page", 75, 1, 2)
    for axis, y, what in zip(list(made.axes), (result.data.y, result.predicted), ("recorded", "computed")):
        f, t, S = map(np.asarray, spectrogram(y[row], 1 / result.data.dt, nperseg=piece, noverlap=3 * piece // 4))
        rpm = 60 * np.interp(t, result.data.dt * np.arange(y.shape[1]), result.data.rev_per_s)
        order = np.argsort(rpm)
        keep = order[np.concatenate([[True], np.diff(rpm[order]) > 0])]
        shown = f <= result.data.f_max
        plots.draw_campbell(
            axis, rpm[keep], f[shown], np.sqrt(S[shown][:, keep]).T,
            unit="(m/s²)/√Hz", orders=(1.0, 2.0), modes=modes[modes < result.data.f_max],
        )  # fmt: skip
        axis.set_title(f"{what}, {result.data.sensors[row]}", pad=PAD)
    return made


def forces(run: StagedRun) -> Figure | None:
    """Bearing forces line by line with the square of speed, and their phase against the tacho."""
    if not run.final.runs:
        return None
    _, result = run.final.runs[0]
    ok, freq = result.after.reliable, result.after.freq
    if ok.sum() < 5:
        return None
    lines = result.after.unbalances(result.unbalance.sense)
    _, phase = result.unbalances()
    made = plots.figure("page", 65, 1, 2)
    by_node = {f"node {node}": lines[:, b] * (2 * np.pi * freq) ** 2 for b, node in enumerate(result.unbalance.nodes)}
    unit = unit_system(run.model.units).force_text
    plots.draw_force_spectra(made.axes[0], 60 * freq, by_node, unit=unit, reliable=ok)
    axis = made.axes[1]
    for b, name in enumerate(by_node):
        (dots,) = axis.plot(60 * freq[ok], np.degrees(np.angle(lines[ok, b])), "o", markersize=3, label=name)
        axis.axhline(np.degrees(phase[b]), color=dots.get_color(), linewidth=0.9)
    axis.set(xlabel="speed, 1/min", ylabel="phase against the tacho, °", ylim=(-180, 180), yticks=range(-180, 181, 60))
    axis.legend()
    return made


def operating_shapes(run: StagedRun) -> Figure | None:
    """Operating shapes over frequency, per speed squared, at the two strongest sensors at different nodes."""
    if not run.final.runs:
        return None
    _, result = run.final.runs[0]
    Y, computed = result.shapes.Y, _computed(run)
    order = np.argsort(-(np.abs(Y) ** 2).sum(axis=0))
    other = next(
        (i for i in order if result.data.sensors[i].component != result.data.sensors[order[0]].component), None
    )
    made = plots.figure("page", 85, 2, 2, sharex="col", height_ratios=(3, 1))
    for k, i in enumerate([int(order[0]), int(order[1] if other is None else other)]):
        plots.draw_frf(
            made.axes[k], made.axes[k + 2], result.shapes.freq, {"measured": Y[:, i], "final": computed[:, i]},
            unit=unit_system(run.model.units).length_text, quantity="ODS-FRF", title=str(result.data.sensors[i]),
        )  # fmt: skip
    return made


def _computed(run: StagedRun) -> NDArray[np.complex128]:
    _, r = run.final.runs[0]
    return predicted_ods(run.setup, r.data, r.model, r.posterior.p, r.unbalance, r.shapes.freq)


def correlation(run: StagedRun) -> Figure | None:
    """CSAC and CSF over frequency, and the DAC matrix of recorded against computed operating shapes."""
    if not run.final.runs:
        return None
    _, result = run.final.runs[0]
    Y, P, freq = result.shapes.Y, _computed(run), result.shapes.freq
    made = plots.figure("page", 70, 1, 2)
    curves = {"CSAC": csac(Y[:, :, None], P[:, :, None]), "CSF": csf(Y[:, :, None], P[:, :, None])}
    plots.draw_signature(made.axes[0], freq, curves, criterion="CSAC, CSF", target=0.95)
    plots.draw_dac(made.axes[1], mac(Y.T, P.T), 60 * freq, 60 * freq)
    return made


def sensitivities(run: StagedRun) -> Figure | None:
    """How the frequencies of the last configuration's modes follow its unknowns; those that move nothing are left
    out."""
    stages = _identifying(run)
    if not stages:
        return None
    posterior = run.final.in_configuration(stages[-1].configuration)
    model = run.setup.model(stages[-1].configuration, posterior.unknowns, run.final.terms)
    omega, _ = model.modes(posterior.p)
    inside = np.flatnonzero((omega > 0) & (omega < 2 * np.pi * run.setup.f_max))[:MODES_SHOWN]
    if not inside.size:
        return None
    names, columns = [], []
    for i, unknown in enumerate(posterior.unknowns.items):
        if not unknown.positive:
            continue
        ends = []
        for sign in (1, -1):
            p = posterior.p.copy()
            p[i] += sign * STEP
            ends.append(np.log(model.modes(p)[0][inside]))
        names.append(unknown.name)
        columns.append((ends[0] - ends[1]) / (2 * STEP))
    S = np.array(columns).T
    S[np.abs(S) < 5e-4] = 0.0  # by symmetry nothing
    kept = np.sort(np.argsort(-np.abs(S).max(axis=0))[:UNKNOWNS_SHOWN])
    kept = kept[np.abs(S[:, kept]).max(axis=0) > 0.005]
    made = plots.figure("page", 85)
    rows = [f"{omega[i] / (2 * np.pi):.2f} Hz" for i in inside]
    plots.draw_sensitivity(made.axes[0], S[:, kept], rows, [_short(names[k]) for k in kept])
    return made


def _short(name: str) -> str:
    """`support of nodes 1, 2 and more: k_x [operation]` as "support k_x"."""
    of, _, what = name.rpartition(": ")
    return f"{of.split()[0]} {what.split(' [')[0]}" if of else name


def mode_shapes(run: StagedRun) -> Figure | None:
    """The first six modes of the final model in the last configuration, on the deformed mesh."""
    stages = _identifying(run)
    if not stages:
        return None
    configuration = stages[-1].configuration
    model, lam, psi = _shapes(run, configuration)
    mesh = mesh_picture(
        model_of(run.model.deck, units=run.model.units, spc=run.setup.configurations[configuration].spc)
    )
    n = min(6, int((np.abs(lam) < 2 * np.pi * run.setup.f_max).sum()))
    if not n:
        return None
    made = plots.figure("page", 95, 2, 3)
    for i, axis in enumerate(made.axes):
        if i >= n:
            axis.set_axis_off()
            continue
        g = (model.V @ psi[:, i]).reshape(-1, 6)[:, :3]
        motion = np.einsum("nij,ni->nj", model.model.frames, g)
        plots.draw_shape(axis, mesh, motion, title=f"{abs(lam[i]) / (2 * np.pi):.2f} Hz")
    return made


Draw = Callable[["StagedRun"], "Figure | None"]
PICTURES: dict[str, tuple[str, Draw]] = {
    "stabilisation": ("Stabilisation diagrams: poles over the model order; lines are the modes taken", stabilisation),
    "frf": ("FRFs: measured, as the deck stands, updated, with what was found", frf_overlay),
    "mac": ("MAC of identified modes against the final model's", mac_matrix),
    "waterfall": ("Run-up (Campbell): recorded and computed, with orders and the model's modes (dotted)", campbell),
    "ods": ("Operating shapes over frequency, per unit course of the unbalance", operating_shapes),
    "csac": ("Operating shapes, recorded against the final model: CSAC and CSF, and DAC", correlation),
    "forces": ("Bearing forces against the square of speed, and their phase", forces),
    "sensitivity": ("Sensitivity of the frequencies in operation", sensitivities),
    "shapes": ("Modes of the final model", mode_shapes),
}
