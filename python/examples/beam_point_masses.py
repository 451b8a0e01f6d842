"""A cantilever with six point masses: their places from one FRF, with a model updated on ten known layouts.

The recordings (35 layouts, force near the clamp, accelerometer at the tip; de Sousa and Machado, Data in Brief 2024)
are not part of this project. The script looks for `data/beam_point_masses` in the folder FEMEND_SHARED, else in
`../shared` beside the project:

python python/examples/beam_point_masses.py

The model is the plain cantilever; what is not stated is fitted on ten layouts whose places are used: E / rho, the
clamp's rotational stiffness, the accelerometer, the masses (equal) with their radius of gyration, how far their middles
are from the stated places, and a frequency factor for each of five modes. Of the other 25 layouts the places take no
part but in the score. The places a priori scatter as those of the ten; draws of them are weighted by how the measured
frequencies (and levels between resonances) fit. What is compared, and how much more the model errs on layouts it was
not updated on, is chosen by leaving each of the ten out in turn. This is done with the first ten layouts, and, after it
had shown that later ones differ, with ten over the whole series.

What comes out: at known places the model predicts the frequencies of other layouts to 0.4 to 0.7 %, the mean of the
known layouts to 0.5 to 1.0 %. Places are found to 9.0 mm RMS (8.2 mm with ten over the series); their mean is 10.7
(10.5) mm off, places found of other layouts 12.3 (11.6) mm, a random layout that scatters alike 14.7 (14.8) mm. Within
10 mm are 75 % (79 %) of the masses against 65 % (71 %) of their mean and 53 % at random, and 24 % (24 %) of whole
layouts against 12 % (16 %) and 2 %; another number of draws moves these by a layout. An FRF cuts the placements not
told apart (90 %, cells of 10 mm) from about 3100 to 90 (5600 to 860).

What does not come out: a layout. Five frequencies are fewer than six places, the first mode hardly feels the masses
near the clamp, and levels did not help on the layouts left out. With the first ten, sets that should hold 90 % hold the
place of a mass in 80 % and a whole layout in 40 % of cases: something changed between layouts that no place does.
Errors of frequencies keep their sign over runs of layouts, as if the beam had been set up again. Ten layouts over the
series know of that, and hold 91 % and 80 %, in larger sets.
"""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import least_squares

from femend import FRF, Dof, identify_modes
from femend.data import Channel
from femend.model import read_model

FloatArray = NDArray[np.float64]

# layouts, and those with known places: the first ten, and ten over the whole series
LAYOUTS = tuple(range(1, 36))
TRAINING: Mapping[str, tuple[int, ...]] = {
    "first ten": LAYOUTS[:10],
    "ten over the series": tuple(int(i) for i in np.rint(np.linspace(1, 35, 10))),
}
# m: what is stated of the beam; its width is not, so that masses are fractions of the beam's (a width of 1 m is drawn)
LENGTH, THICKNESS = 0.38, 0.00475
# Pa, kg/m^3: a metal's; nobody states which, and the factor on E / rho is fitted
E, RHO = 200e9, 7850.0
ELEMENTS, MODES = 38, 14
MASSES = 6
# Hz: one bending mode each; the sixth mode (1850 to 2000 Hz) is double in a third of the layouts, and torsion is left
# out (252 and 600 Hz)
BANDS = ((17.0, 27.0), (120.0, 160.0), (350.0, 420.0), (690.0, 800.0), (1090.0, 1200.0))
# Hz: levels between the resonances, clear of torsion; below 400 Hz they scatter by 1 dB with the layout's gain left out
LEVELS = ((430.0, 490.0), (530.0, 570.0), (640.0, 680.0), (840.0, 900.0), (940.0, 1000.0))
# where the force acts (m): "near the clamp"; between 10 and 60 mm the levels change by the same factor in all layouts
FORCE = 0.02
# unknowns: factor on E / rho; rotational stiffness of the clamp over E I / L; accelerometer at `place` (m) of a mass
# and a radius of gyration (m); the six masses, equal, with theirs; and how far their middles are from the stated places
START = {
    "E": 1.0, "clamp": 50.0, "accelerometer": 0.05, "accelerometer radius": 0.015, "mass": 0.03, "radius": 0.01,
    "offset": 0.01,
}  # fmt: skip
# 1-sigma of their logarithms (of the offset, m): what can be guessed beforehand
PRIOR = {
    "E": 0.2, "clamp": 3.0, "accelerometer": 1.5, "accelerometer radius": 0.75, "mass": 1.5, "radius": 0.75,
    "offset": 0.01,
}  # fmt: skip
TIP = 0.375
# relative error of a frequency and of a level that the fit starts from; frequency factors of the modes, in all layouts
FREQ_SD, LEVEL_SD, FACTOR_SD = 0.003, 0.03, 0.02
# chosen by leaving training layouts out: what is compared, and the factor on the deviations of what the update leaves
# (taken as independent: ten layouts do not determine their covariance)
FEATURES: Mapping[str, slice] = {"frequencies": slice(0, len(BANDS)), "frequencies and levels": slice(None)}
FACTORS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0)
# m: places a true one is as likely as, in the score of that choice
NEAR = 0.004
# draws of layouts as the training ones scatter, and for that choice; so many at once; m between neighbours at least
DRAWS, FEWER, CHUNK, APART = 40_000, 8000, 5000, 0.01
# m: side of a cell of a placement, and how near a place must be to be a hit
CELL, TOLERANCES = 0.01, (0.005, 0.01)
LEVEL = 0.9


