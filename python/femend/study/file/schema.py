"""The study file key by key: what may stand where, and its default."""

from __future__ import annotations

import msgspec

from femend.study.file.bench_settings import CorrelationSettings, PretestSettings, UpdatingSettings
from femend.study.file.solver_settings import SolverSettings

__all__ = [
    "AddedMassTable",
    "CandidateTable",
    "ChannelTable",
    "ConfigurationTable",
    "CorrelationTable",
    "DampingTable",
    "FieldTable",
    "LinkTable",
    "ModelTable",
    "MorphTable",
    "ParameterTable",
    "PretestTable",
    "RecordingTable",
    "RotatingTable",
    "SolverTable",
    "SolverValueTable",
    "StructureTable",
    "StudyFile",
    "UnbalanceTable",
    "UpdatingTable",
    "VectorTable",
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


class UnbalanceTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """One entry of `unbalance`: `m_r`, mass times length of the model, at `node`, its direction at the tacho's angle 0
    `phase_deg` ahead of the axis that follows the shaft's, in the sense of rotation."""

    node: int
    m_r: float
    phase_deg: float


class RotatingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[recording.rotating]``: tacho channel, pulses per revolution (default 1), bearing nodes, shaft axis; the
    `unbalance` where it is known, and the `sense` of rotation (1 or -1), which `femend correlate` reads."""

    tacho: str
    nodes: list[int]
    axis: str
    pulses_per_revolution: float = 1.0
    unbalance: list[UnbalanceTable] = []
    sense: int | None = None


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


# what stands in the settings is the default here too
_CORRELATION, _UPDATING, _PRETEST = CorrelationSettings(), UpdatingSettings(), PretestSettings()
_SOLVER = SolverSettings()


class CorrelationTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[correlation]``: `band` in Hz of the modal test, least MAC of a pair, whether a turned or scaled test geometry
    is brought onto the model's; `femend correlate` and `femend update` read it. `orders` of a rotor's recordings are
    compared by `femend correlate` alone."""

    band: list[float] | None = None
    mac_min: float = _CORRELATION.mac_min
    align: bool = _CORRELATION.align
    orders: list[float] = msgspec.field(default_factory=lambda: list(_CORRELATION.orders))


class VectorTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """One entry of `vectors`: the `node` moves along `vector`, basic axes, for an amplitude of one."""

    node: int
    vector: list[float]


class MorphTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[updating.morph]]``: a position that `femend update` may change; which keys it takes depends on `move`."""

    name: str
    move: str
    prior_sd: float
    bounds: list[float] | None = None
    nodes: list[int] | None = None
    direction: list[float] | None = None
    held: list[int] | None = None
    radius: float | None = None
    properties: list[int] | None = None
    elements: list[int] | None = None
    point: list[float] | None = None
    axis: list[float] | None = None
    along: bool | None = None
    vectors: list[VectorTable] | None = None


class FieldTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[updating.field]]``: factors of parts that touch each other, which `femend update` holds alike; exactly one of
    `elements`, `elements_of`, `property_ids`, `materials` and `parameters` says what the parts are."""

    name: str
    neighbour_sd: float
    property: str | None = None
    elements: list[int] | None = None
    elements_of: list[int] | None = None
    property_ids: list[int] | None = None
    materials: list[int] | None = None
    parameters: list[str] | None = None
    neighbours: str = "touching"
    prior_sd: float | None = None
    bounds: list[float] | None = None


class LinkTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[updating.link]]``: a `parameter` that follows others, or has a value of its `own` in some configurations."""

    parameter: str
    to: list[str] = []
    powers: list[float] | None = None
    scale: float = 1.0
    own: bool = False
    configurations: list[str] = []


class StructureTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[updating.structure]]``: one of several nominally equal structures, and the recordings of it."""

    name: str
    recordings: list[str]


class UpdatingTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[updating]``: what `femend update` compares and how far it trusts it; deviations are relative."""

    responses: list[str] = msgspec.field(default_factory=lambda: list(_UPDATING.responses))
    modes: list[int] | None = None
    freq_sd: float = _UPDATING.freq_sd
    freq_far: float = _UPDATING.freq_far
    shape_sd: float = _UPDATING.shape_sd
    damping_sd: float = _UPDATING.damping_sd
    damping_model: str = _UPDATING.damping_model
    frf_sd: float = _UPDATING.frf_sd
    frf_lines: int = _UPDATING.frf_lines
    order_sd: float = _UPDATING.order_sd
    order_lines: int = _UPDATING.order_lines
    repeated: bool = _UPDATING.repeated
    iterations: int = _UPDATING.iterations
    starts: int = _UPDATING.starts
    posterior: str = _UPDATING.posterior
    draws: int = _UPDATING.draws
    seed: int = _UPDATING.seed
    morph: list[MorphTable] = []
    field: list[FieldTable] = []
    link: list[LinkTable] = []
    structure: list[StructureTable] = []
    response_surface: bool = _UPDATING.response_surface
    design_points: int | None = None
    regularisation: str | None = None
    strengths: list[float] | None = None


class CandidateTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """One entry of `distinguish`: a `parameter` of the study and its `change`, or `physics` with its place and size."""

    parameter: str | None = None
    physics: str | None = None
    node: int | None = None
    nodes: list[int] | None = None
    element: int | None = None
    direction: str | None = None
    directions: list[str] | None = None
    m: float | None = None
    k: float | list[float] | None = None
    c: float | None = None
    change: float | None = None


class SolverValueTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[[solver.value]]``: a field of the input files, its value, and how well that is known."""

    name: str
    value: float
    prior_sd: float = 0.10
    bounds: list[float] | None = None


class SolverTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[solver]``: the user's own solver, whose modes `femend update` meets in place of those of the deck."""

    command: str
    files: list[str]
    result: str
    value: list[SolverValueTable] = []
    format: str | None = None
    time_limit: float = _SOLVER.time_limit
    parallel: int = _SOLVER.parallel
    step: float = _SOLVER.step
    folder: str = _SOLVER.folder


class PretestTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """``[pretest]``: the test that `femend pretest` plans."""

    band: list[float] | None = None
    modes: list[int] | None = None
    configuration: str | None = _PRETEST.configuration
    sensors: int = _PRETEST.sensors
    method: str | None = _PRETEST.method
    nodes: list[int] | None = None
    leave_out: list[int] = []
    directions: list[str] = msgspec.field(default_factory=lambda: ["X", "Y", "Z"])
    placed: list[str] = []
    spacing: float = _PRETEST.spacing
    exciters: int = _PRETEST.exciters
    exciter_nodes: list[int] | None = None
    exciter_directions: list[str] | None = None
    freq_sd: float = _PRETEST.freq_sd
    shape_sd: float = _PRETEST.shape_sd
    damping_sd: float = _PRETEST.damping_sd
    sensor_mass: float = _PRETEST.sensor_mass
    distinguish: list[CandidateTable] = []
    virtual_test: bool = _PRETEST.virtual_test
    noise: float = _PRETEST.noise
    seed: int = _PRETEST.seed


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
    solver: SolverTable | None = None
    pretest: PretestTable = PretestTable()
