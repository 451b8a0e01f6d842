"""Which law the bearing forces of a run follow: m r Omega^2, another power of the speed, or none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.errors import LoadError
from femend.estimate.joint.line_forces import OdsFrf
from femend.estimate.joint.receptance import receptance
from femend.estimate.joint.rotor import Unbalance
from femend.estimate.loads.compare import line_evidence
from femend.estimate.loads.regularise import regularised_lines
from femend.model.terms.configured import ConfiguredModel
from femend.numerals import plain

__all__ = ["ForceLaw", "ForceLaws", "compare_force_laws"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# exponents of the speed that are tried; the prior is uniform over them
EXPONENTS = np.linspace(-1.0, 5.0, 241)
# prior deviations of the forces that are tried, relative to the size that explains most
SIZES = np.logspace(-2, 2, 17)
# groups of neighbouring lines, of which each in turn is predicted from the others
FOLDS = 8
# least difference in ln evidence (odds of 150 to 1), and share by which unseen errors must fall, for a freer law
ODDS, SHARE = 5.0, 0.1
# unseen error below which a law needs no free forces (line_forces calls a line explained there); from which on nothing
# explains the run
ENOUGH, UNEXPLAINED = 0.1, 0.5


@dataclass(frozen=True, eq=False)
class ForceLaw:
    """One law: "unbalance" (m r Omega^2), "power" (Omega^n, `exponent` n with deviation `sd`) or "free".

    `force` (n_bearings,) complex are the forces over Omega^n at the highest speed, over Omega^2 there (so that they are
    unbalances m r, with their phase), nan for free ones. `unseen` relative error at sensors left out, `unseen_lines` at
    lines left out, medians over the lines (nan for free forces, which say nothing about other lines).
    """

    name: str
    exponent: float
    sd: float
    force: ComplexArray
    log_evidence: float
    probability: float
    unseen: float
    unseen_lines: float


@dataclass(frozen=True, eq=False)
class ForceLaws:
    """Laws by falling evidence; `best` names the one that stands, None where none does; `reason` says why."""

    laws: tuple[ForceLaw, ...]
    best: str | None
    reason: str

    def __getitem__(self, name: str) -> ForceLaw:
        return next(law for law in self.laws if law.name == name)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Whitened shapes `y` (K, m), responses `A` (K, m, n_b) to forces that turn, `H` (K, m, 2 n_b) to free ones, and
    ln of the speed over its highest, `x` (K,)."""

    y: ComplexArray
    A: ComplexArray
    H: ComplexArray
    x: FloatArray

    def sums(self, keep: NDArray[np.bool_], rows: NDArray[np.bool_]) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        """A^H A (K, n_b, n_b), A^H y (K, n_b) and |y|^2 (K,) over sensors `rows` on lines `keep`."""
        A, y = self.A[np.ix_(keep, rows)], self.y[np.ix_(keep, rows)]
        return np.matmul(A.conj().transpose(0, 2, 1), A), np.einsum("kmb,km->kb", A.conj(), y), (np.abs(y) ** 2).sum(1)


def compare_force_laws(
    model: ConfiguredModel,
    p: FloatArray,
    shapes: OdsFrf,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
    *,
    delay: float = 0.0,
    model_error: float = 0.03,
) -> ForceLaws:
    """Holds the law of unbalance against a free power of the speed and forces free on every line.

    `shapes` are operating shapes per unit course Omega^2 (`ods_frf`), `model` is taken at the unknowns `p` (n,); `out`
    (n_out, r) and `bearings` (n_bearings, 3, r) are rows of its basis; `unbalance` has the shaft's axis and sense;
    `delay` (s) is the tacho's; `model_error` the share of a line's mean response that no model explains.

    The first two laws hold over the whole run, each bearing with its own size and phase; the third has both components
    at every bearing, on every line. All are linear but in the exponent: their evidence is that of Gaussian forces of
    the likeliest size (MacKay, Neural Computation 4 (1992) 415-447, section 4), integrated over the exponent, tempered
    by what the best law leaves above the noise. Beside it every sensor is left out once and predicted from the others,
    and for laws every eighth of the lines.

    The freer law is named when its evidence is larger by 5 (odds of 150 to 1) and it predicts unseen sensors (or lines)
    better by a tenth; free forces only where no law predicts unseen sensors to a tenth. Else the simpler one stands.
    Evidence alone would not do: what is wrong with the structure is alike at many sensors and lines, and free forces
    take it up. Where the structure is far off they predict unseen sensors better, too: "free" says that no law holds
    with this structure, not that none would hold with another. None is named where more than half of the unseen sensors
    stays unexplained.

    Raises LoadError for fewer than two sensors more than forces, and for fewer than eight lines.
    """
    n_b, n_out = len(bearings), len(out)
    if n_out < 2 * n_b + 2 or len(shapes.freq) < FOLDS:
        raise LoadError(
            f"{n_out} sensors and {len(shapes.freq)} lines for {2 * n_b} forces of {n_b} bearing(s); comparing laws "
            f"takes {2 * n_b + 2} sensors and {FOLDS} lines",
            n_responses=n_out,
            n_loads=2 * n_b,
        )
    lines = _lines(model, p, shapes, unbalance, out, bearings, delay, model_error)
    everything = np.ones(len(lines.x), dtype=bool), np.ones(n_out, dtype=bool)
    inflation = _left(lines)
    scale = 1.0 / np.sqrt(inflation)
    tempered = _Lines(lines.y * scale, lines.A * scale, lines.H * scale, lines.x)
    found, evidence = {}, {}
    for name, exponents in (("unbalance", np.array([2.0])), ("power", EXPONENTS)):
        own, ln_z = _law(tempered, *everything, exponents)
        found[name], evidence[name] = own, ln_z
    evidence["free"] = line_evidence(tempered.H, tempered.y)
    unseen = {"free": (_unseen_free(lines), float("nan"))}
    for name, exponents in (("unbalance", np.array([2.0])), ("power", EXPONENTS)):
        unseen[name] = _unseen(lines, exponents)
    return _ranked(found, evidence, unseen, n_b)