@dataclass(frozen=True, eq=False)
class Layout:
    """A layout: places (6,) in m as stated, ln of five frequencies (Hz), nan if not seen, and five levels (ln of
    magnitude less their mean, which is the layout's gain)."""

    number: int
    x: FloatArray
    freq: FloatArray
    level: FloatArray

    @property
    def features(self) -> FloatArray:
        """Frequencies and levels (10,)."""
        return np.concatenate([self.freq, self.level])


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "beam_point_masses"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/beam_point_masses")
    return folder


def places(file: Path) -> dict[int, FloatArray]:
    """{layout: places (6,) in m}; the sheet says mm and holds cm. Raises ValueError for a row without six numbers."""
    main = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
    with zipfile.ZipFile(file) as book:
        sheet = ET.fromstring(book.read("xl/worksheets/sheet1.xml"))
    cells = {
        str(cell.get("r")): float(str(cell.findtext(f"{main}v")))
        for cell in sheet.iter(f"{main}c")
        if cell.get("t") != "s" and cell.find(f"{main}v") is not None
    }
    out = {}
    for number in LAYOUTS:
        row = [cells.get(f"{column}{number + 2}") for column in "BCDEFG"]
        if cells.get(f"A{number + 2}") != number or None in row:
            raise ValueError(f"{file.name}: row {number + 2} does not hold layout {number} and its six places")
        out[number] = np.array(row, dtype=np.float64) / 100
    return out


def read(folder: Path, number: int, x: FloatArray) -> Layout:
    """A layout with what is used of its FRF."""
    freq, dB, degrees = np.loadtxt(folder / f"P-{number}.txt", skiprows=1).T
    H = 10 ** (dB / 20) * np.exp(1j * np.radians(degrees))
    outputs, inputs = (Channel(Dof(2, 3), "acceleration", "m/s^2"),), (Channel(Dof(1, 3), "force", "N"),)
    frf = FRF(f"layout {number}", freq, H[:, None, None], outputs, inputs, "accelerance", "m/s^2/N")
    found = []
    for band in BANDS:
        modes = identify_modes(frf, band, max_order=10).modes
        peak = [float(np.abs(H[np.argmin(np.abs(freq - f))])) for f in modes.freq]
        found.append(float(modes.freq[np.argmax(peak)]) if peak else np.nan)
    level = np.array([dB[(freq > a) & (freq < b)].mean() for a, b in LEVELS]) * np.log(10) / 20
    return Layout(number, x, np.log(found), level - level.mean())


