"""Detect, locate, name, validate."""

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.diagnosis import diagnose_records
from femend.diagnose.naming.name_at import NamedAt, name_at
from femend.diagnose.responses_alone import diagnose_responses
from femend.diagnose.settings import Settings

__all__ = ["Diagnosis", "NamedAt", "Settings", "diagnose_records", "diagnose_responses", "name_at"]
