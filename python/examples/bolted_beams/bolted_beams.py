"""Two bolted beams: which law of the joint makes a mode's frequency fall and its damping rise with amplitude.

The recording (backbone of the first bending mode at 20 Nm bolt torque) and the reduced finite element matrices (Balaji,
Rice University) are not part of this project. The script looks for `data/bolted_beams` in the folder FEMEND_SHARED,
else in `../shared` beside the project:

python python/examples/bolted_beams/bolted_beams.py [exchanged]

K holds the beams together by their bolts alone; the faces touch in four patches, whose mean relative motion is LamT' x.
A contact stiffness (its tangential share by Mindlin) and a damping ratio are fitted in every joint, and beside them
each law of the catalogue, the same at all patches, in the normal or the tangential directions. Frequency and damping at
a modal amplitude are those of the motion that repeats itself where damping proportional to mass makes up for what the
joint takes, by its first harmonic: a law stands for its describing function. Errors are relative errors of the pole, in
which frequency and damping ratio scatter alike in the recording. Eight stretches of the lower two thirds of the
amplitudes are fitted and kept for choosing in turn (`exchanged`: the other way round), the upper third is reported; a
joint with more parameters has to be better by what a diagnosis asks of a further law.

What comes out: the frequency falls elastically. A contact that softens (`saturating_stiffness`) predicts better than
every hysteretic law. Microslip by a power law, what is expected of such a joint, cannot be all of it: where it follows
the frequency, its damping rises three times as much as the recorded one.

What does not come out: what makes the damping rise. Hysteresis beside the softening is chosen (Jenkins' friction, not
told from Bouc and Wen's law and free Iwan elements), but slips at the highest fitted amplitudes only: its parameters
are smaller than their standard deviations, its damping is 18 % too high at the reported amplitudes, where a constant
one is 11 % too low, and with the stretches exchanged no second law is chosen. Of the softening, stiffness and reach are
hardly known by themselves. One mode tells neither normal from tangential laws nor one patch from another. Laws act
about the preloaded state as if it were no load; a shift of the mean is left out.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from femend.diagnose.settings import Settings
from femend.physics import catalogue

sys.path.insert(0, str(Path(__file__).parent))
from bolted_fit import EACH, Fit, Study, Term
from bolted_model import DIRECTIONS, MICROSLIP, Backbone, Beams

# parts of the amplitude range: so many equal blocks below two thirds of it, fitted and kept for choosing in turn, and
# above
BELOW, ABOVE = 8, 4


@dataclass(frozen=True, eq=False)
class Ranked:
    """A fit and its RMS error at the amplitudes kept for choosing."""

    fit: Fit
    error: float

    def told_from(self, best: Ranked) -> bool:
        """Whether its error is more than what a further law has to bring in a diagnosis."""
        return self.error > best.error * np.exp(Settings().gain_nonlinear)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Joints with one law and with a second one beside the first, best first; what is chosen of each; the joint without
    a law; microslip fitted to the frequency alone; and the backbones to fit, to choose and to report."""

    singles: list[Ranked]
    pairs: list[Ranked]
    first: Ranked
    final: Ranked
    linear: Ranked
    by_frequency: Fit
    study: Study
    parts: tuple[Backbone, Backbone, Backbone]

    def reported(self, fit: Fit) -> Backbone:
        """The joint at the amplitudes nobody has seen."""
        return self.study.backbone(fit, self.parts[2].Q)

    def alike(self) -> list[Ranked]:
        """Joints with two laws that the best one is not told from, but for the chosen one."""
        best = min((self.first, *self.pairs), key=lambda one: one.error)
        return [one for one in self.pairs if not one.told_from(best) and one is not self.final]

    def rise_of_damping(self) -> tuple[float, float]:
        """Mean damping ratio reported less the mean fitted: measured, and of microslip that follows the frequency."""
        fitted, _, reported = self.parts
        slip = self.study.backbone(self.by_frequency, fitted.Q).zeta.mean()
        own = self.reported(self.by_frequency).zeta.mean() - slip
        return float(reported.zeta.mean() - fitted.zeta.mean()), float(own)


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[4] / "shared")
    folder = root / "data" / "bolted_beams"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/bolted_beams")
    return folder


def read(file: Path) -> tuple[Backbone, Backbone, Backbone]:
    """Measured amplitudes to fit, to choose and to report, each the mean of a block's thirds."""
    content = loadmat(file)
    Q, freq, zeta = (content[name].ravel() for name in "QWZ")
    split = Q.min() + 2 / 3 * (Q.max() - Q.min())
    below, above = np.linspace(Q.min(), split, BELOW * EACH + 1), np.linspace(split, Q.max(), ABOVE * EACH + 1)
    edges = np.concatenate([below, above[1:]])
    bins = np.clip(np.searchsorted(edges, Q, side="right") - 1, 0, len(edges) - 2)
    mean = [np.array([x[bins == b].mean() for b in range(len(edges) - 1)]) for x in (Q, 2 * np.pi * freq, zeta)]
    block = np.arange(len(edges) - 1) // EACH
    fitted, chosen, reported = (block < BELOW) & (block % 2 == 0), (block < BELOW) & (block % 2 == 1), block >= BELOW
    a, b, c = (Backbone(*(x[part] for x in mean)) for part in (fitted, chosen, reported))
    return a, b, c


