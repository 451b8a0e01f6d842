"""The GARTEUR SM-AG19 testbed, an aeroplane-like structure of 44 kg, updated on its eight published frequencies.

python python/examples/garteur/garteur.py [OUT]

`model.bdf` is built from the published drawing alone (`garteur_deck.py` writes it), `modes.csv` holds the frequencies
of participant C of the round robin. Nine parameters have priors from what is known before a test; that they meet eight
frequencies proves nothing. What tells is at the end: each frequency predicted from the other seven, and damping, which
is not fitted at all, against what the damping layer can give at most. With OUT the updated deck is written there.

Balmes, Wright: GARTEUR group on ground vibration testing, results from the test of a single structure by 12
laboratories in Europe, ASME DETC 1997 (drawing, figure 5: modes). Gravelle (ed.): GARTEUR TP-115, 1999. Both were read
as the public tutorials of FinEtoolsFlexStructures.jl and pystran (P. Krysl) reproduce them. The benchmark of updating:
Link, Friswell, Mech. Syst. Signal Process. 17 (2003) 9-20.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from math import log
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating import (
    Configuration,
    Evaluation,
    Frequencies,
    Link,
    ModeTest,
    Problem,
    Unknowns,
    UpdateResult,
    deck_system,
    factor,
    sensitivities,
    update,
    updated_deck,
)
from femend.model import Model, Parameter, read_model

sys.path.insert(0, str(Path(__file__).parent))
from garteur_classes import SENSORS, Measured, classify, read_measured
from garteur_deck import THICK_LAYER, deck

HERE = Path(__file__).parent
FloatArray = NDArray[np.float64]

# six motions on the bungees, the eight, and those above to pair with
N_MODES = 22
# of a measured frequency; one laboratory's repeatability, no statement of the source
FREQUENCY_SD = 0.003
# "known to a factor of 3"
ORDER = log(3.0)
# no damping polymer of this kind loses more
LOSS_FACTOR = 1.0

LAYER = (41, 42, 43, 44)
# fields of the deck that change together: name, property, target, ids; and the unknown, with its power
FIELDS: tuple[tuple[Parameter, str, float], ...] = (
    (Parameter("E", "E", "material", (1,)), "aluminium E", 1.0),
    *((Parameter(f"layer k{k}", f"k{k}", "property_id", LAYER), "layer shear", 1.0) for k in (1, 2, 6)),
    *(
        (Parameter(f"wing {q}", q, "property_id", (2,)), "wing thickness", p)
        for q, p in (("A", 1.0), ("I1", 3.0), ("I2", 1.0), ("J", 3.0))
    ),
    *((Parameter(f"root {q}", q, "property_id", (7,)), "wing over plate", 1.0) for q in ("I1", "I2", "J")),
    *((Parameter(f"wing joint k{k}", f"k{k}", "property_id", (11,)), "wing joint, bending", 1.0) for k in (4, 5)),
    (Parameter("wing joint k6", "k6", "property_id", (11,)), "wing joint, in plane", 1.0),
    (Parameter("fin joint k4", "k4", "property_id", (13,)), "fin joint", 1.0),
    (Parameter("drum masses", "m", "mass", (902, 903)), "drum masses", 1.0),
    (Parameter("tail mass", "m", "mass", (904,)), "tail mass", 1.0),
)
PRIORS = (
    # spread of aluminium alloys, 69 to 74 GPa
    factor("aluminium E", 0.02, (0.9, 1.1)),
    # temperature, batch and frequency, 5 to 60 Hz
    factor("layer shear", ORDER, (0.05, 20.0), logarithmic=True),
    # rolled plate of 10 mm: 0.1 mm
    factor("wing thickness", 0.01, (0.95, 1.05)),
    # between the wing alone and both glued, 0.17 to 5.8 in I1 and 0.30 to 3.4 in I2: two deviations to either side
    factor("wing over plate", 0.8, (0.1, 10.0), logarithmic=True),
    factor("wing joint, bending", ORDER, (0.03, 30.0), logarithmic=True),
    factor("wing joint, in plane", ORDER, (0.03, 30.0), logarithmic=True),
    factor("fin joint", ORDER, (0.03, 30.0), logarithmic=True),
    # 200 g and the sensors, cables and bolts beside it
    factor("drum masses", 0.25, (0.2, 2.0)),
    # two angles, and sensors and cables on the tail
    factor("tail mass", 0.25, (0.2, 2.0)),
)


def model_of(path: Path) -> Model:
    """A deck of the testbed with all fields that may change."""
    return read_model(path, parameters=[p for p, _, _ in FIELDS])


def modes_of(model: Model) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) and shapes at the sensors."""
    state = deck_system(model, SENSORS, N_MODES).solve(np.ones(len(FIELDS)))
    return state.value("freq"), state.value("phi")