def _lines(
    model: ConfiguredModel,
    p: FloatArray,
    shapes: OdsFrf,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
    delay: float,
    model_error: float,
) -> _Lines:
    u, v = unbalance.plane
    rows = bearings[:, [u, v]].reshape(-1, bearings.shape[2])
    s = 2j * np.pi * shapes.freq
    turning = receptance(model, p, s, unbalance.speed(shapes.freq))
    H = turning.between(out, rows) * np.exp(-s * delay)[:, None, None]
    # the sine course is -j times the cosine course: a force that turns is e_u - j sense e_v
    A = H[:, :, 0::2] - 1j * unbalance.sense * H[:, :, 1::2]
    mean = np.sqrt((np.abs(shapes.Y) ** 2).mean(axis=1, keepdims=True))
    w = 1.0 / np.hypot(shapes.sd, model_error * mean)
    x = np.log(shapes.freq / shapes.freq[-1])
    return _Lines(shapes.Y * w, A * w[:, :, None], H * w[:, :, None], x)


def _left(lines: _Lines) -> float:
    """Squares per free value of the law or the free forces that leave less, at least 1."""
    solved = regularised_lines(lines.H, lines.y, "none")
    free = float(solved.squares.sum() / solved.freedom.sum())
    everything = np.ones(len(lines.x), dtype=bool), np.ones(lines.y.shape[1], dtype=bool)
    (n, _, U), _ = _law(lines, *everything, EXPONENTS)
    r = lines.y - np.einsum("kmb,b->km", lines.A, U) * np.exp((n - 2) * lines.x)[:, None]
    return max(1.0, min(free, float((np.abs(r) ** 2).mean())))


def _law(
    lines: _Lines, keep: NDArray[np.bool_], rows: NDArray[np.bool_], exponents: FloatArray
) -> tuple[tuple[float, float, ComplexArray], float]:
    """Exponent, its deviation and the forces (n_b,) over Omega^n, and ln evidence (prior uniform over -1 to 5)."""
    M_k, r_k, power = lines.sums(keep, rows)
    grow = np.exp(np.outer(exponents - 2.0, lines.x[keep]))
    M = np.einsum("ek,kab->eab", grow**2, M_k)
    r = np.einsum("ek,ka->ea", grow, r_k)
    n_b = M.shape[1]
    size = np.sqrt(float(power.sum()) / np.maximum(np.einsum("eaa->e", M).real, 1e-300))
    best = np.full(len(exponents), -np.inf)
    for relative in SIZES:
        inverse = np.eye(n_b) / (relative * size[:, None, None]) ** 2
        gain = np.einsum("ea,ea->e", r.conj(), np.linalg.solve(M + inverse, r[:, :, None])[:, :, 0]).real
        det = np.linalg.slogdet(np.eye(n_b) + M * (relative * size[:, None, None]) ** 2)[1]
        best = np.maximum(best, gain - det)
    top = int(np.argmax(best))
    weight = np.exp(best - best[top])
    mean = float((weight * exponents).sum() / weight.sum())
    spread = float(np.sqrt((weight * (exponents - mean) ** 2).sum() / weight.sum()))
    step = float(np.diff(exponents).mean()) if len(exponents) > 1 else 0.0
    # posterior narrower than the grid: the curvature at the top tells the deviation
    if 0 < top < len(exponents) - 1:
        bend = -(best[top - 1] - 2 * best[top] + best[top + 1]) / step**2
        shift = 0.5 * step * (best[top + 1] - best[top - 1]) / max(bend * step**2, 1e-300)
        if spread < step and bend > 0:
            mean, spread = float(exponents[top] + shift), float(1 / np.sqrt(bend))
    width = float(exponents[-1] - exponents[0])
    ln_z = float(best[top]) - float(power.sum())
    if len(exponents) > 1:
        volume = max(float(weight.sum()) * step, np.sqrt(2 * np.pi) * spread)
        ln_z += float(np.log(volume / width))
    grow_n = np.exp((mean - 2.0) * lines.x[keep])
    U = np.linalg.lstsq(np.einsum("k,kab->ab", grow_n**2, M_k), grow_n @ r_k, rcond=1e-12)[0]
    return (mean, spread, np.asarray(U)), ln_z


