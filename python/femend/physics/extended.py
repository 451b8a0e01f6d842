"""Laws beyond the names of the contract: tried where they are asked for, told under the contract's nearest name."""

from __future__ import annotations

from femend.physics.entry import Kind, Parameter, Physics

__all__ = ["EXTENDED"]

_K, _ONE, _LENGTH, _FORCE = (1, -1, 0), (0, 0, 0), (0, 1, 0), (1, 0, 0)
_TIME = (0, 0, 1)
# the tables below have many
_p = Parameter


def _law(
    name: str,
    family: str,
    left_out: str,
    kind: Kind,
    parameters: tuple[Parameter, ...],
    contract: str,
    simpler: tuple[str, ...] = (),
    *,
    nearest: bool = False,
) -> Physics:
    return Physics(
        name, family, left_out, name, kind, parameters, simpler,
        companion=kind == "nonlinear", extended=True, contract=contract, nearest=nearest,
    )  # fmt: skip


def _branches(n: int) -> tuple[Parameter, ...]:
    pairs = [(_p(f"k{i}", _K), _p(f"tau{i}", _TIME, shape=True)) for i in range(1, n + 1)]
    return (_p("k0", _K, "real"), *(p for pair in pairs for p in pair))


EXTENDED: tuple[Physics, ...] = (
    _law("generalised_maxwell", "damping", "stiffness that relaxes at two rates", "linear", _branches(2),
         "viscoelastic", ("viscoelastic", "support_stiffness")),
    _law("generalised_maxwell_3", "damping", "stiffness that relaxes at three rates", "linear", _branches(3),
         "viscoelastic", ("generalised_maxwell", "viscoelastic")),
    _law("fractional", "damping", "stiffness and loss that grow with a power of frequency", "linear",
         (_p("k", _K, "real"), _p("c", (1, -1, 1), exponent="alpha"), _p("alpha", _ONE, "fraction", shape=True)),
         "viscoelastic", ("viscous_damper", "support_stiffness")),
    _law("released_support", "stiffness", "what a model loses where a support gives way", "linear",
         (_p("g", _K, "real"),), "compliant_support", ("support_stiffness",)),
    _law("springpot", "damping", "the same loss at all frequencies, by a force that follows from the past", "linear",
         (_p("c", (1, -1, 1), exponent="alpha"), _p("alpha", _ONE, "fraction", shape=True)),
         "structural_damping", ("viscous_damper", "support_stiffness")),
    _law("box_spectrum", "damping", "the same loss at all frequencies, by relaxation at all rates", "linear",
         (_p("c", _K), _p("tau", _TIME, shape=True)),
         "structural_damping", ("viscous_damper", "support_stiffness")),
    _law("saturating_stiffness", "nonlinear elastic", "a spring whose force saturates", "nonlinear",
         (_p("k", _K, "real"), _p("d0", _LENGTH, shape=True)),
         "cubic_stiffness", ("support_stiffness",), nearest=True),
    _law("preloaded_contact", "nonlinear elastic", "a contact held closed by a static preload", "nonlinear",
         (_p("k", _K), _p("preload", _FORCE), _p("side", _ONE, "choice", shape=True)),
         "bilinear_stiffness", ("bilinear_stiffness", "support_stiffness")),
    _law("hertz_contact", "nonlinear elastic", "contact of curved bodies", "nonlinear",
         (_p("k", (1, -1.5, 0)), _p("gap", _LENGTH, shape=True), _p("sides", _ONE, "choice", shape=True)),
         "clearance", nearest=True),
    _law("play_friction", "hysteretic", "friction with a dead zone after every reversal", "nonlinear",
         (_p("f", _FORCE), _p("kt", _K), _p("gap", _LENGTH, shape=True)),
         "coulomb_friction", ("coulomb_friction", "clearance")),
    _law("sliding_friction", "hysteretic", "dry friction that creeps before it slides", "nonlinear",
         (_p("f", _FORCE), _p("v0", (0, 1, -1), shape=True)),
         "coulomb_friction", ("viscous_damper",)),
    _law("cubic_damping", "damping", "a force as v^3", "nonlinear", (_p("c", (1, -3, 3)),),
         "quadratic_damping", nearest=True),
    _law("displacement_damping", "damping", "a dashpot that grows with displacement", "nonlinear",
         (_p("c", (1, -1, 1)), _p("beta", (0, -2, 0), shape=True)),
         "quadratic_damping", ("viscous_damper",), nearest=True),
    _law("iwan", "hysteretic", "rate-independent hysteresis of any loop (surrogate)", "nonlinear",
         (*(_p(f"k{i}", _K) for i in range(1, 7)), _p("span", _LENGTH, "choice", shape=True)),
         "", ("coulomb_friction", "support_stiffness")),
    _law("free_form", "nonlinear elastic", "any smooth force over displacement and velocity (surrogate)", "nonlinear",
         (*(_p(f"fd{i}", _FORCE, "signed") for i in range(1, 9)),
          *(_p(f"fv{i}", _FORCE, "signed") for i in range(1, 7)),
          _p("d_span", _LENGTH, "choice", shape=True), _p("v_span", (0, 1, -1), "choice", shape=True)),
         ""),
)  # fmt: skip
