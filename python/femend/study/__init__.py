"""The study file and running it."""

from __future__ import annotations

from femend.model import Parameter
from femend.study.file.load import load_study
from femend.study.file.study import Configuration, Study, StudyRecording
from femend.study.result.interruption import StudyInterrupted

__all__ = ["Configuration", "Parameter", "Study", "StudyInterrupted", "StudyRecording", "load_study"]
