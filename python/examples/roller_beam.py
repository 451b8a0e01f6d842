"""A cantilever with a roller that moves: the support its model lacks is located and named from free decays alone.

The recordings (DROPBEAR, dataset 8: a roller steps along a clamped beam and back, three times; CC BY-SA 4.0) are not
part of this project. The script looks for `data/roller_beam` in the folder FEMEND_SHARED, else in `../shared` beside
the project:

python python/examples/roller_beam.py

Nobody measured a force: every step of the roller leaves a free decay, whose poles (subspace identification) give up to
three bending frequencies at each stop. One support raises mode i to between modes i and i + 1 of the cantilever, so
bands to look in are the cantilever's. The model is the plain cantilever from its stated dimensions; what nobody states
is fitted with every rival alike: E / rho within what metals have, and a lumped mass somewhere (sensors and the like).
Rivals have one value of their own for every stop. They are fitted to test 0 and chosen on test 1, test 2 is reported:
what the stops share stays, the own value comes from the first frequency alone, the second and third are predicted. The
recorded position says when the roller stands still, and is held against the located places at the very end; nothing is
fitted to it but that line. Which poles count as a mode was settled looking at the poles of all three tests, that there
is a lumped mass at the misfit in test 0.

What comes out: a pinned support that moves, told from every rival: modes 2 and 3 of test 2 are predicted to 1.5 % RMS,
by the next rival, a clamp that moves, to 3.0 % (an elastic support takes the largest stiffness it may have and so is
the same). Its places follow the sensor at every step; R^2 of the line is 0.997 in test 0, 0.998 and 0.9996 in tests 1
and 2, 55 mm/V. The model lacks a mass as well, 0.10 kg at 335 mm, which nobody states: without it the places follow the
sensor all the same (R^2 0.995 in test 0), but a support predicts about as badly as a clamp that moves.

What does not come out: the contact. Where every stop has a stiffness of its own, one frequency tells no place, and two
or three put the first and second stop up to 26 mm further out and give R^2 0.97: there the recorded modes are softer
than those of a rigid support (second mode 3 % low). At the last stop the second mode is found at 252 or at 268 Hz. The
scale cannot be checked: the sensor is said to have a stroke of 75 mm, the located travel is 118 mm, and no rival moves
by less than 90 mm; so the stroke is not that of what is recorded, or the roller moves further than its sensor.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import least_squares
from scipy.signal import decimate

from femend.modal.output_only.ssi import order_poles, subspace
from femend.model import read_model

FloatArray = NDArray[np.float64]

TESTS, FITTED, CHOOSING, REPORTED = (0, 1, 2), 0, 1, 2
# m: what is stated of the beam
LENGTH, WIDTH, THICKNESS = 0.501, 0.051, 0.00666
# Pa, kg/m^3: nobody states the material, but frequencies hold E / rho alone, which is 25.5 to 26.8 (km/s)^2 for steels
# and 25.5 to 25.7 for alloys of aluminium and titanium; with a thickness known to 0.01 mm, 4 % cover it
E, RHO, E_SD = 200e9, 7850.0, 0.04
# MODEL_SD: what no parameter describes, per mode; a diagnosis allows its frequency factors as much
ELEMENTS, MODES, MODEL_SD = 40, 30, 0.005
# Hz; the roller stands where its sensor moves less than STILL (V) over PAUSE (s); steps are 0.43 V
RATE, STILL, PAUSE = 5000.0, 0.03, 0.1
# s: a decay begins so long after the roller has stopped, and lasts no longer than stops do (the last one is longer)
SETTLED, STOP = 0.03, 1.2
# a decay has so many periods of the lowest frequency of its band, and is cut at DELAYS delays an eighth of it apart
PERIODS, DELAYS, ORDERS = 16, 4, range(6, 31, 2)
# Hz: below is the first torsional mode (388 Hz as drawn, up to 500 Hz with the roller at a fifth of the span), which
# the sensors see as well
TORSION = 500.0
# N/m: a stiffness that the beam cannot tell from a rigid support, and those between which it may lie
RIGID, STIFFNESSES = 1e9, np.geomspace(1e5, 1e9, 65)
# m: places tried; a place is told from the best one where the cost is higher by LEVEL (95 % of one unknown)
GRID, LEVEL = 0.003, 3.84


@dataclass(frozen=True, eq=False)
class Stop:
    """A stop of the roller: sensor voltage; frequencies (Hz) of modes 1 to 3, nan if not seen, and their relative
    standard deviations."""

    test: int
    volt: float
    freq: FloatArray
    sd: FloatArray


@dataclass(frozen=True, eq=False)
class Rival:
    """What the model may lack: a value `own` to every stop, `shared` ones of all, and fixed ones."""

    name: str
    own: str
    shared: tuple[str, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


# E: factor on E / rho; x: place of a support (m) of stiffness k (N/m); clamp: rotational stiffness (Nm/rad); free:
# length (m) that the clamp takes up; m: a mass (kg) at p (m), beside the lumped mass `sensor` at `at` in all rivals
COMMON = ("E", "sensor", "at")
RIVALS = (
    Rival("pinned support that moves", "x", fixed=(("k", RIGID),)),
    Rival("elastic support that moves", "x", ("k",)),
    Rival("elastic support in one place", "k", ("x",)),
    Rival("clamp that moves", "free"),
    Rival("stiffness of the clamp", "clamp"),
    Rival("stiffness of the beam", "E"),
    Rival("point mass that moves", "p", ("m",)),
    Rival("point mass in one place", "m", ("p",)),
)
# the first of them without the lumped mass
BARE = Rival("the same, no lumped mass", "x", fixed=(("k", RIGID), ("sensor", 0.0), ("at", LENGTH)))
PLACES = ("x", "at", "free", "p")
STARTS: Mapping[str, tuple[float, ...]] = {
    "E": (1.0,), "k": (1e7,), "x": (0.12,), "sensor": (0.03,), "at": (0.15, 0.3, 0.4, 0.49), "free": (0.06,),
    "clamp": (1e4,), "m": (0.1,), "p": (0.3,),
}  # fmt: skip


class Beam:
    """The cantilever in its own modes and the rigid rotation about its clamp, and terms added to it."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "cantilever.bdf"
            deck.write_text(deck_text(), encoding="ascii")
            model = read_model(deck)
        K, M = (A.toarray() for A in model.matrices())
        self.step = LENGTH / ELEMENTS
        # rows of deflection and of the slope dw/dx = -theta_y of every node in the reduced set; -1 where fixed
        node = np.rint(model.xyz[np.searchsorted(model.node_ids, model.fe.dof_nodes), 0] / self.step).astype(int)
        self.rows = np.full((ELEMENTS + 1, 2), -1)
        turning = model.fe.dof_components == 5
        self.rows[node, turning.astype(int)] = np.arange(len(node))
        root = self.rows[0, 1]
        kept = np.delete(np.arange(len(K)), root)
        squares, phi = eigh(K[np.ix_(kept, kept)], M[np.ix_(kept, kept)], subset_by_index=[0, MODES - 1])
        self.basis = np.zeros((len(K), MODES + 1))
        self.basis[kept, :MODES] = phi
        self.basis[:, MODES] = np.where(turning, -1.0, node * self.step)
        self.K, self.M = self.basis.T @ K @ self.basis, self.basis.T @ M @ self.basis
        self.drawn = np.sqrt(squares) / (2 * np.pi)

    def at(self, x: float) -> FloatArray:
        """Deflection at x (m) by the basis (MODES + 1,), cubic between nodes."""
        element = min(int(x / self.step), ELEMENTS - 1)
        u, h = x / self.step - element, self.step
        shape = (1 - 3 * u**2 + 2 * u**3, -h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3, -h * (u**3 - u**2))
        rows = self.rows[element : element + 2].ravel()
        return np.asarray(sum(N * self.basis[row] for N, row in zip(shape, rows, strict=True) if row >= 0))

    def frequencies(self, v: Mapping[str, float]) -> FloatArray:
        """The lowest three frequencies (Hz) with values by name."""
        n = MODES + ("clamp" in v)
        free = v.get("free", 0.0)
        # a beam of length L - free is one of length L in units that make it so
        scale = 1 - free / LENGTH
        K, M = self.K[:n, :n] * v["E"] / scale**3, self.M[:n, :n] * scale
        if "k" in v:
            a = self.at(v["x"])[:n]
            K = K + v["k"] * np.outer(a, a)
        if "clamp" in v:
            K = K.copy()
            K[-1, -1] += v["clamp"]
        for mass, place in (("sensor", "at"), ("m", "p")):
            if mass in v:
                a = self.at(max(v[place] - free, 0.0) / scale)[:n]
                M = M + v[mass] * np.outer(a, a)
        return np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[0, 2])) / (2 * np.pi)


