"""What the report shows, gathered from a finished run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from femend.report.content import ReportContent

if TYPE_CHECKING:
    from femend.study.run import StudyRun

__all__ = ["report_content"]


def report_content(run: StudyRun, info: dict[str, Any]) -> ReportContent:
    """The page's content from a finished run and the content of run.json."""
    return ReportContent(run.study.title, run.result, run=info)
