"""Files to data and back."""

from __future__ import annotations

from femend.io.atomic import OutputDirectory, refuse_unwritable, refuse_unwritable_file, write_atomic
from femend.io.channel_map import ChannelMap
from femend.io.op4 import Op4Matrix, read_op4, write_op4
from femend.io.recordings import read_modes, read_recording, read_recordings
from femend.io.uff import UniversalFile, functions_of, read_uff, write_uff

__all__ = [
    "ChannelMap",
    "Op4Matrix",
    "OutputDirectory",
    "UniversalFile",
    "functions_of",
    "read_modes",
    "read_op4",
    "read_recording",
    "read_recordings",
    "read_uff",
    "refuse_unwritable",
    "refuse_unwritable_file",
    "write_atomic",
    "write_op4",
    "write_uff",
]
