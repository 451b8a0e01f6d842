"""Loads from responses, line by line, with their covariance and what can be relied on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import ODS
from femend.errors import LoadError
from femend.estimate.loads.regularise import Regularised, regularised_lines
from femend.estimate.loads.unit_responses import UnitResponses, matched

__all__ = ["Loads", "identify_loads"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# share of the responses that may stay unexplained, relative deviation of the loads, and share of them that the
# regularisation may hold back, where a line is reliable
UNEXPLAINED, UNCERTAIN, HELD_BACK = 0.10, 0.10, 0.10
# rounds in which the deviation that the FRFs' own errors make is brought up to date with the loads
ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Loads:
    """Complex amplitudes `values` (n_freq, n_loads) of the loads `names` in `units`, with phase as the responses'.

    `covariance` (n_freq, n_loads, n_loads) is E[d d^H] of their errors, from noise of the responses and of the unit
    responses (nan where nothing tells it). `resolution` (n_freq, n_loads): what of a unit of each load the solution
    would show, 1 without regularisation. `condition` (n_freq,) of the scaled matrix; `parameter` (n_freq,) the amount
    of regularisation chosen; `unexplained` (n_freq,) share of the responses that the loads leave; `excess` (n_freq,)
    squares left per free value, 1 where noise alone is left. `verdict` (n_freq,) is "reliable" or why not: "outside"
    what is credible, "unexplained", "uncertain", "regularised".
    """

    freq: FloatArray
    values: ComplexArray
    covariance: ComplexArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    resolution: FloatArray
    condition: FloatArray
    parameter: FloatArray
    unexplained: FloatArray
    excess: FloatArray
    verdict: tuple[str, ...]
    method: str
    choice: str
    left_out: tuple[str, ...] = ()

    @property
    def sd(self) -> FloatArray:
        """Standard deviations (n_freq, n_loads) of the complex amplitudes."""
        return np.asarray(np.sqrt(np.maximum(np.einsum("kii->ki", self.covariance).real, 0.0)))

    @property
    def reliable(self) -> NDArray[np.bool_]:
        """(n_freq,) True on lines to be relied on."""
        return np.array([v == "reliable" for v in self.verdict])

    def counts(self) -> dict[str, int]:
        """How many lines have each verdict."""
        return {v: self.verdict.count(v) for v in dict.fromkeys(self.verdict)}

    def __repr__(self) -> str:
        said = ", ".join(f"{n} {v}" for v, n in self.counts().items())
        return f"Loads({', '.join(self.names[:6])}: {len(self.freq)} lines, {said})"


def identify_loads(
    given: UnitResponses,
    shapes: ODS,
    *,
    method: str = "tikhonov",
    choice: str = "gcv",
    model_error: float = 0.0,
) -> Loads:
    """The loads that explain the responses `shapes` through the unit responses `given`: y = H f, every line by itself.

    `method` and `choice` regularise as `regularised_lines` says. Values are weighted by their deviation: sigma of the
    shapes, the deviations of H times the loads (so that an error of a measured FRF counts where its force is large),
    and `model_error`, a share of the line's mean response that no model explains. Deviations grow where more is left
    than they say. Without any of the three all responses count alike and what is left tells the noise.

    The deviation by errors of H is first order; what they make of the loads' size (regression dilution) is not removed.
    This is the matrix inversion of transfer-path analysis (van der Seijs, de Klerk and Rixen, MSSP 68-69 (2016)
    217-244, section 3.1; Thite and Thompson, J. Sound Vib. 264 (2003) 411-431).

    Raises LoadError for fewer responses than loads, lines or sensors that do not match and what `regularised_lines`
    raises.

    >>> from femend.data import Channel
    >>> from femend.dof import Dof
    >>> here = (Channel(Dof(1, 3), "acceleration", "m/s^2"), Channel(Dof(2, 3), "acceleration", "m/s^2"))
    >>> unit = UnitResponses(np.array([10.0]), np.array([[[2.0], [1.0]]]), here, ("motor",), ("N",))
    >>> found = identify_loads(unit, ODS("run", [10.0], [[6.0], [3.0]], here, "ods"))
    >>> round(float(abs(found.values[0, 0])), 6), found.verdict
    (3.0, ('reliable',))
    """
    here, rows, left_out = matched(given, shapes)
    y = np.asarray(shapes.shapes[list(rows)].T, dtype=np.complex128)
    n_out, n = here.H.shape[1:]
    if n_out < n:
        raise LoadError(
            f"{n_out} responses of {shapes.name!r} cannot tell {n} loads apart ({', '.join(here.names[:6])}); use at "
            f"least {n} responses, better twice as many, or leave loads out",
            n_responses=n_out,
            n_loads=n,
        )
    own = np.zeros(y.shape) if shapes.sigma is None else np.asarray(shapes.sigma[list(rows)].T)
    mean = np.sqrt((np.abs(y) ** 2).mean(axis=1, keepdims=True))
    variance, known = own**2 + (model_error * mean) ** 2, shapes.sigma is not None or model_error > 0
    solved, _ = solve_weighted(here, y, variance, known, method, choice)
    return _told(here, y, solved, known or here.sd is not None, (method, choice), left_out)


def solve_weighted(
    here: UnitResponses, y: ComplexArray, variance: FloatArray, known: bool, method: str, choice: str
) -> tuple[Regularised, FloatArray]:
    """The solution for `y` (K, m) with its own `variance` (K, m), and the weights (K, m) that it was found with.

    Where `here` has deviations, those that they make with the loads found are added, round by round.
    """
    tiny = 1e-12 * np.maximum((np.abs(y) ** 2).mean(axis=1, keepdims=True), 1e-300)
    if here.sd is None:
        w = 1.0 / np.sqrt(variance + tiny) if known else np.ones(y.shape)
        return regularised_lines(here.H * w[:, :, None], y * w, method, choice), w
    total = variance + tiny if known else np.ones(y.shape)
    for _ in range(ROUNDS):
        w = 1.0 / np.sqrt(total)
        solved = regularised_lines(here.H * w[:, :, None], y * w, method, choice)
        total = variance + tiny + np.einsum("kmn,kn->km", here.sd**2, np.abs(solved.x) ** 2)
    return solved, w


def _told(
    here: UnitResponses,
    y: ComplexArray,
    solved: Regularised,
    known: bool,
    how: tuple[str, str],
    left_out: tuple[str, ...],
) -> Loads:
    """Covariance, what is left, and a verdict for every line."""
    free = solved.freedom
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = np.where(free > 1e-6, solved.squares / free, np.nan)
    scale = np.where(np.isfinite(excess), np.maximum(excess, 1.0), 1.0) if known else excess
    covariance = solved.C * scale[:, None, None]
    size = np.linalg.norm(y, axis=1)
    left = np.linalg.norm(y - np.einsum("kmn,kn->km", here.H, solved.x), axis=1)
    unexplained = np.where(size > 0, left / np.where(size > 0, size, 1.0), 0.0)
    resolution = np.einsum("kii->ki", solved.resolution).real
    spread = np.sqrt(np.maximum(np.einsum("kii->k", covariance).real, 0.0))
    strength = np.linalg.norm(solved.x, axis=1)
    outside = np.zeros(len(y), dtype=bool) if here.credible is None else ~here.credible
    verdict = np.select(
        [
            outside,
            unexplained > UNEXPLAINED,
            ~(spread <= UNCERTAIN * strength),
            resolution.min(axis=1) < 1 - HELD_BACK,
        ],
        ["outside", "unexplained", "uncertain", "regularised"],
        "reliable",
    )
    return Loads(
        here.freq, solved.x, covariance, here.names, here.units, resolution, solved.condition, solved.parameter,
        unexplained, excess, tuple(str(v) for v in verdict), *how, left_out,
    )  # fmt: skip
