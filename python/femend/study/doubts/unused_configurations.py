"""Configurations of a study that nothing was recorded in."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femend.study.file.study import Study

__all__ = ["unused_configurations"]


def unused_configurations(study: Study) -> list[str]:
    """A sentence for each configuration of the `study` that none of its recordings is in: where one was forgotten
    there, its masses and supports count in nothing, and parameters make up for them."""
    used = {r.configuration for r in study.recordings}
    return [
        f"no recording is in configuration {one.name!r}, so that its masses and supports count in nothing: write "
        f"configuration = {one.name!r} in the [[recording]] tables of those made in it, or take its table out"
        for one in study.configurations
        if one.name not in used
    ]
