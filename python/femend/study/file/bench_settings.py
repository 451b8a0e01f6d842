"""What correlation, updating and the planning of a test are told in a study file, checked and with defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from femend.dof import Dof

__all__ = [
    "DAMPING_MODELS",
    "METHODS",
    "POSTERIORS",
    "RESPONSES",
    "RULES",
    "StructureSettings",
    "CandidateSettings",
    "CorrelationSettings",
    "FieldSettings",
    "LinkSettings",
    "MorphSettings",
    "PretestSettings",
    "UpdatingSettings",
]

Rule = Literal["gcv", "discrepancy", "l-curve"]
RESPONSES = ("frequencies", "shapes", "mac", "damping", "frfs", "orders")
DAMPING_MODELS = ("loss factor", "proportional")
POSTERIORS = ("laplace", "sampled")
# how a strength of the priors is chosen, by the rule's name in words
RULES = {"gcv": "generalised cross-validation", "discrepancy": "the discrepancy principle", "l-curve": "the L-curve"}
METHODS = ("parameters", "effective independence", "QR", "MAC", "Guyan")


@dataclass(frozen=True, slots=True)
class CorrelationSettings:
    """``[correlation]``: the modal test's `band` (low, high) in Hz or None for all that is measured, the MAC `mac_min`
    from which modes are a pair, whether to `align` a test geometry that is turned or scaled, and the `orders` of
    rotation in which a rotor's recordings are compared."""

    band: tuple[float, float] | None = None
    mac_min: float = 0.5
    align: bool = True
    orders: tuple[float, ...] = (1.0,)


@dataclass(frozen=True, slots=True)
class MorphSettings:
    """``[[updating.morph]]``: a position that may be updated, called `name`, with the 1-sigma `prior_sd` and the
    `bounds` of its amplitude.

    `move` says what moves, as `femend.model` has it: a "joint" (`joint_moved`: `nodes` along `direction`, members
    up to the `held` nodes after them), "nodes" (`nodes_moved`: others within `radius` after them), an "offset" of
    shells along their normals (`offset_along_normal`: `properties` or `elements`), a "growth" (`grown`: `nodes` away
    from `point`, from an `axis` through it, or `along` it), or "vectors" (`Morph.of`, one for each node). All vectors
    are in basic axes, lengths in the deck's unit.
    """

    name: str
    move: str
    prior_sd: float
    bounds: tuple[float, float] | None = None
    nodes: tuple[int, ...] = ()
    direction: tuple[float, float, float] | None = None
    held: tuple[int, ...] = ()
    radius: float | None = None
    properties: tuple[int, ...] = ()
    elements: tuple[int, ...] = ()
    point: tuple[float, float, float] | None = None
    axis: tuple[float, float, float] | None = None
    along: bool = False
    vectors: tuple[tuple[int, tuple[float, float, float]], ...] = ()


@dataclass(frozen=True, slots=True)
class FieldSettings:
    """``[[updating.field]]``: parts with a factor each on `property`, with the 1-sigma `prior_sd` and `bounds`, of
    which neighbours differ by `neighbour_sd`.

    The parts are `ids` of what `target` says: "elements", every element of properties ("elements_of"), "property_ids"
    or "materials"; or they are `parameters` that the study has by itself, with their own priors. Neighbours are those
    that touch, or with `in_order` each and the next.
    """

    name: str
    neighbour_sd: float
    property: str = ""
    target: str = "parameters"
    ids: tuple[int, ...] = ()
    parameters: tuple[str, ...] = ()
    in_order: bool = False
    prior_sd: float = 0.1
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """``[[updating.link]]``: in `configurations` (all where it is empty) `parameter` is `scale` times the product of
    what it is linked `to`, each to its power of `powers`.

    With `own`, `to` is one name that no parameter has: what the parameter is there, an unknown of its own.
    """

    parameter: str
    to: tuple[str, ...]
    powers: tuple[float, ...]
    scale: float = 1.0
    configurations: tuple[str, ...] = ()
    own: bool = False

    def holds_in(self, configuration: str) -> bool:
        """Does it hold in the `configuration` of this name?"""
        return not self.configurations or configuration in self.configurations


