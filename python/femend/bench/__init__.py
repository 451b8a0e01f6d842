"""The classic chain on a study: correlate deck and test, update on modes and FRFs, plan a test."""

from __future__ import annotations

from femend.bench.correlate import CorrelationRun, correlate
from femend.bench.pretest import PretestRun, pretest
from femend.bench.update import UpdateRun, update

__all__ = ["CorrelationRun", "PretestRun", "UpdateRun", "correlate", "pretest", "update"]