def problem_of(measured: Measured, path: Path = HERE / "model.bdf") -> Problem:
    """The problem of a deck and the measured modes.

    A measured mode is paired by the shape that the deck as it is gives its class; shapes pair and are not fitted."""
    model = model_of(path)
    freq, phi = modes_of(model)
    found = classify(freq, phi)
    shapes = phi[:, [found[c] for c in measured.classes]]
    f = measured.freq
    links = {p.name: Link(((unknown, power),)) for p, unknown, power in FIELDS}
    test = ModeTest(f, shapes / np.abs(shapes).max(axis=0))
    system = deck_system(model, SENSORS, N_MODES)
    responses = (Frequencies(f, FREQUENCY_SD * f, "logarithm"),)
    return Problem(Unknowns.of(PRIORS), (Configuration("testbed", system, responses, test, links),))


def classes_kept(measured: Measured, at: Evaluation) -> bool:
    """Whether every measured mode's mate is the mode of its class there."""
    state, mates = at.states[0], at.mates[0]
    assert mates is not None
    found = classify(state.value("freq"), state.value("phi"))
    return [found.get(c) for c in measured.classes] == mates.mate.tolist()


def changes(result: UpdateResult) -> dict[str, float]:
    """Factors on the deck's fields by the name of their parameter."""
    return dict(zip((p.name for p, _, _ in FIELDS), result.problem.factors(result.p, 0).tolist(), strict=True))


@dataclass(frozen=True)
class LeftOut:
    """A mode predicted (Hz) from the others, with the deviation (Hz) that these and the priors leave it."""

    freq: float
    predicted: float
    sd: float


def leave_one_out(measured: Measured, problem: Problem) -> list[LeftOut]:
    """Every mode from the other seven."""
    out = []
    for i, f in enumerate(measured.freq.tolist()):
        (c,) = problem.configurations
        rest = [k for k in range(measured.freq.size) if k != i]
        assert c.test is not None
        assert c.test.phi is not None
        few = replace(
            c,
            responses=(Frequencies(measured.freq[rest], FREQUENCY_SD * measured.freq[rest], "logarithm"),),
            test=ModeTest(measured.freq[rest], c.test.phi[:, rest]),
        )
        found = update(replace(problem, configurations=(few,)))
        there = problem.evaluate(found.p, slopes=True)
        mates, slopes = there.mates[0], there.jacobian
        assert mates is not None
        assert slopes is not None
        row = slopes[int(np.flatnonzero(mates.test == i)[0])]
        sd = FREQUENCY_SD * f * float(np.sqrt(row @ found.covariance @ row + 1.0))
        out.append(LeftOut(f, float(there.states[0].value("freq")[mates.mate[i]]), sd))
    return out


def layer_damping(problem: Problem, at: Evaluation) -> FloatArray:
    """Damping ratios (n_modes,) of the measured modes from the layer alone with the loss factor: half of it times the
    share of the strain energy (Johnson and Kienholz, AIAA J. 20, 1982), which is 2 d ln f / d ln k."""
    names = [p.name for p, _, _ in FIELDS]
    rows = [i for i, n in enumerate(names) if n.startswith("layer")]
    factors, mates = problem.factors(at.p, 0), at.mates[0]
    assert mates is not None
    f = at.states[0].value("freq")[mates.mate]
    slope = (at.states[0].slope("freq")[rows] * factors[rows, None])[:, mates.mate].sum(axis=0)
    return np.asarray(LOSS_FACTOR * slope / f)


def table(measured: Measured, result: UpdateResult) -> str:
    """Initial and updated errors of all modes."""
    lines = [f"{'mode':35} {'measured':>8} {'initial':>8} {'error %':>8} {'updated':>8} {'error %':>8}"]
    for m, name in zip(result.modes(), measured.names, strict=True):
        errors = [100 * (f / m.freq - 1) for f in (m.freq_before, m.freq_after)]
        values = (m.freq, m.freq_before, errors[0], m.freq_after, errors[1])
        lines.append(f"{m.mode} {name:33} " + " ".join(f"{v:8.2f}" for v in values))
    return "\n".join(lines)