class Beam:
    """The cantilever in its own modes and the rigid rotation about its clamp, for many layouts at once."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            deck = Path(folder) / "cantilever.bdf"
            deck.write_text(deck_text(), encoding="ascii")
            model = read_model(deck)
        K, M = (A.toarray() for A in model.matrices())
        self.step = LENGTH / ELEMENTS
        mass = RHO * THICKNESS * LENGTH
        node = np.rint(model.xyz[np.searchsorted(model.node_ids, model.fe.dof_nodes), 0] / self.step).astype(int)
        turning = model.fe.dof_components == 5
        kept = np.flatnonzero((node > 0) | ~turning)
        phi = eigh(K[np.ix_(kept, kept)], M[np.ix_(kept, kept)], subset_by_index=[0, MODES - 1])[1]
        basis = np.zeros((len(K), MODES + 1))
        basis[kept, :MODES] = phi * np.sqrt(mass)
        basis[:, MODES] = np.where(turning, -1.0, node * self.step)
        # deflection and slope dw/dx = -theta_y at every node by the basis, and matrices by the beam's mass
        self.nodal = np.zeros((ELEMENTS + 1, 2, MODES + 1))
        self.nodal[node, turning.astype(int)] = np.where(turning, -1.0, 1.0)[:, None] * basis
        self.K, self.M = basis.T @ K @ basis / mass, basis.T @ M @ basis / mass
        # E I / L by the beam's mass
        self.turn = E * THICKNESS**3 / 12 / LENGTH / mass

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Deflection and slope at x (...) m by the basis (..., MODES + 1), cubic between nodes."""
        x = np.clip(x, 0.0, LENGTH)
        h = self.step
        element = np.minimum((x / h).astype(int), ELEMENTS - 1)
        u = x / h - element
        w = (1 - 3 * u**2 + 2 * u**3, h * (u - 2 * u**2 + u**3), 3 * u**2 - 2 * u**3, h * (u**3 - u**2))
        d = ((6 * u**2 - 6 * u) / h, 1 - 4 * u + 3 * u**2, (6 * u - 6 * u**2) / h, 3 * u**2 - 2 * u)
        rows = [self.nodal[element + i // 2, i % 2] for i in range(4)]
        deflection, slope = (sum(N[..., None] * row for N, row in zip(s, rows, strict=True)) for s in (w, d))
        return np.asarray(deflection), np.asarray(slope)

    def features(self, p: Mapping[str, float], x: FloatArray) -> FloatArray:
        """ln of frequencies (Hz) and levels (n, 10) of layouts x (n, 6)."""
        K = self.K * p["E"]
        K[-1, -1] += p["clamp"] * self.turn
        w, d = self.at(x + p["offset"])
        tip, tilt = self.at(np.array([TIP]))
        sensor = tip.T @ tip + p["accelerometer radius"] ** 2 * tilt.T @ tilt
        added = w.transpose(0, 2, 1) @ w + p["radius"] ** 2 * d.transpose(0, 2, 1) @ d
        M = self.M + p["accelerometer"] * sensor + p["mass"] * added
        # K is the same in all layouts: M v = K v / omega^2
        inverse = np.linalg.inv(np.linalg.cholesky(K))
        flexibility, v = np.linalg.eigh(inverse @ M @ inverse.T)
        squares = 1 / flexibility[:, ::-1]
        phi = inverse.T @ v[:, :, ::-1] * np.sqrt(squares)[:, None, :]
        force = self.at(np.array([FORCE]))[0]
        residues = (force @ phi)[:, 0] * (tip @ phi)[:, 0]
        omega = 2 * np.pi * np.array([(a + b) / 2 for a, b in LEVELS])
        H = np.sum(residues[:, None, :] / (squares[:, None, :] - omega[:, None] ** 2), axis=-1)
        level = np.log(omega**2 * np.abs(H))
        return np.hstack(
            [np.log(squares[:, : len(BANDS)]) / 2 - np.log(2 * np.pi), level - level.mean(axis=1, keepdims=True)]
        )


def deck_text() -> str:
    """The cantilever along X in ELEMENTS bars that bend in Z; its clamp may turn."""
    inertia, last = THICKNESS**3 / 12, ELEMENTS + 1
    lines = [
        "SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1",
        f"MAT1,1,{E:.4e},,0.3,{RHO}", f"PBAR,1,1,{THICKNESS:.6e},{inertia:.6e},{THICKNESS / 12:.6e},{4 * inertia:.6e}",
        f"SPC1,1,1246,1,THRU,{last}", "SPC1,1,3,1",
    ]  # fmt: skip
    lines += [f"GRID,{i + 1},,{LENGTH * i / ELEMENTS:.8f},0.,0." for i in range(last)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,0.,1." for i in range(1, last)]
    return "\n".join([*lines, "ENDDATA", ""])


@dataclass(frozen=True, eq=False)
class Updated:
    """Parameters, what is added to the model's features (10,) in all layouts (frequency factors, level errors), the
    standard deviations (10,) of what is left, and the mean and deviation of places (6,)."""

    p: dict[str, float]
    shift: FloatArray
    sd: FloatArray
    mean: FloatArray
    spread: FloatArray


def update(beam: Beam, layouts: Sequence[Layout]) -> Updated:
    """The model updated on layouts whose places are known."""
    x, measured = np.array([one.x for one in layouts]), np.array([one.features for one in layouts])
    names, n = list(START), len(START)
    sd = np.concatenate([np.full(len(BANDS), FREQ_SD), np.full(len(LEVELS), LEVEL_SD)])
    shift_sd = np.concatenate([np.full(len(BANDS), FACTOR_SD), np.full(len(LEVELS), np.inf)])

    def values(c: FloatArray) -> dict[str, float]:
        out = {name: START[name] * float(np.exp(PRIOR[name] * z)) for name, z in zip(names, c, strict=True)}
        out["offset"] = START["offset"] + PRIOR["offset"] * float(c[names.index("offset")])
        return out

    def shifted(off: FloatArray) -> FloatArray:
        # closed form: the mean error, drawn to zero by its prior
        count = np.isfinite(off).sum(axis=0)
        return np.nansum(off, axis=0) / (count + (sd / shift_sd) ** 2)

    def residual(c: FloatArray) -> FloatArray:
        off = measured - beam.features(values(c), x)
        shift = shifted(off)
        return np.concatenate([np.nan_to_num((off - shift) / sd).ravel(), shift / shift_sd, c])

    found = least_squares(residual, np.zeros(n), diff_step=np.full(n, 1e-4))
    p = values(found.x)
    off = measured - beam.features(p, x)
    shift = shifted(off)
    # of n parameters each feature bears its share
    freedom = len(layouts) - 1 - n / len(sd)
    left = np.sqrt(np.nansum((off - shift) ** 2, axis=0) / freedom)
    return Updated(p, shift, left, x.mean(axis=0), x.std(axis=0, ddof=1) * np.sqrt(1 + 1 / len(layouts)))


def drawn(model: Updated, n: int) -> FloatArray:
    """Layouts (<= n, 6) that scatter as the known ones do, the masses in order."""
    x = model.mean + model.spread * np.random.default_rng(1).standard_normal((n, MASSES))
    return x[np.diff(x, axis=1).min(axis=1) > APART]


def of_all(beam: Beam, model: Updated, x: FloatArray) -> FloatArray:
    """Features (n, 10) of many layouts (n, 6) by the updated model."""
    parts = [beam.features(model.p, x[i : i + CHUNK]) for i in range(0, len(x), CHUNK)]
    return np.concatenate(parts) + model.shift


def likelihood(predicted: FloatArray, one: Layout, sd: FloatArray, use: slice) -> FloatArray:
    """ln likelihood (n,) of layouts with features `predicted` (n, 10); what was not seen does not count."""
    z = np.nan_to_num((predicted - one.features) / sd)[:, use]
    return np.asarray(-0.5 * np.sum(z**2, axis=1))


def weights(exponent: FloatArray) -> FloatArray:
    """Posterior weights (n,) of draws from the prior by their ln likelihood (n,)."""
    w = np.exp(exponent - exponent.max())
    return np.asarray(w / w.sum())


@dataclass(frozen=True, eq=False)
class Choice:
    """What is compared and the factor on its deviations, with the mean log density of true places left out (1/m); and
    the RMS errors (m) of places left out and of the mean place as a guess."""

    features: str
    factor: float
    score: float
    error: float
    guess: float


def chosen(beam: Beam, layouts: Sequence[Layout]) -> Choice:
    """Leaves each known layout out in turn and finds its places."""
    options = list(product(FEATURES, FACTORS))
    scores: list[list[float]] = [[] for _ in options]
    errors: list[list[FloatArray]] = [[] for _ in options]
    guesses = []
    for one in layouts:
        model = update(beam, [other for other in layouts if other is not one])
        x = drawn(model, FEWER)
        predicted = of_all(beam, model, x)
        near = np.exp(-0.5 * ((x - one.x) / NEAR) ** 2) / (NEAR * np.sqrt(2 * np.pi))
        guesses.append(model.mean - one.x)
        for i, (name, factor) in enumerate(options):
            w = weights(likelihood(predicted, one, factor * model.sd, FEATURES[name]))
            # a place that no draw is near counts as one in ten thousand
            scores[i].append(float(np.mean(np.log(w @ near + 1e-4 / LENGTH))))
            errors[i].append(w @ x - one.x)
    best = int(np.argmax(np.mean(scores, axis=1)))
    error, guess = (float(np.sqrt(np.mean(np.square(e)))) for e in (errors[best], guesses))
    return Choice(options[best][0], options[best][1], float(np.mean(scores[best])), error, guess)


@dataclass(frozen=True, eq=False)
class Found:
    """A layout's places (6,) in m: mean and deviation; number of cells of each mass that hold LEVEL of the posterior,
    and whether the true one is among them (6,); the same of placements, cells of all six."""

    x: FloatArray
    sd: FloatArray
    cells: NDArray[np.int64]
    covered: NDArray[np.bool_]
    placements: float
    held: bool


class Finder:
    """Summaries of draws x (n, 6) from the prior by their likelihood."""

    def __init__(self, x: FloatArray, model: Updated) -> None:
        self.x, self.model = x, model
        self.prior = self.density(x)
        self.cells = np.floor(x / CELL).astype(np.int64)

    def density(self, x: FloatArray) -> FloatArray:
        """ln density (n,) of layouts a priori (1/m^6); the few that are out of order are left aside."""
        z = (x - self.model.mean) / self.model.spread
        return np.asarray(-0.5 * np.sum(z**2 + np.log(2 * np.pi * self.model.spread**2), axis=1))

    def found(self, exponent: FloatArray, true: FloatArray, at_true: float) -> Found:
        """What ln likelihoods (n,) tell, held against the true places (6,) with theirs."""
        w = weights(exponent)
        mean = w @ self.x
        sd = np.sqrt(w @ (self.x - mean) ** 2)
        each = [self.smallest(w, i, float(true[i])) for i in range(MASSES)]
        # the region of highest density; its volume is the mean of 1 / prior over draws from the prior
        posterior = self.prior + exponent
        order = np.argsort(-posterior)
        inside = order[: int(np.searchsorted(np.cumsum(w[order]), LEVEL)) + 1]
        volume = float(np.sum(np.exp(-self.prior[inside]))) / len(w)
        held = float(self.density(true[None])[0]) + at_true >= posterior[inside[-1]]
        cells, covered = np.array([n for n, _ in each]), np.array([hit for _, hit in each])
        return Found(mean, sd, cells, covered, volume / CELL**MASSES, bool(held))

    def smallest(self, w: FloatArray, i: int, true: float) -> tuple[int, bool]:
        """Number of a mass's cells in the smallest set with LEVEL of the weights, and is the true one among them?"""
        first = int(self.cells[:, i].min())
        weight = np.bincount(self.cells[:, i] - first, weights=w)
        order = np.argsort(-weight)
        n = int(np.searchsorted(np.cumsum(weight[order]), LEVEL)) + 1
        return n, int(true // CELL) - first in order[:n].tolist()


@dataclass(frozen=True, eq=False)
class Outcome:
    """The update and the choice made on the training layouts; the reported layouts, what is found of each, and what
    is known of it without its FRF; random guesses (n_guesses, n_layouts, 6)."""

    model: Updated
    choice: Choice
    layouts: list[Layout]
    predicted: FloatArray
    trained: FloatArray
    places: list[Found]
    prior: list[Found]
    guesses: FloatArray

    def errors(self, guess: str) -> FloatArray:
        """Errors (..., n_layouts, 6) in m: of what was "found", of what was found of every "other" layout, of the
        "mean" place of the training layouts, and of "random" layouts that scatter as these."""
        true = np.array([one.x for one in self.layouts])
        if guess == "random":
            return self.guesses - true
        places = np.array([one.x for one in (self.prior if guess == "mean" else self.places)])
        if guess == "other":
            return np.array([np.roll(places, shift, axis=0) - true for shift in range(1, len(true))])
        return places - true

    def hits(self, guess: str, tolerance: float) -> tuple[float, float]:
        """Shares of masses, and of layouts with all six, within a tolerance (m)."""
        near = np.abs(self.errors(guess)) <= tolerance
        return float(near.mean()), float(near.all(axis=-1).mean())

    def frequency_errors(self) -> tuple[FloatArray, FloatArray]:
        """RMS relative errors (5,) of frequencies at known places: by the model, and by the training layouts' mean."""
        freq = np.array([one.freq for one in self.layouts])
        n = len(BANDS)
        by_model, by_mean = self.predicted[:, :n] - freq, self.trained[:n] - freq
        return np.sqrt(np.nanmean(by_model**2, axis=0)), np.sqrt(np.nanmean(by_mean**2, axis=0))


def read_all(folder: Path) -> list[Layout]:
    """All layouts."""
    stated = places(folder / "Mass position.xlsx")
    return [read(folder, number, stated[number]) for number in LAYOUTS]


def run(layouts: Sequence[Layout], training: Sequence[int]) -> Outcome:
    """Updates and chooses on the training layouts, then finds the places of the others."""
    beam = Beam()
    known = [one for one in layouts if one.number in training]
    others = [one for one in layouts if one.number not in training]
    choice, model = chosen(beam, known), update(beam, known)
    x = drawn(model, DRAWS)
    finder, predicted = Finder(x, model), of_all(beam, model, x)
    at_true = of_all(beam, model, np.array([one.x for one in others]))
    sd, use = choice.factor * model.sd, FEATURES[choice.features]
    return Outcome(
        model,
        choice,
        others,
        at_true,
        np.nanmean([one.features for one in known], axis=0),
        [
            finder.found(likelihood(predicted, one, sd, use), one.x, float(likelihood(there[None], one, sd, use)[0]))
            for one, there in zip(others, at_true, strict=True)
        ],
        [finder.found(np.zeros(len(x)), one.x, 0.0) for one in others],
        x[: 100 * len(others)].reshape(100, len(others), MASSES),
    )


def tell(out: Outcome) -> None:
    """Prints the update, the prediction of frequencies and the score of places."""
    n = len(BANDS)
    print(", ".join(f"{name} {value:.3g}" for name, value in out.model.p.items()))
    shift, left = 100 * out.model.shift[:n], 100 * out.model.sd[:n]
    print("frequency factors, %:", np.round(shift, 2), "left, %:", np.round(left, 2))
    print(
        f"chosen by leaving one out: {out.choice.features}, deviations times {out.choice.factor}; places left out"
        f" {1e3 * out.choice.error:.1f} mm RMS, by their mean {1e3 * out.choice.guess:.1f} mm"
    )
    by_model, by_mean = out.frequency_errors()
    print("frequencies of the other layouts at known places, RMS error %:", np.round(100 * by_model, 2))
    print("by the mean of the training layouts:                          ", np.round(100 * by_mean, 2))
    print("layout  found less true, mm (deviation)                                     placements of 90 %, truth in")
    for one, place in zip(out.layouts, out.places, strict=True):
        off = " ".join(f"{1e3 * e:+5.0f} ({1e3 * s:2.0f})" for e, s in zip(place.x - one.x, place.sd, strict=True))
        print(f"{one.number:6}  {off}   {place.placements:6.0f} {'yes' if place.held else 'no'}")
    print("RMS error by mass, mm; of all; masses and whole layouts within 5 mm, within 10 mm")
    for guess in ("found", "mean", "other", "random"):
        e = out.errors(guess)
        each = np.sqrt(np.mean(e**2, axis=tuple(range(e.ndim - 1))))
        hits = ", ".join("{:.0f} % {:.0f} %".format(*(100 * h for h in out.hits(guess, t))) for t in TOLERANCES)
        print(f"{guess:7} {np.round(1e3 * each, 1)} {1e3 * np.sqrt(np.mean(e**2)):.1f}; {hits}")
    print("sets of 90 %: cells of 10 mm by mass (median), true one in; placements (median), true one in")
    for name, all_of in (("found", out.places), ("without FRF", out.prior)):
        print(
            f"{name:12} {np.median([one.cells for one in all_of], axis=0)}"
            f" {100 * np.mean([one.covered for one in all_of]):.0f} %;"
            f" {np.median([one.placements for one in all_of]):.0f}"
            f" {100 * np.mean([one.held for one in all_of]):.0f} %"
        )


def main() -> None:
    """Both ways to choose the layouts that are known."""
    layouts = read_all(data_folder())
    for name, training in TRAINING.items():
        print(f"\nupdated on the {name}: {training}")
        tell(run(layouts, training))


if __name__ == "__main__":
    main()