@dataclass(frozen=True, slots=True)
class StructureSettings:
    """``[[updating.structure]]``: one of several nominally equal structures by its `name`, with its `recordings`."""

    name: str
    recordings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class UpdatingSettings:
    """``[updating]``: the `responses` that are compared, the measured `modes` (numbers from 1; None: all), and their
    least deviations.

    Where no modes are named, those count whose mate in the model as it stands is within the share `freq_far` of their
    frequency. `damping_model` is what becomes unknown beside the parameters where damping or FRFs are compared: one
    "loss factor" of all stiffness, or the two of "proportional" damping. `freq_sd`, `damping_sd` are shares of the
    value, `shape_sd` of a shape's largest component, `frf_sd` of an FRF's magnitude, of which `frf_lines` lines count,
    `order_sd` of the largest value on a line of a rotor's run, of which `order_lines` count.
    `repeated` takes recordings of one configuration and the same sensors as one test done several times, whose scatter
    gives the deviations. `iterations` is the most the search takes.

    `starts` searches are made in all, the first from the deck as it stands, others from points between the bounds. The
    `posterior` is that of the search's end ("laplace"), or "sampled" as well, by so many `draws`. `seed` is that of the
    points and the draws. `morph` are positions that may change beside the study's parameters, `field` parts that may,
    neighbours alike, and `link` says which parameters follow others. `structure` are nominally equal structures that
    were tested, of which a population is told.

    With `response_surface` the models are solved at `design_points` points first (None: twice the terms of a full
    quadratic), and the search begins at the least point of a surface through the residuals. With `regularisation` the
    priors count as many times as that rule of `RULES` chooses among `strengths` (None: half decades from 1e-4 to 1e4).
    """

    responses: tuple[str, ...] = ("frequencies", "shapes")
    modes: tuple[int, ...] | None = None
    freq_sd: float = 0.001
    freq_far: float = 0.3
    shape_sd: float = 0.05
    damping_sd: float = 0.2
    damping_model: str = "loss factor"
    frf_sd: float = 0.3
    frf_lines: int = 40
    order_sd: float = 0.1
    order_lines: int = 40
    repeated: bool = False
    iterations: int = 60
    starts: int = 1
    posterior: str = "laplace"
    draws: int = 500
    seed: int = 0
    morph: tuple[MorphSettings, ...] = ()
    field: tuple[FieldSettings, ...] = ()
    link: tuple[LinkSettings, ...] = ()
    structure: tuple[StructureSettings, ...] = ()
    response_surface: bool = False
    design_points: int | None = None
    regularisation: Rule | None = None
    strengths: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class CandidateSettings:
    """An entry of ``[pretest] distinguish``: an explanation of what a test will show, and how large it is.

    A `parameter` of the study that is off by the share `size` (its prior deviation where the study says nothing), or
    `physics` the deck lacks: "added_mass" of `size` (mass of the model's units) at `node`, "support_stiffness" of
    `size` (force over length) from `node` to ground along `component` 1 to 3, "viscous_damper" of `size` (force over
    velocity) likewise, "joint_stiffness", the share `size` of the stiffness of `element`, or "compliant_support": what
    the deck holds at `nodes` gives way in the `components` 1 to 6, on springs `k` to each (force over length, moment
    over angle), or released where there are none.
    """

    parameter: str | None = None
    physics: str | None = None
    node: int | None = None
    element: int | None = None
    component: int = 0
    size: float = 1.0
    nodes: tuple[int, ...] = ()
    components: tuple[int, ...] = ()
    k: tuple[float, ...] | None = None

    @property
    def what(self) -> tuple[object, ...]:
        """What it is, whatever its size."""
        at = (self.node, self.element, self.component, self.nodes, self.components)
        return self.parameter, self.physics, *at, self.k is None


@dataclass(frozen=True, slots=True)
class PretestSettings:
    """``[pretest]``: target modes by `band` (Hz) or by number (`modes`, from 1), `sensors` in all with those `placed`,
    chosen by `method` among `nodes` (None: all) without `leave_out` in `directions`, on nodes no nearer to each
    other than `spacing` (in the model's unit), and `exciters` likewise.

    `freq_sd`, `shape_sd` and `damping_sd` are how well the test is going to tell frequencies, shapes and damping ratios
    (shares; of the last two dashpots are told, and the ratios' is that of modes alike too), `sensor_mass` what a sensor
    weighs, in the model's unit; the virtual test adds `noise` with `seed`. `distinguish` are explanations that
    the test is to tell apart.
    """

    band: tuple[float, float] | None = None
    modes: tuple[int, ...] | None = None
    configuration: str | None = None
    sensors: int = 8
    method: str | None = None
    nodes: tuple[int, ...] | None = None
    leave_out: tuple[int, ...] = ()
    directions: tuple[int, ...] = (1, 2, 3)
    placed: tuple[Dof, ...] = ()
    spacing: float = 0.0
    exciters: int = 1
    exciter_nodes: tuple[int, ...] | None = None
    exciter_directions: tuple[int, ...] | None = None
    freq_sd: float = 0.002
    shape_sd: float = 0.05
    damping_sd: float = 0.2
    sensor_mass: float = 0.0
    distinguish: tuple[CandidateSettings, ...] = ()
    virtual_test: bool = True
    noise: float = 0.02
    seed: int = 0
