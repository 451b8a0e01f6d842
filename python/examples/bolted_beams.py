"""Two bolted beams: which law of the joint makes a mode's frequency fall and its damping rise with amplitude.

The recording (backbone of the first bending mode at 20 Nm bolt torque) and the reduced finite element matrices (Balaji,
Rice University) are not part of this project. The script looks for `data/bolted_beams` in the folder FEMEND_SHARED,
else in `../shared` beside the project:

python python/examples/bolted_beams.py [exchanged]

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
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.linalg import eigh
from scipy.optimize import least_squares, lsq_linear

from femend.diagnose.settings import Settings
from femend.errors import LawParameterError
from femend.physics import FitCoordinates, Parameter, Physics, Shape, catalogue, physics, shapes
from femend.physics.harmonic import describing_function
from femend.physics.nested_extended import IWAN_GRID

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# parts of the amplitude range: so many equal blocks below two thirds of it, fitted and kept for choosing in turn, and
# above; amplitudes of each block
BELOW, ABOVE, EACH = 8, 4, 3
# tangential over normal stiffness of elastic bodies that touch, 2 (1 - nu) / (2 - nu) (Mindlin 1949), steel
MINDLIN = 2 * (1 - 0.3) / (2 - 0.3)
# directions of a patch in which a law may act, by their columns
DIRECTIONS: dict[str, tuple[int, ...]] = {"tangential": (0, 1), "normal": (2,)}
# amplitudes at which a describing function is tabled, and the decades it spans
TABLE, DECADES = 28, 2.8
# microslip as joints are known for: the catalogue's friction elements in parallel, their slip limits distributed by a
# power law up to `reach`, so that the loss of a cycle grows with the amplitude to the power 1 + `power` (Segalman 2005)
MICROSLIP = Physics(
    "power_law_microslip", "hysteretic", "microslip", "iwan", "nonlinear",
    (Parameter("k", (1, -1, 0)), Parameter("reach", (0, 1, 0), shape=True),
     Parameter("power", (0, 0, 0), "above_one", shape=True)),
)  # fmt: skip
# starts that are fitted, out of shapes and shares of the law that first-order perturbation suggests
STARTS, SHARES = 2, (1.0, 0.4, 0.15)


@dataclass(frozen=True, eq=False)
class Backbone:
    """Modal amplitude Q (kg^0.5 m), circular frequency omega (rad/s) and damping ratio zeta, each (n,)."""

    Q: FloatArray
    omega: FloatArray
    zeta: FloatArray

    def error(self, other: Backbone) -> float:
        """RMS distance of the poles of `other` from these, relative to their size."""
        return float(np.sqrt(np.mean((other.omega / self.omega - 1) ** 2 + (other.zeta - self.zeta) ** 2)))


@dataclass(frozen=True, eq=False)
class Term:
    """A law at all patches in one direction."""

    physics: Physics
    direction: str

    def __str__(self) -> str:
        return f"{self.physics.name}, {self.direction}"


@dataclass(frozen=True, eq=False)
class Fit:
    """A joint: normal stiffness k (Pa/m) of the contact, damping ratio zeta0 of all else, laws with values and sd."""

    terms: tuple[Term, ...]
    values: tuple[Mapping[str, float], ...]
    k: float
    zeta0: float
    left: float
    sd: tuple[Mapping[str, float], ...]
    k_sd: float

    @property
    def size(self) -> int:
        """Parameters of the laws."""
        return sum(p.domain != "choice" for term in self.terms for p in term.physics.parameters)

    def __str__(self) -> str:
        return " + ".join(str(term) for term in self.terms) or "linear"


class Beams:
    """The reduced model: K, M, patches' mean relative motion T' x, and the mode that was measured."""

    def __init__(self, file: Path) -> None:
        content = loadmat(file)
        self.K, self.M = (np.ascontiguousarray(content[name], dtype=float) for name in "KM")
        patches, dofs = int(content["Npatches"].item()), int(content["dofred"].item())
        columns = [dofs * patch + axis for patch in range(patches) for axis in range(3)]
        self.T = np.ascontiguousarray(content["LamT"][:, columns], dtype=float)
        self.area = content["PatchAreas"].ravel().repeat(3)
        self.share = np.tile([MINDLIN, MINDLIN, 1.0], patches)

    def linear(self, k: float) -> FloatArray:
        """Stiffness matrix with the contact's springs."""
        return self.K + (self.T * (k * self.area * self.share)) @ self.T.T

    def modes(self, k: float) -> tuple[FloatArray, FloatArray]:
        """Squares of the circular frequencies (n,) and mass-normalised shapes (38, n), without damping."""
        lam, phi = eigh(self.linear(k), self.M)
        return lam, phi

    def columns(self, direction: str) -> NDArray[np.intp]:
        """Columns of T for a direction at all patches."""
        at = DIRECTIONS[direction]
        return np.array([i for i in range(self.T.shape[1]) if i % 3 in at])

    def backbone(
        self, k: float, laws: Sequence[tuple[NDArray[np.intp], Table]], Q: FloatArray, start: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """omega and zeta of the mode nearest to `start` (38,) at amplitudes Q: the motion repeats itself where damping
        proportional to mass takes back what the laws take (extended periodic motion), by its first harmonic.

        (K + T kappa(A) T' - lambda M) phi = 0 with A = Q |T' phi|, by inverse iteration with Rayleigh quotients; the
        imaginary part of kappa enters in first order, to some 1e-6 of the complex eigenvalue.
        """
        base = self.linear(k)
        phi = np.tile(start, (len(Q), 1))
        lam = np.full(len(Q), np.nan)
        for _ in range(40):
            stiffness = np.tile(base, (len(Q), 1, 1))
            loss = np.zeros(len(Q))
            for at, table in laws:
                d = phi @ self.T[:, at]
                kappa = table(Q[:, None] * np.abs(d))
                stiffness += (self.T[:, at] * kappa.real[:, None, :]) @ self.T[:, at].T
                loss += (kappa.imag * d**2).sum(axis=1)
            new = np.einsum("qi,qij,qj->q", phi, stiffness, phi)
            if np.all(np.abs(new - lam) < 1e-11 * np.abs(new)):
                break
            lam = new
            shifted = stiffness - (lam * (1 - 1e-9))[:, None, None] * self.M
            phi = np.linalg.solve(shifted, (phi @ self.M)[:, :, None])[:, :, 0]
            phi /= np.sqrt(np.einsum("qi,ij,qj->q", phi, self.M, phi))[:, None]
        lam = np.maximum(lam, 1.0)
        return np.sqrt(lam), loss / (2 * lam)


class Table:
    """Describing function (N/m) of a law, interpolated over the logarithm of the amplitude up to `top` (m)."""

    def __init__(self, law: Physics, values: Mapping[str, float], top: float, omega: float) -> None:
        at = np.geomspace(top * 10**-DECADES, top, TABLE)
        if law is MICROSLIP:
            law, values = physics("iwan"), elements(values)
        self.at, self.kappa = np.log(at), describing_function(law, values, at, omega)

    def __call__(self, A: FloatArray) -> ComplexArray:
        x = np.log(np.maximum(A, 1e-30))
        return np.interp(x, self.at, self.kappa.real) + 1j * np.interp(x, self.at, self.kappa.imag)


def elements(values: Mapping[str, float]) -> dict[str, float]:
    """The catalogue's friction elements of a power-law microslip."""
    weights = [limit ** (values["power"] - 1) for limit in IWAN_GRID]
    slopes = {f"k{i}": values["k"] * weight / sum(weights) for i, weight in enumerate(weights, 1)}
    return {**slopes, "span": values["reach"]}


def started(law: Physics, top: float, omega: float) -> list[Shape]:
    """Shapes of a law up to the amplitude `top`; microslip starts with reaches on both sides of it."""
    if law is not MICROSLIP:
        return shapes(law, amplitude=top, band=(omega / 1.1, omega * 1.1))
    grid = [{"k": 1.0, "reach": reach * top, "power": power} for reach in (0.5, 1.5, 5.0) for power in (1.3, 2.0)]
    return [Shape(law, (values,), (("k",),)) for values in grid]


class Study:
    """Fits of joints to a `measured` backbone, for amplitudes up to `reach` (kg^0.5 m)."""

    def __init__(self, beams: Beams, measured: Backbone, reach: float) -> None:
        self.beams, self.measured, self.reach = beams, measured, reach
        self.omega = float(measured.omega.mean())
        self.k, self.phi = self._linear()
        self.lam = self._bending(self.k)[0]

    def _linear(self) -> tuple[float, FloatArray]:
        """The contact stiffness at which a linear joint has the mean frequency, and the shape there.

        The mode is the lowest in which the faces open most, the first that bends both beams.
        """
        grid = np.geomspace(1e9, 1e12, 61)
        lowest = [self._bending(k)[0] for k in grid]
        k = float(np.exp(np.interp(self.omega, np.sqrt(lowest), np.log(grid))))
        for _ in range(3):
            lam, phi = self._bending(k)
            slope = self._slope(phi)
            k += (self.omega**2 - lam) / slope
        return k, self._bending(k)[1]

    def _bending(self, k: float) -> tuple[float, FloatArray]:
        lam, phi = self.beams.modes(k)
        return float(lam[0]), phi[:, 0]

    def _slope(self, phi: FloatArray) -> float:
        """Derivative of lambda over the contact stiffness."""
        return float(((self.beams.T.T @ phi) ** 2) @ (self.beams.area * self.beams.share))

    def top(self, term: Term) -> float:
        """Largest displacement amplitude (m) of a patch in the term's direction."""
        d = np.abs(self.phi @ self.beams.T[:, self.beams.columns(term.direction)])
        return float(self.reach * d.max())

    def starts(self, term: Term, fixed: ComplexArray) -> list[tuple[dict[str, float], float]]:
        """Values of the shapes that follow the backbone best by first-order perturbation, each with the contact
        stiffness beside it; `fixed` (n,) is what other laws add to lambda. Empty where the law has no say."""
        lam = self.measured.omega**2 * (1 + 2j * self.measured.zeta) - fixed
        unit = np.ones(len(lam))
        found: list[tuple[float, Shape, FloatArray, float]] = []
        for shape in started(term.physics, self.top(term), self.omega):
            parts = [self._first_order(term, values) for values in shape.terms]
            columns = np.array([unit + 0j, 1j * unit, *parts])
            A = np.hstack([columns.real, columns.imag]).T
            scale = np.linalg.norm(A, axis=0)
            if not (np.isfinite(scale).all() and (scale > 0).all()):
                continue
            low = [-np.inf, 0.0, *[-np.inf if term.physics.signed else 0.0] * len(parts)]
            solved = lsq_linear(A / scale, np.hstack([lam.real, lam.imag]), bounds=(low, np.inf), method="bvls")
            factors = np.maximum(solved.x[2:], low[2:]) / scale[2:]  # round-off may leave one below its bound
            if (factors != 0).any():
                found.append((solved.cost, shape, factors, solved.x[0] / scale[0] - self.lam))
        found.sort(key=lambda item: item[0])
        return [
            (
                shape.values((share * factors).tolist()),
                max(self.k + share * shift / self._slope(self.phi), 0.1 * self.k),
            )
            for _, shape, factors, shift in found[:STARTS]
            for share in SHARES
        ]

    def _first_order(self, term: Term, values: Mapping[str, float]) -> ComplexArray:
        """What a law adds to lambda (n,) while the shape stays."""
        d = np.abs(self.phi @ self.beams.T[:, self.beams.columns(term.direction)])
        table = Table(term.physics, values, 2 * self.top(term), self.omega)
        return (table(self.measured.Q[:, None] * d) * d**2).sum(axis=1)

    def predicted(
        self, terms: Sequence[Term], values: Sequence[Mapping[str, float]], k: float, Q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """omega and zeta (each (n,)) of the joint at amplitudes Q, without the damping of all else."""
        laws = [
            (self.beams.columns(t.direction), Table(t.physics, v, 4 * self.top(t), self.omega))
            for t, v in zip(terms, values, strict=True)
        ]
        return self.beams.backbone(k, laws, Q, self.phi)

    def fit(self, terms: Sequence[Term], before: Fit | None = None, *, damping: bool = True) -> Fit | None:
        """The joint with these laws, the last of them new beside the fit `before`; None where it has no say.

        Without `damping` the frequency alone is fitted.
        """
        given: tuple[Mapping[str, float], ...] = () if before is None else before.values
        if len(terms) == len(given):
            begun = [(given, self.k)]
        else:
            fixed = np.zeros(len(self.measured.Q), dtype=complex)
            for term, values in zip(terms, given, strict=False):
                fixed += self._first_order(term, values)
            begun = [((*given, values), k) for values, k in self.starts(terms[-1], fixed)]
        tries = [Descent(self, terms, values, k, damping) for values, k in begun]
        tries.sort(key=lambda one: one.cost(one.x0))
        fits = [one.solved() for one in tries[:STARTS]]
        return min(fits, key=lambda fit: fit.left, default=None)

    def backbone(self, fit: Fit, Q: FloatArray) -> Backbone:
        """The fitted joint at amplitudes Q."""
        omega, zeta = self.predicted(fit.terms, fit.values, fit.k, Q)
        return Backbone(Q, omega, zeta + fit.zeta0)


class Descent:
    """Least squares from one start over the logarithm of the contact stiffness and the coordinates of the laws."""

    def __init__(
        self, study: Study, terms: Sequence[Term], values: Sequence[Mapping[str, float]], k: float, damping: bool
    ) -> None:
        self.study, self.terms, self.damping = study, tuple(terms), damping
        self.maps = [FitCoordinates(t.physics, v) for t, v in zip(terms, values, strict=True)]
        self.ends = np.cumsum([1, *[len(m.free) for m in self.maps]])
        self.x0 = np.concatenate([[np.log(k)], *[m.start() for m in self.maps]])

    def joint(self, x: FloatArray) -> tuple[float, tuple[dict[str, float], ...]]:
        """Contact stiffness and values of the laws."""
        parts = np.split(x, self.ends)[1:-1]
        return float(np.exp(x[0])), tuple(m.parameters(p) for m, p in zip(self.maps, parts, strict=True))

    def residual(self, x: FloatArray) -> FloatArray:
        """Relative errors of the poles, the damping of all else put at its best value."""
        k, values = self.joint(x)
        m = self.study.measured
        try:
            omega, zeta = self.study.predicted(self.terms, values, k, m.Q)
        except LawParameterError:  # a step to where the law is none
            return np.ones(len(m.Q) * (1 + self.damping))
        left = zeta - m.zeta + max(float(np.mean(m.zeta - zeta)), 0.0)
        out = np.concatenate([omega / m.omega - 1, left] if self.damping else [omega / m.omega - 1])
        return np.clip(np.nan_to_num(out, nan=1.0), -1.0, 1.0)

    def cost(self, x: FloatArray) -> float:
        """Sum of squares."""
        e = self.residual(x)
        return float(e @ e)

    def solved(self) -> Fit:
        """The fit this start leads to."""
        found = least_squares(self.residual, self.x0, bounds=(self.x0 - 4, self.x0 + 4), max_nfev=40, x_scale="jac")
        k, values = self.joint(found.x)
        m = self.study.measured
        zeta0 = max(float(np.mean(m.zeta - self.study.predicted(self.terms, values, k, m.Q)[1])), 0.0)
        k_sd, sd = self._sd(found)
        return Fit(self.terms, values, k, zeta0, float(np.sqrt(found.fun @ found.fun / len(m.Q))), sd, k_sd)

    def _sd(self, found: Any) -> tuple[float, tuple[dict[str, float], ...]]:
        """Standard deviations by linearisation; the amplitudes of a block count as one."""
        freedom = len(found.fun) - len(found.x)
        covariance = np.linalg.pinv(found.jac.T @ found.jac) * EACH * (found.fun @ found.fun) / freedom
        out = []
        for m, part, start in zip(self.maps, np.split(found.x, self.ends)[1:-1], self.ends, strict=False):
            at = slice(start, start + len(part))
            J = m.jacobian(part)
            variance = np.maximum(np.diag(J @ covariance[at, at] @ J.T), 0.0)
            out.append(dict(zip(m.physics.parameter_names, np.sqrt(variance).tolist(), strict=True)))
        return float(np.exp(found.x[0]) * np.sqrt(covariance[0, 0])), tuple(out)


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
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
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
