"""Diagnosis in stages: modal test, FRFs, output-only modes, operating shapes and loads."""

from femend.diagnose.staged.loads import RunResult
from femend.diagnose.staged.sensors import contradictions, sensor_warnings
from femend.diagnose.staged.settings import StagedSettings
from femend.diagnose.staged.setup import ConfigurationSpec, Setup, carried, setup_of
from femend.diagnose.staged.stages import Flow, Stage, StagedData, run_stages, runs_at_their_nodes, staged_data

__all__ = [
    "ConfigurationSpec",
    "Flow",
    "RunResult",
    "Setup",
    "Stage",
    "StagedData",
    "StagedSettings",
    "carried",
    "contradictions",
    "run_stages",
    "runs_at_their_nodes",
    "sensor_warnings",
    "setup_of",
    "staged_data",
]
