"""The study file and running it."""

from __future__ import annotations

from femend.study.load import load_study
from femend.study.study import Configuration, Parameter, Study, StudyRecording

__all__ = ["Configuration", "Parameter", "Study", "StudyRecording", "load_study"]
