"""What the report shows, gathered from a finished run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from femend.diagnose.deciding.mismatch import mismatch_map
from femend.report import words
from femend.report.content import MismatchMap, ReportContent
from femend.study.shown import tables
from femend.study.shown.curves import frf_overlays, restoring_force, time_overlays
from femend.study.shown.frf_curves import measured_frf_overlays
from femend.study.shown.picture import markers, mesh_picture
from femend.study.shown.references import references

if TYPE_CHECKING:
    from femend.study.result.study_run import StudyRun

__all__ = ["report_content"]


def report_content(run: StudyRun, info: dict[str, Any]) -> ReportContent:
    """The page's content from a finished run and the content of run.json; what a verdict does not have stays empty."""
    located, ambiguous, direction = _place(run.result)
    sensors, shakers = markers(run.test, run.model, run.pairing)
    found = mismatch_map(run.diagnosis)
    return ReportContent(
        run.study.title,
        run.result,
        mesh=mesh_picture(run.model),
        located=located,
        ambiguous=ambiguous,
        direction=direction,
        further=_further_places(run.result),
        sensors=sensors,
        shakers=shakers,
        overlays=(*measured_frf_overlays(run), *frf_overlays(run)),
        traces=time_overlays(run),
        restoring=restoring_force(run),
        places=tables.places(run.diagnosis),
        mismatch=None if found is None else MismatchMap(*found),
        place_threshold=run.diagnosis.settings.margin,
        laws=tables.laws(run.diagnosis),
        parameters=tables.parameters(run),
        checks=tables.checks(run),
        run=info,
        references=references(run),
        notes=tables.notes(run),
    )


def _further_places(result: dict[str, Any]) -> tuple[tuple[tuple[int, ...], str], ...]:
    """Nodes and direction of every finding after the first."""
    places = [words.mapping(finding.get("location")) for finding in words.rows(result.get("findings"))[1:]]
    return tuple((_nodes(p), str(p.get("direction") or "")) for p in places)


def _nodes(location: Mapping[str, Any]) -> tuple[int, ...]:
    """All nodes of a place, of a line or area not its ends alone."""
    return tuple(int(n) for n in location.get("region") or location.get("nodes") or ())


def _place(result: dict[str, Any]) -> tuple[tuple[int, ...], tuple[int, ...], str]:
    """Nodes and direction of the first finding, and the nodes the recordings cannot tell from them."""
    findings = words.rows(result.get("findings"))
    location = words.mapping(findings[0].get("location")) if findings else {}
    nodes = _nodes(location)
    also = dict.fromkeys(int(n) for place in location.get("also_possible") or () for n in place)
    return nodes, tuple(n for n in also if n not in nodes), str(location.get("direction") or "")
