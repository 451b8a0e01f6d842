"""Detect, locate, name, validate."""

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.diagnosis import diagnose_records
from femend.diagnose.responses_alone import diagnose_responses
from femend.diagnose.settings import Settings

__all__ = ["Diagnosis", "Settings", "diagnose_records", "diagnose_responses"]