def picked(joints: Sequence[Ranked]) -> Ranked:
    """Of the joints that the best is not told from, the one with the fewest parameters."""
    best = min(joints, key=lambda one: one.error)
    return min((one for one in joints if not one.told_from(best)), key=lambda one: (one.fit.size, one.error))


def ranked(study: Study, chosen: Backbone, fits: Iterable[Fit | None]) -> list[Ranked]:
    """Fits by their error at the amplitudes kept for choosing."""
    known = [Ranked(fit, chosen.error(study.backbone(fit, chosen.Q))) for fit in fits if fit is not None]
    return sorted(known, key=lambda one: one.error)


def run(folder: Path, *, exchanged: bool = False, further: bool = True) -> Outcome:
    """Fits every law in every direction, then (`further`) a second one of another family beside the one chosen."""
    fitted, chosen, reported = read(folder / "ASB_C1_20Nm_BB.mat")
    if exchanged:
        fitted, chosen = chosen, fitted
    study = Study(Beams(folder / "MAT_NULLRED_C1.mat"), fitted, float(reported.Q.max()))
    # the library's laws: neither the free form, which has no name, nor those that somebody registered
    library = [
        law for law in catalogue(kind="nonlinear", extended=True) if not law.extended or law.contract is not None
    ]
    laws = [law for law in (*library, MICROSLIP) if law.name != "free_form"]
    terms = [Term(law, direction) for law in laws for direction in DIRECTIONS]
    (linear,) = ranked(study, chosen, [study.fit([])])
    singles = ranked(study, chosen, (study.fit([term]) for term in terms))
    first = picked([linear, *singles])
    families = {term.physics.family for term in first.fit.terms}
    others = [term for term in terms if further and term.physics.family not in families]
    pairs = ranked(study, chosen, (study.fit([*first.fit.terms, term], first.fit) for term in others))
    by_frequency = study.fit([Term(MICROSLIP, "normal")], damping=False)
    assert by_frequency is not None
    parts = fitted, chosen, reported
    return Outcome(singles, pairs, first, picked([first, *pairs]), linear, by_frequency, study, parts)


def told(outcome: Outcome, one: Ranked) -> str:
    """A line of the ranking: errors at the amplitudes fitted, kept for choosing and reported."""
    there, joint = outcome.parts[2], outcome.reported(one.fit)
    freq = float(np.mean(joint.omega / there.omega - 1))
    zeta = float(np.mean(joint.zeta / there.zeta - 1))
    return (
        f"{one.fit!s:58} {one.fit.size:2} {1e6 * one.fit.left:7.1f} {1e6 * one.error:7.1f}"
        f" {1e6 * there.error(joint):7.1f} {1e6 * freq:+8.1f} {100 * zeta:+7.1f} %"
    )


def main() -> None:
    """Prints the rankings, the chosen joint and what microslip would make of the damping."""
    outcome = run(data_folder(), exchanged="exchanged" in sys.argv[1:])
    fitted, _, reported = outcome.parts
    print(
        f"modal amplitude fitted up to {fitted.Q.max():.3g}, reported {reported.Q.min():.3g} to {reported.Q.max():.3g}"
    )
    print("joint; parameters; RMS error of the pole in 1e-6: fitted, chosen on, reported; there: frequency, damping")
    for one in (outcome.linear, *outcome.singles):
        print(told(outcome, one))
    print(f"chosen: {outcome.first.fit}; with a second law beside it")
    for one in outcome.pairs:
        print(told(outcome, one))
    final = outcome.final.fit
    print(f"chosen: {final}")
    print(f"normal contact stiffness {final.k:.3g} ± {final.k_sd:.2g} Pa/m, other damping {final.zeta0:.3g}")
    for term, values, sd in zip(final.terms, final.values, final.sd, strict=True):
        print(f"{term}:", ", ".join(f"{name} = {x:.3g} ± {sd[name]:.2g}" for name, x in values.items()), "(N, m)")
    print("not told from it:", "; ".join(str(one.fit) for one in outcome.alike()) or "none")
    rise, slip = outcome.rise_of_damping()
    print(f"rise of the damping ratio from fitted to reported: {rise:.3g}")
    print(f"of microslip that follows the frequency: {slip:.3g}")


if __name__ == "__main__":
    main()
