"""Sentences on a recording that know what they are about."""

from __future__ import annotations

__all__ = ["Remark"]


class Remark(str):
    """A sentence on a `recording`, or on a `channel` of it (its text, "" for the recording as a whole): what is `said`
    of it, and the `fault`, which is one for sentences that tell the same with other numbers.

    >>> told = Remark("run", "has an rms of 1e-9 N", "force 4:+Z (hammer)", "weak")
    >>> told, told.fault
    ("recording 'run': channel force 4:+Z (hammer) has an rms of 1e-9 N", 'weak')
    """

    recording: str
    said: str
    channel: str
    fault: str

    def __new__(cls, recording: str, said: str, channel: str = "", fault: str = "") -> Remark:
        where = f"channel {channel} " if channel else ""
        made = super().__new__(cls, f"recording {recording!r}: {where}{said}")
        made.recording, made.said, made.channel, made.fault = recording, said, channel, fault
        return made

    def __reduce__(self) -> tuple[type[Remark], tuple[str, str, str, str]]:
        return Remark, (self.recording, self.said, self.channel, self.fault)
