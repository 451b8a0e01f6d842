"""The classic chain on a study: correlate deck and test, update on modes and FRFs, plan a test."""

from __future__ import annotations

from femend.bench.correlate import correlate
from femend.bench.correlation_run import CorrelationRun
from femend.bench.interruption import UpdateInterrupted
from femend.bench.population import population
from femend.bench.population_run import PopulationRun
from femend.bench.pretest import pretest
from femend.bench.pretest_run import PretestRun
from femend.bench.update import update
from femend.bench.update_run import UpdateRun

__all__ = [
    "CorrelationRun",
    "PopulationRun",
    "PretestRun",
    "UpdateInterrupted",
    "UpdateRun",
    "correlate",
    "population",
    "pretest",
    "update",
]
