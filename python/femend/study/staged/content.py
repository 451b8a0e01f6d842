"""What the report of a staged study shows."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.data.bands import within_band
from femend.diagnose.staged.loads import predicted_ods
from femend.model.model import model_of
from femend.numerals import plain
from femend.report import words
from femend.report.content import Check, FrfOverlay, LawRow, ParameterRow, Picture, ReportContent, TimeOverlay
from femend.study.result.predictions import STAGES
from femend.study.shown.picture import markers, mesh_picture
from femend.study.staged.pictures import not_drawn, staged_pictures
from femend.units import unit_system

if TYPE_CHECKING:
    from femend.diagnose.staged import RunResult
    from femend.study.staged.study_run import StagedRun

__all__ = ["ods_correlation", "staged_content"]

# FRFs, operating shapes and time traces that are drawn, and the seconds of a trace
FRFS, SHAPES, TRACES, SECONDS = 4, 4, 4, 4.0
# resolution of the pictures: as wide as the page
DPI = 130

_REFERENCES = (
    "B. Peeters et al., The PolyMAX frequency-domain method, Shock and Vibration 11 (2004) 395-409: modes of the test.",
    "E. Reynders, System identification methods for (operational) modal analysis, Arch. Comput. Methods Eng. 19 (2012) "
    "51-124: output-only modes with their uncertainty.",
    "S. Adhikari, Rates of change of eigenvalues and eigenvectors in damped dynamic system, AIAA J. 37 (1999) "
    "1452-1458: sensitivities of complex modes.",
    "D. J. C. MacKay, Information Theory, Inference, and Learning Algorithms, Cambridge, 2003, ch. 28: evidence.",
    "G. H. Golub, M. Heath and G. Wahba, Generalized cross-validation as a method for choosing a good ridge parameter, "
    "Technometrics 21 (1979) 215-223: regularisation of forces.",
)


def ods_correlation(run: StagedRun, result: RunResult) -> dict[str, Any]:
    """CSAC (K,) between recorded and computed operating shapes on the lines `freq` (K,), for the final model."""
    P = predicted_ods(run.setup, result.data, result.model, result.posterior.p, result.unbalance, result.shapes.freq)
    Y = result.shapes.Y
    cross = np.abs((Y.conj() * P).sum(axis=1)) ** 2
    size = (np.abs(Y) ** 2).sum(axis=1) * (np.abs(P) ** 2).sum(axis=1)
    return {"freq": result.shapes.freq, "csac": cross / size, "shapes": P}


def staged_content(run: StagedRun, info: dict[str, Any]) -> ReportContent:
    """The page's content from a finished staged run."""
    findings = words.rows(run.result.get("findings"))
    where = words.mapping(findings[0].get("location")) if findings else {}
    nodes = tuple(int(n) for n in where.get("region") or where.get("nodes") or ())
    sensors, shakers = markers(run.test, run.model, run.pairing)
    first = next(iter(run.setup.configurations.values()))
    drawn = model_of(run.model.deck, units=run.model.units, spc=first.spc)
    return ReportContent(
        run.study.title,
        run.result,
        mesh=mesh_picture(drawn),
        located=nodes,
        sensors=sensors,
        shakers=shakers,
        overlays=(*_frfs(run), *_shapes(run)),
        traces=_traces(run),
        laws=_rivals(run),
        parameters=_parameters(run),
        checks=_checks(run),
        run=info,
        references=_REFERENCES,
        notes=_notes(run),
        pictures=_pictures(run),
    )


def _pictures(run: StagedRun) -> tuple[Picture, ...]:
    """The pictures as they are printed; those that cannot be drawn are told among the result's warnings."""
    found: list[Picture] = []
    told: list[str] = []
    for name, caption, figure in staged_pictures(run, told):
        if name == "frf":  # the page draws them itself
            continue
        buffer = BytesIO()
        try:
            figure.savefig(buffer, format="png", dpi=DPI)
        except Exception as error:
            told.append(not_drawn(caption, error))
            continue
        found.append(Picture(caption, buffer.getvalue()))
    run.result["warnings"] = [*run.result["warnings"], *told]
    return tuple(found)


def _frfs(run: StagedRun) -> list[FrfOverlay]:
    found = []
    for p in run.predictions:
        if p.frf is None:
            continue
        inside = within_band(p.frf.freq, p.band)
        pairs = [(i, j) for i in range(len(p.frf.outputs)) for j in range(len(p.frf.inputs))]
        power = (np.abs(p.frf.H[inside]) ** 2).sum(axis=0)
        strongest = sorted(pairs, key=lambda ij, power=power: -float(power[ij]))  # type: ignore[misc]
        for i, j in strongest[:FRFS]:
            found.append(
                FrfOverlay(
                    p.frf.freq[inside],
                    p.frf.H[inside, i, j],
                    **{s: p.stages[s][inside, i, j] for s in STAGES},
                    label=f"{p.frf.kind} {p.frf.outputs[i].dof} / {p.frf.inputs[j].dof}",
                    recording=p.name,
                    unit=p.frf.unit,
                )
            )
    return found