def _unseen(lines: _Lines, exponents: FloatArray) -> tuple[float, float]:
    """Relative errors at sensors, and at groups of lines, that the law was not fitted to."""
    K, m = lines.y.shape
    power = np.maximum((np.abs(lines.y) ** 2).mean(axis=1, keepdims=True), 1e-300)
    left = {"sensors": np.zeros((K, m)), "lines": np.zeros((K, m))}
    cuts = [("sensors", np.ones(K, dtype=bool), np.arange(m) != i) for i in range(m)]
    group = np.arange(K) * FOLDS // K
    cuts += [("lines", group != g, np.ones(m, dtype=bool)) for g in range(FOLDS)]
    for what, keep, rows in cuts:
        (n, _, U), _ = _law(lines, keep, rows, exponents)
        r = lines.y - np.einsum("kmb,b->km", lines.A, U) * np.exp((n - 2) * lines.x)[:, None]
        hidden = np.broadcast_to(~rows, (K, m)) if what == "sensors" else np.broadcast_to(~keep[:, None], (K, m))
        left[what][hidden] = (np.abs(r) ** 2 / power)[hidden]
    return _typical(left["sensors"]), _typical(left["lines"])


def _unseen_free(lines: _Lines) -> float:
    K, m = lines.y.shape
    power = np.maximum((np.abs(lines.y) ** 2).mean(axis=1), 1e-300)
    left = np.zeros((K, m))
    for i in range(m):
        others = [j for j in range(m) if j != i]
        x = regularised_lines(lines.H[:, others], lines.y[:, others]).x
        left[:, i] = np.abs(lines.y[:, i] - np.einsum("kn,kn->k", lines.H[:, i], x)) ** 2 / power
    return _typical(left)


def _typical(left: FloatArray) -> float:
    """Median over lines of the relative error: a resonance that is a little off spoils few of them."""
    return float(np.median(np.sqrt(left.mean(axis=1))))


def _ranked(
    found: dict[str, tuple[float, float, ComplexArray]],
    evidence: dict[str, float],
    unseen: dict[str, tuple[float, float]],
    n_b: int,
) -> ForceLaws:
    level = max(evidence.values())
    weight = {n: float(np.exp(max(e - level, -700.0))) for n, e in evidence.items()}
    nothing = (float("nan"), float("nan"), np.full(n_b, np.nan + 0j))
    laws = []
    for name in sorted(evidence, key=lambda n: -evidence[n]):
        n, sd, U = found.get(name, nothing)
        share = weight[name] / sum(weight.values())
        laws.append(ForceLaw(name, n, sd if name == "power" else 0.0, U, evidence[name], share, *unseen[name]))
    best, reason = _decided({law.name: law for law in laws})
    return ForceLaws(tuple(laws), best, reason)


def _decided(laws: dict[str, ForceLaw]) -> tuple[str | None, str]:
    """The simplest law that no freer one beats on unseen data, and why."""
    unbalance, power, free = (laws[n] for n in ("unbalance", "power", "free"))
    stands, reason = (
        unbalance,
        f"it leaves {plain(100 * unbalance.unseen, 2)} % of unseen sensors, and no freer law is needed",
    )
    for rival, better in (
        (power, min(power.unseen / unbalance.unseen, power.unseen_lines / unbalance.unseen_lines)),
        (free, free.unseen / min(unbalance.unseen, power.unseen)),
    ):
        if better >= 1 - SHARE or (rival is free and stands.unseen < ENOUGH):
            continue
        if rival.log_evidence - stands.log_evidence < ODDS:
            return None, f"{rival.name} predicts unseen data better, the evidence is not for it against {stands.name}"
        stands, reason = rival, f"{rival.name} leaves {plain(better, 2)} of the simpler law's error on unseen data"
    if stands is free:
        reason += "; either the forces follow no law, or the structure is another: a few free forces make up for it"
    if stands.unseen > UNEXPLAINED:
        return None, f"{100 * stands.unseen:.0f} % of unseen sensors stay unexplained by the best law, {stands.name}"
    return stands.name, reason