def deck_text() -> str:
    """The cantilever along X in ELEMENTS bars that bend in Z; its clamp may turn, for rivals that let it."""
    area, inertia = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    last = ELEMENTS + 1
    lines = [
        "SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1",
        f"MAT1,1,{E:.4e},,0.3,{RHO}",
        f"PBAR,1,1,{area:.6e},{inertia:.6e},{THICKNESS * WIDTH**3 / 12:.6e},{4 * inertia:.6e}",
        f"SPC1,1,1246,1,THRU,{last}", "SPC1,1,3,1",
    ]  # fmt: skip
    lines += [f"GRID,{i + 1},,{LENGTH * i / ELEMENTS:.8f},0.,0." for i in range(last)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,0.,1." for i in range(1, last)]
    return "\n".join([*lines, "ENDDATA", ""])


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "roller_beam"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/roller_beam")
    return folder


def standing(volt: FloatArray) -> list[slice]:
    """The times at which the roller stands after a step: samples where its sensor, smoothed, no longer moves."""
    n = int(PAUSE * RATE / 2)
    mean = np.convolve(volt, np.ones(n) / n, "same")
    still = np.zeros(len(volt), dtype=bool)
    still[n // 2 : -(n - n // 2)] = np.abs(mean[n:] - mean[:-n]) < STILL
    edges = np.flatnonzero(np.diff(still.astype(int)))
    begin, end = edges[0::2], edges[1::2]
    # before the first step nothing moves the beam
    return [slice(int(b), int(min(e, b + STOP * RATE))) for b, e in zip(begin[1:], end[1:], strict=True)]


def identified(decay: FloatArray, band: tuple[float, float]) -> tuple[float, float]:
    """Frequency (Hz) of the pole with the most energy in a band, its median over model orders and delays, and how far
    these scatter (relative; 1.48 times the median deviation)."""
    thin = max(int(RATE / (2.8 * band[1])), 1)
    y = decimate(decay, thin, ftype="fir") if thin > 1 else decay
    rate = RATE / thin
    half = int(PERIODS / band[0] * rate) // 2
    t = np.arange(2 * half) / rate
    found = []
    for delay in range(DELAYS):
        begin = int((SETTLED + delay * PERIODS / band[0] / 8) * rate)
        part = y[begin : begin + 2 * half]
        if len(part) < 2 * half:
            break
        part = part - part.mean()
        # a free decay obeys the recursion that correlations of a response to noise obey
        space = subspace(part[:, None, None], half, max(ORDERS), 1 / rate)
        for order in (o for o in ORDERS if o <= space.max_order):
            mu = order_poles(space, order).mu
            freq, decays = np.abs(mu) / (2 * np.pi), np.exp(np.outer(t, mu))
            x = np.linalg.lstsq(np.hstack([decays.real, decays.imag]), part, rcond=None)[0]
            energy = (x[: len(mu)] ** 2 + x[len(mu) :] ** 2) / -mu.real
            inside = (freq > band[0]) & (freq < band[1])
            if inside.any():
                found.append(freq[np.argmax(np.where(inside, energy, 0.0))])
    if not found:
        return np.nan, np.inf
    middle = float(np.median(found))
    return middle, float(1.4826 * np.median(np.abs(np.array(found) - middle)) / middle)


def read(folder: Path, test: int, drawn: FloatArray) -> list[Stop]:
    """The stops of a test; `drawn` are the frequencies (Hz) of the cantilever, between which modes are looked for."""
    table = np.loadtxt(folder / f"test{test}.txt", skiprows=8)
    bands = [(float(drawn[0]), float(drawn[1])), (float(drawn[1]), float(drawn[2])), (TORSION, float(drawn[3]))]
    stops = []
    for part in standing(table[:, 2]):
        freq, scatter = np.array([identified(table[part, 0], band) for band in bands]).T
        # a mode that the decay does not tell to what the model is allowed is not seen
        seen = np.where(scatter < MODEL_SD, freq, np.nan)
        stops.append(Stop(test, float(table[part, 2].mean()), seen, np.hypot(scatter, MODEL_SD)))
    return stops


def inner(name: str, value: float) -> float:
    """The coordinate in which a value is fitted: no limits, places on the beam, the others positive."""
    return float(np.log(value / (LENGTH - value)) if name in PLACES else np.log(value))


def outer(name: str, coordinate: float) -> float:
    """The value of a coordinate."""
    if name in PLACES:
        return float(LENGTH / (1 + np.exp(-coordinate)))
    return float(np.exp(min(coordinate, np.log(RIGID))))


@dataclass(frozen=True, eq=False)
class Fit:
    """A rival fitted: shared values, own ones of every stop (n_stops,) and their standard deviations with the shared
    ones uncertain; `cost` of residuals and prior, `rms` relative error of all frequencies."""

    rival: Rival
    shared: dict[str, float]
    own: FloatArray
    sd: FloatArray
    cost: float
    rms: float


def robust(stop: Stop, model: FloatArray) -> FloatArray:
    """ln(model / measured) over its standard deviation for frequencies (..., 3), zero where not seen; what is far off
    (a support rattles) counts linearly, not by its square."""
    r = np.where(np.isfinite(stop.freq), np.log(model / stop.freq) / stop.sd, 0.0)
    return np.asarray(np.sign(r) * np.sqrt(2 * (np.sqrt(1 + r**2) - 1)))


class Fitter:
    """Fits of rivals to the stops of a test."""

    def __init__(self, beam: Beam) -> None:
        self.beam = beam

    def residual(self, stop: Stop, values: Mapping[str, float]) -> FloatArray:
        """Residuals (3,) of a stop."""
        return robust(stop, self.beam.frequencies(values))

    def fit(self, rival: Rival, stops: Sequence[Stop]) -> Fit:
        """The best of all starts."""
        given, own = dict(rival.fixed), rival.own
        shared = [name for name in (*COMMON, *rival.shared) if name != own and name not in given]
        n = len(shared)

        def values(x: FloatArray, i: int) -> dict[str, float]:
            names = dict(zip(shared, x[:n], strict=True)) | {own: x[n + i]}
            return {name: outer(name, c) for name, c in names.items()} | given

        def residuals(x: FloatArray) -> FloatArray:
            prior = [x[shared.index("E")] / E_SD] if "E" in shared else []
            return np.concatenate([*(self.residual(s, values(x, i)) for i, s in enumerate(stops)), prior])

        def jacobian(x: FloatArray) -> FloatArray:
            base = residuals(x)
            J, h = np.zeros((len(base), len(x))), 1e-5
            for j in range(n):
                J[:, j] = (residuals(x + h * (np.arange(len(x)) == j)) - base) / h
            for i, stop in enumerate(stops):
                moved = x.copy()
                moved[n + i] += h
                J[3 * i : 3 * i + 3, n + i] = (self.residual(stop, values(moved, i)) - base[3 * i : 3 * i + 3]) / h
            return J

        fits = []
        for start in product(*(STARTS[name] for name in (*shared, own))):
            x0 = [inner(name, v) for name, v in zip((*shared, own), start, strict=True)]
            x0 += [x0[-1]] * (len(stops) - 1)
            fits.append(least_squares(residuals, x0, jac=jacobian, max_nfev=40))
        best = min(fits, key=lambda f: f.cost)
        all_values = [values(best.x, i) for i in range(len(stops))]
        off = [np.log(self.beam.frequencies(v) / s.freq) for v, s in zip(all_values, stops, strict=True)]
        slope = [(outer(own, c + 1e-5) - outer(own, c)) / 1e-5 for c in best.x[n:]]
        J = np.asarray(best.jac, dtype=np.float64)
        return Fit(
            rival,
            {name: all_values[0][name] for name in shared} | given,
            np.array([v[own] for v in all_values]),
            np.sqrt(np.diag(np.linalg.pinv(J.T @ J))[n:]) * np.abs(slope),
            float(2 * best.cost),
            float(np.sqrt(np.nanmean(np.square(off)))),
        )

    def unseen(self, fit: Fit, stops: Sequence[Stop]) -> float:
        """RMS relative error of modes 2 and 3, the own value of every stop read off its first frequency."""
        own, off = fit.rival.own, []
        # least squares from several starts, since a rival may not reach a frequency at all
        starts = [inner(own, float(np.quantile(fit.own, q))) for q in (0.1, 0.5, 0.9)]
        for stop in stops:

            def residual(c: FloatArray, stop: Stop = stop) -> FloatArray:
                return self.residual(stop, fit.shared | {own: outer(own, c[0])})[:1]

            best = min((least_squares(residual, [x]) for x in starts), key=lambda f: float(f.cost))
            model = self.beam.frequencies(fit.shared | {own: outer(own, best.x[0])})
            off.append(np.log(model / stop.freq)[1:])
        return float(np.sqrt(np.nanmean(np.square(off))))


class Locator:
    """Places of a support along the beam, rigid or of any stiffness, with everything else given."""

    def __init__(self, fitter: Fitter, shared: Mapping[str, float]) -> None:
        self.fitter, self.shared = fitter, dict(shared)
        self.x = np.arange(GRID, LENGTH, GRID)
        # frequencies on a grid of places and stiffnesses, which all stops share
        self.table = np.array(
            [[fitter.beam.frequencies({**shared, "x": x, "k": k}) for k in STIFFNESSES] for x in self.x]
        )

    def located(self, stop: Stop, *, elastic: bool) -> Located:
        """The place from the frequencies of one stop; `elastic`: the stiffness is unknown too."""
        columns = slice(None) if elastic else slice(-1, None)
        cost = np.sum(robust(stop, self.table[:, columns]) ** 2, axis=-1)
        i, j = np.unravel_index(np.argmin(cost), cost.shape)

        def residual(c: FloatArray) -> FloatArray:
            k = outer("k", c[1]) if elastic else RIGID
            return self.fitter.residual(stop, {**self.shared, "x": outer("x", c[0]), "k": k})

        x0 = [inner("x", self.x[i]), *([inner("k", STIFFNESSES[j])] if elastic else [])]
        found = least_squares(residual, x0)
        kept = cost.min(axis=1) < min(2 * found.cost, cost.min()) + LEVEL
        edges = np.flatnonzero(np.diff(np.concatenate([[0], kept.astype(int), [0]])))
        spans = tuple((float(self.x[a]), float(self.x[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True))
        return Located(outer("x", found.x[0]), spans)


@dataclass(frozen=True, eq=False)
class Located:
    """A place (m) and the stretches of the beam (m) that the frequencies of the stop cannot tell from it."""

    x: float
    spans: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Line:
    """Places (mm) against the sensor (V): slope, its standard deviation, place at 0 V, R^2, largest distance (mm)."""

    slope: float
    sd: float
    origin: float
    R2: float
    largest: float


def line(volt: FloatArray, x: FloatArray) -> Line:
    """The straight line through places x (m)."""
    (slope, origin), covariance = np.polyfit(volt, 1e3 * x, 1, cov=True)
    off = 1e3 * x - (slope * volt + origin)
    R2 = 1 - float(off @ off) / float(np.sum((1e3 * x - 1e3 * x.mean()) ** 2))
    return Line(float(slope), float(covariance[0, 0] ** 0.5), float(origin), R2, float(np.abs(off).max()))


@dataclass(frozen=True, eq=False)
class Outcome:
    """The stops by test; rivals with their errors of unseen modes in the choosing and in the reported test, best of the
    former first; the first rival without a lumped mass; places with the shared values of the support that moves, it
    being rigid and elastic."""

    stops: dict[int, list[Stop]]
    ranked: list[tuple[float, float, Fit]]
    bare: tuple[float, float, Fit]
    rigid: dict[int, list[Located]]
    elastic: dict[int, list[Located]]

    def volts(self, *tests: int) -> FloatArray:
        """Sensor voltages of tests, one after the other."""
        return np.array([s.volt for t in tests for s in self.stops[t]])

    def several(self, *tests: int) -> NDArray[np.bool_]:
        """Stops at which more than one frequency is seen: place and stiffness take two."""
        return np.array([np.isfinite(s.freq).sum() > 1 for t in tests for s in self.stops[t]])

    def places(self, *tests: int, elastic: bool = False) -> FloatArray:
        """Located places (m) in the same order."""
        found = self.elastic if elastic else self.rigid
        return np.array([one.x for t in tests for one in found[t]])

    def monotonic(self, test: int) -> bool:
        """Do places follow the sensor at every step of a test, up and down?"""
        steps = np.diff(self.volts(test)), np.diff(self.places(test))
        return bool(np.all(np.sign(steps[0]) == np.sign(steps[1])))


def run(folder: Path) -> Outcome:
    """Identifies, fits the rivals to test 0, chooses on the others and locates the support at every stop."""
    beam = Beam()
    stops = {test: read(folder, test, beam.drawn) for test in TESTS}
    fitter = Fitter(beam)

    def tried(rival: Rival) -> tuple[float, float, Fit]:
        fit = fitter.fit(rival, stops[FITTED])
        return fitter.unseen(fit, stops[CHOOSING]), fitter.unseen(fit, stops[REPORTED]), fit

    # of two that predict alike to 0.01 %, the one with fewer values
    ranked = sorted((tried(rival) for rival in RIVALS), key=lambda item: (round(item[0], 4), len(item[2].rival.shared)))
    shared = next(fit for _, _, fit in ranked if fit.rival is RIVALS[0]).shared
    locator = Locator(fitter, shared)
    rigid, elastic = (
        {test: [locator.located(s, elastic=give) for s in there] for test, there in stops.items()}
        for give in (False, True)
    )
    return Outcome(stops, ranked, tried(BARE), rigid, elastic)


def told(one: Located) -> str:
    """A place and the stretches not told from it, mm."""
    return f"{1e3 * one.x:6.1f} ({', '.join(f'{1e3 * a:.0f}-{1e3 * b:.0f}' for a, b in one.spans)})"


def main() -> None:
    """Prints frequencies, rivals, places and the line against the sensor."""
    out = run(data_folder())
    print("place in mm (not told from), the support rigid and with a stiffness of its own")
    print("test    V    f1 Hz    f2 Hz    f3 Hz     rigid             elastic")
    for test, stops in out.stops.items():
        for stop, rigid, elastic in zip(stops, out.rigid[test], out.elastic[test], strict=True):
            freq = " ".join(f"{f:8.2f}" for f in stop.freq)
            print(f"{test} {stop.volt:8.3f} {freq}   {told(rigid):17} {told(elastic)}")
    print(
        "\nmissing; cost and RMS error at test 0; RMS error of modes 2 and 3, unseen, of test 1 and of test 2; shared"
    )
    for chosen, reported, fit in (*out.ranked, out.bare):
        shared = ", ".join(f"{n} {v:.3g}" for n, v in fit.shared.items() if (n, v) not in fit.rival.fixed)
        print(
            f"{fit.rival.name:30} {fit.cost:7.1f} {100 * fit.rms:6.2f} %"
            f" {100 * chosen:6.2f} % {100 * reported:6.2f} %   {shared}"
        )
    (_, _, best), (_, _, bare) = out.ranked[0], out.bare
    low, high = 1e3 * best.sd.min(), 1e3 * best.sd.max()
    print(f"\n{best.rival.name}: places of test 0 with the shared values uncertain ± {low:.1f} to {high:.1f} mm")
    print(f"without the lumped mass: R^2 {line(out.volts(FITTED), bare.own).R2:.4f} in test {FITTED}")
    for tests in ((0,), (1,), (2,), (1, 2)):
        for kind in ("rigid", "elastic"):
            use = out.several(*tests) if kind == "elastic" else np.ones(len(out.volts(*tests)), dtype=bool)
            fitted = line(out.volts(*tests)[use], out.places(*tests, elastic=kind == "elastic")[use])
            print(
                f"test {' and '.join(map(str, tests)):7} {kind:8} R^2 {fitted.R2:.4f},"
                f" {fitted.slope:.1f} ± {fitted.sd:.1f} mm/V, at most {fitted.largest:.1f} mm off the line"
            )
    moved = [out.monotonic(test) for test in TESTS]
    print(f"monotonic: {moved}; travel {1e3 * np.ptp(out.places(*TESTS)):.0f} mm")


if __name__ == "__main__":
    main()
