"""One estimate from recordings of several kinds and configurations: modes, FRFs and runs of a rotor."""

from femend.estimate.joint.choose import DataChoice, DataPart, choose_data
from femend.estimate.joint.force_laws import ForceLaw, ForceLaws, compare_force_laws
from femend.estimate.joint.frf_block import FrfBlock
from femend.estimate.joint.line_forces import LineForces, OdsFrf, line_forces, ods_frf
from femend.estimate.joint.linearised import Linearised
from femend.estimate.joint.modes_block import ModesBlock, modal_assurance
from femend.estimate.joint.ods_block import OdsBlock
from femend.estimate.joint.receptance import Receptance, receptance
from femend.estimate.joint.rotor import DELAY, Run, Unbalance, run_of, unbalance_unknowns
from femend.estimate.joint.run_block import RunBlock, simulate_run
from femend.estimate.joint.solve import Block, Posterior, maximise

__all__ = [
    "DELAY",
    "Block",
    "DataChoice",
    "DataPart",
    "ForceLaw",
    "ForceLaws",
    "FrfBlock",
    "LineForces",
    "Linearised",
    "ModesBlock",
    "OdsBlock",
    "OdsFrf",
    "Posterior",
    "Receptance",
    "Run",
    "RunBlock",
    "Unbalance",
    "choose_data",
    "compare_force_laws",
    "line_forces",
    "maximise",
    "modal_assurance",
    "ods_frf",
    "receptance",
    "run_of",
    "simulate_run",
    "unbalance_unknowns",
]
