"""The study file key by key: what may stand where, and its default."""

from __future__ import annotations

import msgspec

__all__ = [
    "AddedMassTable",
    "ChannelTable",
    "ConfigurationTable",
    "CorrelationTable",
    "DampingTable",
    "ModelTable",
    "ParameterTable",
    "PretestTable",
    "RecordingTable",
    "RotatingTable",
    "StudyFile",
    "UpdatingTable",
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


class CorrelationTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[correlation]``: `band` in Hz of the modal test, least MAC of a pair, whether a turned or scaled test geometry
    is brought onto the model's; `femend correlate` and `femend update` read it."""

    band: list[float] | None = None
    mac_min: float = 0.5
    align: bool = True


class UpdatingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[updating]``: what `femend update` compares and how far it trusts it; deviations are relative."""

    responses: list[str] = msgspec.field(default_factory=lambda: ["frequencies", "shapes"])
    modes: list[int] | None = None
    freq_sd: float = 0.001
    freq_far: float = 0.3
    shape_sd: float = 0.05
    damping_sd: float = 0.2
    damping_model: str = "loss factor"
    frf_sd: float = 0.3
    frf_lines: int = 40
    repeated: bool = False
    iterations: int = 60


class PretestTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[pretest]``: the test that `femend pretest` plans."""

    band: list[float] | None = None
    modes: list[int] | None = None
    configuration: str | None = None
    sensors: int = 8
    method: str | None = None
    nodes: list[int] | None = None
    leave_out: list[int] = []
    directions: list[str] = msgspec.field(default_factory=lambda: ["X", "Y", "Z"])
    placed: list[str] = []
    spacing: float = 0.0
    exciters: int = 1
    exciter_nodes: list[int] | None = None
    exciter_directions: list[str] | None = None
    freq_sd: float = 0.002
    shape_sd: float = 0.05
    sensor_mass: float = 0.0
    virtual_test: bool = True
    noise: float = 0.02
    seed: int = 0


class StudyFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """The whole file."""

    format: str
    model: ModelTable
    title: str = ""
    damping: DampingTable = DampingTable()
    parameter: list[ParameterTable] = []
    configuration: list[ConfigurationTable] = []
    recording: list[RecordingTable] = []
    correlation: CorrelationTable = CorrelationTable()
    updating: UpdatingTable = UpdatingTable()
    pretest: PretestTable = PretestTable()
