"""The virtual test without its effect: structure, truth, band, shaker, sensors and forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from . import excite, fe
from .effects import Unsuitable
from .excite import Force
from .plates import Plate, plate, twin_plates
from .solids import Solid, solid
from .structures import FAMILIES as FRAMES
from .structures import Structure
from .truth import Built, Damping, Real, build, nominal

LEVELS = {"low": 1.5, "mid": 4.5, "high": 10.0, "sweep": 5.0, "random": 7.0}
SECONDS = {"low": 6.0, "mid": 6.0, "high": 6.0, "sweep": 6.0, "random": 4.0}
FITTED = ("low", "mid", "high")


@dataclass
class Test:
    """The virtual test: structure, truth without effect, its damping, shaker, sensors, rate, band, forces and noise (of
    each channel's RMS); `across` is what each sensor picks up of motion in another axis, by place and axis, `gains`
    what the channels show of what they measure, the force first. Recordings that are fitted are `long` times as long as
    they usually are.
    """

    s: Structure
    real: Real
    plain: Built
    damping: Damping
    drive: tuple[int, int]
    sensors: list[tuple[int, int]]
    rate: float
    band: tuple[float, float]
    forces: dict[str, Force]
    excitation: str
    f_modes: np.ndarray
    noise: float
    across: dict[tuple[tuple[int, int], int], float] = field(default_factory=dict)
    gains: np.ndarray | None = None
    long: float = 1.0

    def seconds(self, name: str) -> float:
        """Length of a recording."""
        return seconds(name, self.long)


def seconds(name: str, long: float) -> float:
    """Length of a recording where those that are fitted are `long` times as long as usual."""
    return SECONDS[name] * (long if name in FITTED else 1.0)


def draw_real(rng: np.random.Generator, s: Structure, kind: str) -> Real:
    """How the truth departs from the deck. kind: "exact", "parameters", "model_form" or "" (with an effect)."""
    form = str(rng.choice(["timoshenko", "timoshenko", "lumped", "bernoulli"]))
    wide, scatter, lump = {"exact": (0.0, 0.0, 0.0), "model_form": (0.0, 0.02, 0.02)}.get(kind, (0.10, 0.007, 0.015))

    def near(sd: float) -> float:
        return float(np.clip(1 + sd * rng.standard_normal(), 1 - 2.2 * sd, 1 + 2.2 * sd))

    return Real(
        {p: near(wide) for p in s.groups},
        np.array([near(scatter) for _ in s.members]),
        {p: near(0.4 * lump) for p in s.groups},
        {n: near(lump) for n in s.lumps},
        form,
        int(rng.integers(3, 6)),
        0.0 if kind == "exact" else rng.uniform(0.0, 0.02),
    )


FAMILIES = {**FRAMES, "plate": plate, "solid": solid}
EXCITATIONS = ("multisine", "random", "burst", "sweep", "hammer")
# structures that do not take turns with the others, so that sets made before stay what they are
ALONE = {"twin plates": twin_plates}
USUAL_TOP = {
    "plate": (150.0, 300.0),
    "twin plates": (150.0, 300.0),
    "solid": (200.0, 420.0),
    "plane frame": (200.0, 300.0),
    "cantilever": (340.0, 425.0),
    "space frame": (120.0, 190.0),
}


def carried_modes(s: Structure) -> tuple[np.ndarray, float]:
    """Frequencies (Hz) of the deck on a fine mesh, and up to where the deck's own mesh follows within 0.4 %."""
    plain = nominal(s)
    coarse, _ = fe.modes(build(s, plain).system, 1500.0)
    if isinstance(s, Plate | Solid):
        return coarse / (2 * np.pi), min(s.carried, 425.0)
    plain.n_sub = 4
    fine, _ = fe.modes(build(s, plain).system, 1500.0)
    f, n = fine / (2 * np.pi), min(len(fine), len(coarse))
    bad = np.flatnonzero(np.abs(coarse[:n] / fine[:n] - 1) > 0.004)
    return f, float(min(f[bad[0]] * 0.95 if len(bad) else f[n - 1], 425.0))


def choose_band(rng: np.random.Generator, s: Structure) -> tuple[float, tuple[float, float]]:
    """Sampling rate and band: usual for the family or by a count of modes (4-10), as far as the deck's own mesh
    carries it.

    Raises Unsuitable when fewer than three modes remain.
    """
    f, top = carried_modes(s)
    if rng.random() < 0.6:
        hi = min(float(rng.uniform(*USUAL_TOP[s.family])), top)
    else:
        inside = int(np.sum(f < top))
        count = int(rng.integers(min(4, inside), min(10, inside) + 1))
        hi = min(1.12 * f[count - 1], top)
    if np.sum(f < 0.97 * hi) < 3:
        raise Unsuitable("too few modes")
    return (1024.0 if hi > 190.0 else 512.0), (float(rng.uniform(0.5, 0.8) * f[0]), float(hi))


def draw_forces(
    rng: np.random.Generator, band: tuple[float, float], rate: float, wanted: str = "", long: float = 1.0
) -> tuple[str, dict[str, Force]]:
    """Five forces; fit recordings are all multisines or all random, with fresh phases in each, or of the kind
    `wanted`; `long` times as long as usual."""
    kind = str(rng.choice(["multisine", "random"]))
    kind = wanted or kind
    lines = excite.odd_lines(rng, band)
    made: dict[str, Callable[[], Force]] = {
        "multisine": lambda: excite.multisine(rng, lines),
        "random": lambda: excite.noise(rng, band, rate, 6.0 * long),
        "burst": lambda: excite.burst(rng, band, rate, 6.0 * long),
        "sweep": lambda: excite.chirp(rng, band, 6.0 * long),
        "hammer": lambda: excite.hammer(rng, band, 6.0 * long),
    }
    out = {name: made[kind]() for name in ("low", "mid", "high")}
    f0 = band[0] * rng.uniform(1.1, 1.4)
    out["sweep"] = Force(sweep=(f0, max(band[1] * rng.uniform(0.45, 0.7), 3 * f0), 6.0))
    out["random"] = excite.noise(rng, (0.9 * band[0], band[1]), rate, 4.0)
    return kind, {k: excite.scaled(f, LEVELS[k], rate, seconds(k, long)) for k, f in out.items()}


def draw_across(rng: np.random.Generator, test: Test, sd: float) -> dict[tuple[tuple[int, int], int], float]:
    """Transverse sensitivities and mounting errors: shares of the motion in the other axes that sensors have."""
    others = [(place, c) for place in test.sensors for c in test.s.axes if c != place[1]]
    return {key: float(sd * rng.standard_normal()) for key in others} if sd > 0 else {}


def draw_gains(rng: np.random.Generator, test: Test, sd: float) -> np.ndarray | None:
    """Errors of calibration: what the channels show of what they measure, the force first."""
    return np.exp(sd * rng.standard_normal(1 + len(test.sensors))) if sd > 0 else None


def draw_test(
    rng: np.random.Generator,
    family: str,
    kind: str,
    noise: float,
    excitation: str = "",
    reach: float = 1.0,
    long: float = 1.0,
) -> Test:
    """Everything but the effect; the forces reach `reach` times as far as the band, to 0.45 of the rate at most;
    fit recordings are `long` times as long as usual."""
    s = (FAMILIES | ALONE)[family](rng)
    real = draw_real(rng, s, kind)
    plain = build(s, real)
    rate, band = choose_band(rng, s)
    w, phi = fe.modes(plain.system, 3000.0, 400)
    zeta = rng.uniform(0.006, 0.016, len(w)) * np.clip(w / (2 * np.pi * 1.5 * band[1]), 1.0, 2.0)
    places = [(n, c) for n in s.free for c in s.axes]
    drive = places[int(rng.integers(len(places)))]
    some = [places[i] for i in rng.choice(len(places), min(s.n_sensors, len(places)), replace=False)]
    kind_of, forces = draw_forces(
        rng, (band[0], max(band[1], min(reach * band[1], 0.45 * rate))), rate, excitation, long
    )
    names = {name: i for i, name in enumerate(plain.names)}
    return Test(
        s,
        real,
        plain,
        Damping(names, phi, zeta),
        drive,
        sorted({*some, drive}),
        rate,
        band,
        forces,
        kind_of,
        w / (2 * np.pi),
        noise,
        long=long,
    )
