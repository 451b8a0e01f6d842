"""One estimate from recordings of several kinds and configurations: modes, FRFs and runs of a rotor."""

from femend.estimate.joint.frf_block import FrfBlock
from femend.estimate.joint.modes_block import ModesBlock, modal_assurance
from femend.estimate.joint.receptance import Receptance, receptance
from femend.estimate.joint.solve import Block, Posterior, maximise

__all__ = ["Block", "FrfBlock", "ModesBlock", "Posterior", "Receptance", "maximise", "modal_assurance", "receptance"]
