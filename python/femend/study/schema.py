"""The study file key by key: what may stand where, and its default."""

from __future__ import annotations

import msgspec

__all__ = [
    "AddedMassTable",
    "ChannelTable",
    "ConfigurationTable",
    "DampingTable",
    "ModelTable",
    "ParameterTable",
    "RecordingTable",
    "RotatingTable",
    "StudyFile",
]


class ModelTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[model]``: the deck's `file` and its consistent `units` (SI, mm-t-s or in-lbf-s; default SI)."""

    file: str
    units: str = "SI"


class DampingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[damping]``: starting modal damping `ratio` of every mode (default 0.01)."""

    ratio: float = 0.01


class ParameterTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[parameter]]``: a `property` of exactly one target, relative `prior_sd` (default 0.10) and `bounds`."""

    name: str
    property: str
    material: int | None = None
    property_id: int | None = None
    elements: list[int] | None = None
    mass: int | None = None
    prior_sd: float = 0.10
    bounds: list[float] | None = None


class AddedMassTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """One entry of `added_mass`: `m`, in the model's mass unit, at `node`."""

    node: int
    m: float


class ConfigurationTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[configuration]]``: the deck's SPC set `spc`, masses added, a note."""

    name: str
    spc: int | None = None
    added_mass: list[AddedMassTable] = []
    note: str = ""


class RotatingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[recording.rotating]``: tacho channel, pulses per revolution (default 1), bearing nodes, shaft axis."""

    tacho: str
    nodes: list[int]
    axis: str
    pulses_per_revolution: float = 1.0


class ChannelTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[recording.channel]]``: a column of a file that does not carry node and direction itself."""

    quantity: str
    unit: str
    source: int | str | None = None
    node: int | None = None
    direction: str | None = None
    scale: float = 1.0


class RecordingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[recording]]``: `role` defaults to fit, `excitation` to measured, `configuration` to "as modelled"."""

    name: str
    file: str
    role: str = "fit"
    excitation: str = "measured"
    configuration: str | None = None
    rotating: RotatingTable | None = None
    channel: list[ChannelTable] = []


class StudyFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """The whole file."""

    format: str
    model: ModelTable
    title: str = ""
    damping: DampingTable = DampingTable()
    parameter: list[ParameterTable] = []
    configuration: list[ConfigurationTable] = []
    recording: list[RecordingTable] = []
