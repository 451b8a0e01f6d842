"""The classic chain on a study: correlate deck and test, update on modes and FRFs, plan a test."""

from __future__ import annotations

from femend.bench.correlation.correlate import correlate
from femend.bench.correlation.correlation_run import CorrelationRun
from femend.bench.planning.pretest import pretest
from femend.bench.planning.pretest_run import PretestRun
from femend.bench.populations.population import population
from femend.bench.populations.population_run import PopulationRun
from femend.bench.updating.interruption import UpdateInterrupted
from femend.bench.updating.update import update
from femend.bench.updating.update_run import UpdateRun

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
