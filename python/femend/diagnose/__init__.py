"""Detect, locate, name, validate."""

from femend.diagnose.diagnosis import Diagnosis, diagnose_records, diagnose_responses
from femend.diagnose.settings import Settings

__all__ = ["Diagnosis", "Settings", "diagnose_records", "diagnose_responses"]
