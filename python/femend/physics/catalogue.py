"""Every name of missing physics: its family, its parameters and the local law that stands for it in the core."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from femend.errors import LawParameterError
from femend.physics.entry import FAMILIES, Domain, Kind, Parameter, Physics
from femend.physics.extended import EXTENDED

__all__ = ["CATALOGUE", "FAMILIES", "Domain", "Kind", "Parameter", "Physics", "add", "catalogue", "physics", "selected"]

K, C, M = (1, -1, 0), (1, -1, 1), (1, -1, 2)
_ONE = (0, 0, 0)
# the table below has many
_p = Parameter

_ALL = (
    Physics("support_stiffness", "stiffness", "an elastic support or spring where the model has none",
            "support_stiffness", "linear", (_p("k", K, "real"),)),
    Physics("compliant_support", "stiffness", "a support modelled as fixed is elastic",
            "support_stiffness", "linear", (_p("k", K),)),
    Physics("joint_stiffness", "stiffness", "a connection modelled as rigid is flexible, or a member is weaker",
            "support_stiffness", "linear", (_p("k", K, "real"),)),
    Physics("spring_bending", "stiffness", "a spring modelled by translations alone also carries moments",
            "support_stiffness", "linear", (_p("k", K),)),
    Physics("added_mass", "inertia", "a mass that is not in the model", "added_mass", "linear", (_p("m", M, "real"),)),
    Physics("tuned_absorber", "inertia", "an attached oscillator", "tuned_absorber", "linear",
            (_p("m", M), _p("k", K), _p("c", C)), ("added_mass",)),
    Physics("viscous_damper", "damping", "a local dashpot", "viscous_damper", "linear", (_p("c", C),)),
    Physics("structural_damping", "damping", "local hysteretic loss", "structural_damping", "linear",
            (_p("k", K, "real"), _p("eta", _ONE, shape=True)), ("support_stiffness",)),
    Physics("viscoelastic", "damping", "stiffness that relaxes (Zener)", "viscoelastic", "linear",
            (_p("k0", K, "real"), _p("k1", K), _p("tau", (0, 0, 1), shape=True)),
            ("viscous_damper", "support_stiffness")),
    Physics("quadratic_damping", "damping", "a force as v*abs(v)", "quadratic_damping", "nonlinear",
            (_p("c", (1, -2, 2)),), companion=True),
    Physics("cubic_stiffness", "nonlinear elastic", "a force as x^3, either sign", "cubic_stiffness", "nonlinear",
            (_p("k3", (1, -3, 0), "real"),), companion=True),
    Physics("quadratic_stiffness", "nonlinear elastic", "a force as x^2", "quadratic_stiffness", "nonlinear",
            (_p("k2", (1, -2, 0), "real"),), companion=True),
    Physics("clearance", "nonlinear elastic", "contact after a gap, one- or two-sided", "clearance", "nonlinear",
            (_p("k", K), _p("gap", (0, 1, 0), shape=True), _p("sides", _ONE, "choice", shape=True)),
            ("bilinear_stiffness", "support_stiffness"), companion=True),
    Physics("bilinear_stiffness", "nonlinear elastic", "different stiffness in tension and compression, no gap",
            "bilinear_stiffness", "nonlinear", (_p("k_plus", K, "real"), _p("k_minus", K, "real")),
            ("support_stiffness",)),
    Physics("coulomb_friction", "hysteretic", "dry friction, elastic until slip (Jenkins)", "coulomb_friction",
            "nonlinear", (_p("f", (1, 0, 0)), _p("kt", K)), ("support_stiffness",), companion=True),
    Physics("bouc_wen", "hysteretic", "smooth hysteresis", "bouc_wen", "nonlinear",
            (_p("k", K), _p("alpha", _ONE, "fraction", shape=True), _p("n", _ONE, "above_one", shape=True),
             _p("beta", (0, -1, 0), shape=True, exponent="n"),
             _p("gamma", (0, -1, 0), "real", shape=True, exponent="n")),
            ("support_stiffness",), companion=True),
    Physics("gyroscopic", "speed", "gyroscopic coupling of a rotor", None, "other", (_p("Ip", (1, 1, 2)),)),
    Physics("speed_stiffness", "speed", "stiffness that changes with speed", None, "other", (_p("k", K, "real"),)),
    Physics("unmeasured_force", "load", "a force nobody recorded", None, "other"),
    Physics("base_motion", "load", "the ground moves", None, "other"),
    Physics("load_misplaced", "load", "the recorded force acts elsewhere or in another direction", None, "other"),
    Physics("unbalance_law", "load", "the assumed rotating load is wrong", None, "other"),
)  # fmt: skip

CATALOGUE: dict[str, Physics] = {entry.name: entry for entry in (*_ALL, *EXTENDED)}
_SELECTED: ContextVar[tuple[Physics, ...] | None] = ContextVar("laws of the catalogue that are tried", default=None)


def physics(name: str) -> Physics:
    """The entry of that name; raises LawParameterError with the nearest name.

    >>> physics("clearance").family
    'nonlinear elastic'
    >>> physics("generalised_maxwell").reported
    'viscoelastic'
    """
    try:
        return CATALOGUE[name]
    except KeyError:
        near = difflib.get_close_matches(name, CATALOGUE, n=1, cutoff=0.0)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise LawParameterError(f"no physics is called {name!r}{hint}", law=name) from None


def catalogue(
    *, kind: Kind | None = None, families: Iterable[str] | None = None, extended: bool | None = None
) -> tuple[Physics, ...]:
    """All entries that are a local law, optionally of one kind or some families only.

    `extended` False gives the laws that a diagnosis tries by itself, True all of them, with those whose name the
    contract does not have and those of one's own (every further law costs seconds); None those that are selected (see
    `selected`), else the default ones. Raises LawParameterError for a family that does not exist.

    >>> [entry.name for entry in catalogue(kind="nonlinear", families=["hysteretic"])]
    ['coulomb_friction', 'bouc_wen']
    >>> [entry.name for entry in catalogue(kind="nonlinear", families=["hysteretic"], extended=True)]
    ['coulomb_friction', 'bouc_wen', 'play_friction', 'sliding_friction', 'iwan']
    """
    wanted = set(FAMILIES if families is None else families)
    if not wanted <= set(FAMILIES):
        unknown = ", ".join(sorted(wanted - set(FAMILIES)))
        raise LawParameterError(f"no family is called {unknown}; families are {', '.join(FAMILIES)}")
    chosen = _SELECTED.get() if extended is None else None
    if chosen is None:
        chosen = tuple(entry for entry in CATALOGUE.values() if extended or not entry.extended)
    return tuple(
        entry
        for entry in chosen
        if entry.law is not None and entry.family in wanted and (kind is None or entry.kind == kind)
    )


@contextmanager
def selected(laws: Iterable[str | Physics] | str | None) -> Iterator[tuple[Physics, ...]]:
    """Within the block `catalogue()` gives these `laws` (names or entries) instead of the default ones; None changes
    nothing. "default" stands for the default ones and "all" for every law, those of one's own too; a text may name
    several with commas. Holds for the thread or task that enters it.

    Raises LawParameterError for a name that is none, or one that stands for no local law.

    >>> with selected(["cubic_stiffness", "play_friction"]):
    ...     [entry.name for entry in catalogue()]
    ['cubic_stiffness', 'play_friction']
    >>> with selected("default,hertz_contact"):
    ...     catalogue()[-1].name
    'hertz_contact'
    """
    before = _SELECTED.get()
    token = _SELECTED.set(before if laws is None else _named(laws))
    try:
        yield catalogue()
    finally:
        _SELECTED.reset(token)


def _named(laws: Iterable[str | Physics] | str) -> tuple[Physics, ...]:
    """The entries of `laws`, each once."""
    several = laws.split(",") if isinstance(laws, str) else laws
    found: dict[str, Physics] = {}
    for law in several:
        word = law.strip() if isinstance(law, str) else law
        if isinstance(word, str) and word in ("default", "all"):
            found |= {entry.name: entry for entry in catalogue(extended=word == "all")}
            continue
        entry = word if isinstance(word, Physics) else physics(word)
        if entry.law is None:
            raise LawParameterError(
                f"{entry.name} is no local law that can be selected: a diagnosis looks for it by itself where it can; "
                "leave it out",
                law=entry.name,
            )
        found[entry.name] = entry
    return tuple(found.values())


def add(entry: Physics) -> None:
    """Puts an `entry` of one's own into the catalogue, in place of an own one of that name.

    Raises LawParameterError for a name that the library has.
    """
    known = CATALOGUE.get(entry.name)
    if known is not None and known in (*_ALL, *EXTENDED):
        raise LawParameterError(f"{entry.name} is a law of the library; give yours another name", law=entry.name)
    CATALOGUE[entry.name] = entry