def parameters(result: UpdateResult) -> str:
    """Priors beside what was found; "prior" where the data took away less than half of the prior variance."""
    told = set(result.determined())
    sd = result.problem.unknowns.value_sd(result.problem.unknowns.mean, np.diag([u.sd**2 for u in PRIORS]))
    lines = [f"{'parameter':22} {'prior sd':>9} {'found':>7} {'sd':>7} {'prior sds':>10}  told by"]
    for r, before, u in zip(result.parameters(), sd, PRIORS, strict=True):
        known = f"x {np.exp(u.sd):.1f}" if u.positive else f"{before:.2f}"
        by = "data" if r.name in told else "prior"
        lines.append(f"{r.name:22} {known:>9} {r.value:7.3f} {r.sd:7.3f} {r.z:10.2f}  {by}")
    return "\n".join(lines)


def held_out(measured: Measured, problem: Problem, result: UpdateResult) -> str:
    """What was not fitted: each mode from the others, damping, and modes that nobody published."""
    lines = ["each mode from the other seven:"]
    left = leave_one_out(measured, problem)
    for k, o in enumerate(left, 1):
        error, z = 100 * (o.predicted / o.freq - 1), (o.predicted - o.freq) / o.sd
        lines.append(
            f"{k} {o.freq:8.2f} Hz: {o.predicted:6.2f}, {error:5.2f} % with sd {100 * o.sd / o.freq:.2f} % ({z:.1f} sd)"
        )
    before = [m.freq_before / m.freq - 1 for m in result.modes()]
    rms = [100 * float(np.sqrt(np.mean(np.square(e)))) for e in (before, [o.predicted / o.freq - 1 for o in left])]
    spread = float(np.sqrt(np.mean([((o.predicted - o.freq) / o.sd) ** 2 for o in left])))
    lines.append(f"rms {rms[1]:.2f} % (initial model: {rms[0]:.2f} %), {spread:.1f} of their own deviations")
    lines.append("\ndamping %, measured and at most from the layer:")
    bound = layer_damping(problem, result.after)
    for k, (zeta, most) in enumerate(zip(measured.damping, bound, strict=True), 1):
        lines.append(f"{k} {100 * zeta:5.2f} {100 * most:5.2f}")
    lines.append("")
    for when, e in (("initial", result.before), ("updated", result.after)):
        f, mates = e.states[0].value("freq"), e.mates[0]
        above = [x for k, x in enumerate(f) if mates is not None and k not in mates.mate and x > measured.freq[0]]
        lines.append(f"next modes, {when}: " + " ".join(f"{x:.1f}" for x in above[:6]) + " Hz")
    return "\n".join(lines)


def other_reading(measured: Measured) -> UpdateResult:
    """The same with the other reading of the damping treatment, a thick layer below a thinner sheet."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.bdf"
        path.write_text(deck(THICK_LAYER), encoding="ascii")
        return update(problem_of(measured, path))


def main() -> None:
    """Prints errors before and after, parameters, and what speaks for or against the result."""
    measured = read_measured(HERE / "modes.csv")
    problem = problem_of(measured)
    print(sensitivities(problem), "\n")
    result = update(problem)
    print(f"{result.status} after {len(result.history) - 1} steps\n{table(measured, result)}")
    kept = "every mode has its published class" if classes_kept(measured, result.after) else "CLASSES CHANGED"
    print("\n".join([*(n for step in result.history for n in step.notes), kept]))
    print(f"\n{parameters(result)}\nleft the prior: {', '.join(result.left_prior()) or 'none'}\n")
    print(held_out(measured, problem, result))
    other = other_reading(measured)
    errors = [100 * abs(m.freq_after / m.freq - 1) for m in other.modes()]
    away = ", ".join(f"{r.name} {r.z:+.1f}" for r in other.parameters() if r.name in other.left_prior())
    print(f"\nlayer of 1.1 mm: largest error {max(errors):.2f} %, prior sds of what left its prior: {away}")
    print(f"squared deviations and prior: {other.after.cost:.1f}, as drawn {result.after.cost:.1f}")
    if len(sys.argv) > 1:
        new = updated_deck(model_of(HERE / "model.bdf"), changes(result))
        print(f"\n{new.diff}", *new.write(sys.argv[1]), sep="\n")


if __name__ == "__main__":
    main()
