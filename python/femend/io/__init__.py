"""Files to data and back."""

from __future__ import annotations

from femend.io.channel_map import ChannelMap
from femend.io.recordings import read_recording, read_recordings
from femend.io.uff import UniversalFile, read_uff

__all__ = ["ChannelMap", "UniversalFile", "read_recording", "read_recordings", "read_uff"]