def _shapes(run: StagedRun) -> list[FrfOverlay]:
    """Operating shapes per unit course over frequency, at the sensors that move most."""
    found = []
    for configuration, result in run.final.runs:
        computed = ods_correlation(run, result)["shapes"]
        updated = next((r for c, r in run.plain.runs if c == configuration), None)
        before = None
        if updated is not None:
            before = predicted_ods(
                run.setup, updated.data, updated.model, updated.posterior.p, updated.unbalance, result.shapes.freq
            )
        order = np.argsort(-(np.abs(result.shapes.Y) ** 2).sum(axis=0))
        for i in order[:SHAPES]:
            found.append(
                FrfOverlay(
                    result.shapes.freq,
                    result.shapes.Y[:, i],
                    parameters=None if before is None else before[:, i],
                    final=computed[:, i],
                    label=f"operating shape per speed squared, {result.data.sensors[i]}",
                    recording=result.data.name,
                    unit=unit_system(run.model.units).length_text,
                )
            )
    return found


def _traces(run: StagedRun) -> tuple[TimeOverlay, ...]:
    found = []
    for p in run.predictions:
        if p.frf is not None:
            continue
        y = p.stages["final"]
        row = int(np.argmax((y**2).sum(axis=1)))
        n = int(SECONDS / p.dt)
        middle = int(np.argmax(np.abs(y[row])))
        cut = slice(max(0, min(middle - n // 2, y.shape[1] - n)), max(0, min(middle - n // 2, y.shape[1] - n)) + n)
        found.append(
            TimeOverlay(
                np.asarray(p.dt * np.arange(y.shape[1])[cut], dtype=np.float64),
                None if p.recorded is None else p.recorded[row, cut],
                **{s: p.stages[s][row, cut] for s in STAGES},
                label=str(p.channels[row].dof),
                recording=p.name,
                role=p.role,
                unit=p.channels[row].unit,
            )
        )
    return tuple(found[:TRACES])


def _rivals(run: StagedRun) -> tuple[LawRow, ...]:
    rows = []
    for stage in run.final.stages:
        for decision in stage.rounds:
            for rival in decision.rivals:
                n = 0 if rival.term is None else len(rival.term.unknowns)
                left = sum(rival.posterior.squares.values()) / max(rival.posterior.n_values, 1.0)
                remark = f"{stage.name}, {stage.configuration}; ln evidence {plain(rival.score)}"
                together = sum(r.probability for r in decision.rivals if r.physics == rival.physics)
                if rival is decision.taken and together > rival.probability + 0.005:
                    remark += f"; {plain(100 * together, 2)} % with the other places of this physics"
                name = rival.physics or "none"
                rows.append(
                    LawRow(name, rival.label, n, left, left, rival.probability, remark, rival is decision.taken)
                )
    return tuple(rows)


def _parameters(run: StagedRun) -> tuple[ParameterRow, ...]:
    rows = []
    for parameter in run.model.parameters:
        entry = run.result["parameters"][parameter.name]
        z = float(np.log(entry["factor"])) / parameter.prior_sd
        rows.append(ParameterRow(parameter.name, entry["factor"], entry["sd"], parameter.prior_sd, z))
    return tuple(rows)


def _checks(run: StagedRun) -> tuple[Check, ...]:
    """After every stage: what is still unexplained."""
    found = []
    for stage in run.final.stages:
        what = "frequencies off by" if stage.table and stage.run is None else "unexplained"
        figure = f"{what} {plain(100 * stage.unexplained, 3)} %; noise {plain(100 * stage.noise, 2)} %"
        found.append(Check(f"{stage.name} ({stage.configuration})", "; ".join(stage.remarks), figure))
    for _, result in run.final.runs:
        c = ods_correlation(run, result)
        figure = f"CSAC at least {float(c['csac'].min()):.3f}, on average {float(c['csac'].mean()):.3f}"
        found.append(Check(f"operating shapes of {result.data.name} against the final model", figure, ""))
    return tuple(found)


def _notes(run: StagedRun) -> tuple[str, ...]:
    found = list(run.pairing.notes)
    for recording in run.test:
        found += [f"recording {recording.name}: {note}" for note in recording.notes]
    for _, result in run.final.runs:
        found += [f"tacho of {result.data.name}: {note}" for note in result.data.speed.notes]
        slipped = result.data.dt * float(((result.data.slips > 1) & (result.data.slips < 1e3)).sum())
        if slipped > 0:
            found.append(
                f"recording {result.data.name}: {plain(slipped, 2)} s count little, since the angle of the tacho slips "
                "there"
            )
    idealised = [n for n in run.final.posterior.unknowns.names if n.startswith(("inertia", "own mass"))]
    values = dict(zip(run.final.posterior.unknowns.names, run.final.posterior.values, strict=True))
    found += [f"idealisation of the deck: {n} = {plain(values[n])}" for n in idealised]
    return tuple(found)
