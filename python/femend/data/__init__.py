"""Recordings, spectra, FRFs, modes, order tracks and operating shapes: immutable, labelled by DOF and unit."""

from __future__ import annotations

from femend.data.campbell import Campbell, CriticalSpeed, StabilityLimit
from femend.data.channel import Channel
from femend.data.complex_modes import ComplexModes, PoleSet
from femend.data.frf import FRF
from femend.data.geometry import Geometry
from femend.data.identified import IdentifiedModes
from femend.data.mode_set import ModeSet
from femend.data.ods import ODS
from femend.data.order_track import OrderTrack
from femend.data.recording import Recording, Rotating, Test
from femend.data.remark import Remark
from femend.data.spectra import Spectra
from femend.data.speed import Speed
from femend.data.time_data import TimeData

__all__ = [
    "FRF",
    "Campbell",
    "Channel",
    "ComplexModes",
    "CriticalSpeed",
    "Geometry",
    "IdentifiedModes",
    "ModeSet",
    "ODS",
    "OrderTrack",
    "PoleSet",
    "Recording",
    "Remark",
    "Rotating",
    "Spectra",
    "Speed",
    "StabilityLimit",
    "Test",
    "TimeData",
]
