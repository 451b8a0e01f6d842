"""The study file and running it."""

from __future__ import annotations

from femend.model import Parameter
from femend.study.interruption import StudyInterrupted
from femend.study.load import load_study
from femend.study.study import Configuration, Study, StudyRecording

__all__ = ["Configuration", "Parameter", "Study", "StudyInterrupted", "StudyRecording", "load_study"]
