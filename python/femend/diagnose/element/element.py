"""The law of an element that was measured by itself: displacement and force both known, no structure around it.

What a testing machine records of a damper, a mount or a joint is enough to name its law: every law of the catalogue is
fitted to the force along the measured motion, beside a spring, a dashpot and the zero of the force channel, and judged
on a part of the recordings that no fit has seen. A free-form force tells how much a law could have explained at best.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.diagnose.element.element_law import ElementLaw, Loop, fit_law, fit_linear_element
from femend.diagnose.element.element_law import refitted as refit_law
from femend.diagnose.evidence import price
from femend.diagnose.settings import Settings
from femend.errors import RecordingError
from femend.physics import Physics, catalogue, fit_free_form, physics

__all__ = ["ElementFit", "fit_element", "refit_element"]

FloatArray = NDArray[np.float64]

# share at the end of every recording that is kept for the choice between laws
KEPT = 1 / 3
# score by which a law has to be ahead to be told from another: odds of 20 to 1
TOLD = 6.0
# share of the samples that count as independent above which a residual is noise: neighbours correlate by less than 1/3
WHITE = 0.5
# laws that can follow anything: what they leave is the measure for the others
_SURROGATES = ("iwan", "free_form")
# the spring and dashpot beside every law are these already
_COMPANION = ("support_stiffness", "viscous_damper")
SHORTEST = 32


@dataclass(frozen=True, eq=False, repr=False)
class ElementFit:
    """Laws of a measured element in rising order of score; `fit["bouc_wen"]` is the fit of that law.

    Attributes:
        ranked: the laws; `score` is the tempered log likelihood on the part kept back plus a price for each parameter.
        free: share of the force's power that the free-form force leaves on the part kept back.
        n_values: effective number of independent values there (the residual of neighbouring samples is alike).
        n_kept: number of samples there.
        settings: thresholds.
    """

    ranked: tuple[ElementLaw, ...]
    free: float
    n_values: float
    n_kept: int
    settings: Settings

    @property
    def best(self) -> ElementLaw:
        """The law that predicts the part kept back best."""
        return self.ranked[0]

    @property
    def margin(self) -> float:
        """Score by which the best law is ahead of the next one; a few units do not tell two laws apart."""
        return self.ranked[1].score - self.ranked[0].score if len(self.ranked) > 1 else float("inf")

    @property
    def alike(self) -> tuple[str, ...]:
        """Laws that the part kept back does not tell from the best one, the best one first."""
        return tuple(law.tried for law in self.ranked if law.score - self.best.score < TOLD)

    @property
    def adequate(self) -> bool:
        """Whether the best law leaves about as little as a free-form force does; else its name is a guess.

        The free form is coarse (nine knots over displacement): a law outside the catalogue that is like one inside
        often passes. `to_noise` is the stricter question.
        """
        return self.best.chosen <= self.settings.adequate * self.free

    @property
    def to_noise(self) -> bool:
        """Whether what the best law leaves looks like noise: neighbouring samples mostly unlike each other. Where it
        does not, something is left that no law of the catalogue has, or the force was filtered far below its rate."""
        return self.n_values > WHITE * self.n_kept

    def __getitem__(self, name: str) -> ElementLaw:
        for law in self.ranked:
            if law.tried == name:
                return law
        raise KeyError(f"no law {name!r} was fitted; there are {[law.tried for law in self.ranked]}")

    def __repr__(self) -> str:
        rows = [f"{'law':<22}{'unseen NRMSE':>14}{'score above best':>18}"]
        for law in self.ranked:
            became = "" if law.name == law.tried else f"   is a {law.name}"
            rows.append(f"{law.tried:<22}{law.chosen**0.5:>14.3f}{law.score - self.best.score:>18.1f}{became}")
        return "\n".join([*rows, f"{'free form':<22}{self.free**0.5:>14.3f}"])


def fit_element(
    d: ArrayLike | Sequence[ArrayLike],
    v: ArrayLike | Sequence[ArrayLike] | None,
    f: ArrayLike | Sequence[ArrayLike],
    dt: float,
    *,
    laws: Iterable[str | Physics] | None = None,
    settings: Settings | None = None,
) -> ElementFit:
    """Names the law of an element from its displacement `d` (m), velocity `v` (m/s) and force `f` (N) at steps of `dt`.

    Each of `d`, `v`, `f` is one record (n,) or a sequence of records that start from rest; any consistent units will
    do, and parameters come out in them. Without `v` it is the central difference of `d`. `f` is positive where it acts
    against a positive displacement. `laws` are names or entries of `femend.physics` (the whole catalogue by default).
    The last third of every record is kept for the choice. Raises RecordingError for records that do not fit together,
    are too short or have no motion, and LawParameterError for a name that is no law.

    The score is `n_values * ln(share left) + price * parameters` (Gaussian likelihood with the variance profiled out;
    Schwarz 1978 with the price of `Settings`), the number of values tempered by the residual's own correlation
    (Bayley and Hammersley, J. R. Stat. Soc. Suppl. 8 (1946) 184: n (1 - rho) / (1 + rho)).

    >>> t = np.arange(3000) * 1e-3
    >>> d = np.sin(2 * np.pi * t) * t
    >>> fitted = fit_element(d, None, 2 * d + 5 * d**3, 1e-3, laws=["cubic_stiffness", "clearance"])
    >>> fitted.best.name, round(fitted.best.values["k3"], 3), round(fitted.best.k, 3)
    ('cubic_stiffness', 5.0, 2.0)
    """
    settings = settings or Settings()
    loops = _loops(d, v, f, dt)
    seen = [loop.n - int(KEPT * loop.n) for loop in loops]
    found = [fit_linear_element(loops, seen)]
    for entry in _entries(laws):
        fitted = fit_law(entry, loops, seen)
        found += [] if fitted is None else [fitted]
    n_values = _effective(min(found, key=lambda law: law.chosen), loops, seen)
    ranked = sorted((law.scored(n_values, price(settings, n_values)) for law in found), key=lambda law: law.score)
    kept = sum(loop.n - n for loop, n in zip(loops, seen, strict=True))
    return ElementFit(tuple(ranked), _free_form(loops, seen), n_values, kept, settings)


def refit_element(
    law: ElementLaw,
    free: Sequence[str],
    d: ArrayLike | Sequence[ArrayLike],
    v: ArrayLike | Sequence[ArrayLike] | None,
    f: ArrayLike | Sequence[ArrayLike],
    dt: float,
) -> ElementLaw:
    """A fitted `law` with its parameters `free` alone fitted anew to records of another setting.

    `d`, `v`, `f` (each (n,) or a sequence of records) and `dt` are as for `fit_element`. Everything else stays: spring,
    dashpot and zero beside it too. `chosen` of what comes back is NaN, nothing having been kept back. Raises as
    `fit_element`, and LawParameterError for a name that is no free parameter of the law.
    """
    return refit_law(law, free, _loops(d, v, f, dt))


def _loops(
    d: ArrayLike | Sequence[ArrayLike], v: ArrayLike | Sequence[ArrayLike] | None, f: ArrayLike | Sequence[ArrayLike],
    dt: float,
) -> list[Loop]:  # fmt: skip
    """Records as loops; raises RecordingError as `fit_element`."""
    ds, fs = _records(d), _records(f)
    vs = [np.gradient(x, dt) if len(x) > 1 else x for x in ds] if v is None else _records(v)
    if not (len(ds) == len(vs) == len(fs)):
        raise RecordingError(f"{len(ds)} displacement, {len(vs)} velocity and {len(fs)} force records do not pair up")
    if not dt > 0:
        raise RecordingError(f"the time step {dt} s is not positive")
    for i, (x, y, z) in enumerate(zip(ds, vs, fs, strict=True)):
        _refuse(i, x, y, z)
    return [Loop(x, y, z, dt) for x, y, z in zip(ds, vs, fs, strict=True)]


def _refuse(i: int, d: FloatArray, v: FloatArray, f: FloatArray) -> None:
    name = f"element record {i + 1}"
    if not (d.ndim == 1 and d.shape == v.shape == f.shape):
        raise RecordingError(
            f"{name}: displacement {d.shape}, velocity {v.shape} and force {f.shape} must be equally long",
            recording=name,
        )
    if len(d) < SHORTEST:
        raise RecordingError(f"{name}: {len(d)} samples are too few; give {SHORTEST} or more", recording=name)
    if not (np.isfinite(d).all() and np.isfinite(v).all() and np.isfinite(f).all()):
        raise RecordingError(f"{name} holds NaN or infinity; cut the gap out", recording=name)
    if np.ptp(d) == 0 or not f.any():
        what = "displacement does not move" if np.ptp(d) == 0 else "force is zero throughout"
        raise RecordingError(f"{name}: the {what}; there is no law to see in it", recording=name)


def _records(x: ArrayLike | Sequence[ArrayLike]) -> list[FloatArray]:
    if isinstance(x, np.ndarray):
        rows = [x] if x.ndim == 1 else list(x)
    else:
        rows = [np.asarray(r) for r in (x if isinstance(x, Sequence) else [x])]
        rows = [np.array(rows)] if rows and rows[0].ndim == 0 else rows
    return [np.ascontiguousarray(r, dtype=np.float64) for r in rows]


def _entries(laws: Iterable[str | Physics] | None) -> list[Physics]:
    """Entries to try: one for each force law, without those that stand beside every law and, by default, surrogates."""
    if laws is not None:
        return [law if isinstance(law, Physics) else physics(law) for law in laws]
    entries: dict[str, Physics] = {}
    for entry in catalogue(extended=True):
        if entry.law not in (*_SURROGATES, *_COMPANION):
            entries.setdefault(str(entry.law), entry)
    return list(entries.values())


def _effective(best: ElementLaw, loops: Sequence[Loop], seen: Sequence[int]) -> float:
    """Number of independent values kept back, by the correlation of neighbours in what the best law leaves."""
    total = 0.0
    for loop, n in zip(loops, seen, strict=True):
        e = (loop.f - best.force(loop.d, loop.v, loop.dt))[n:]
        e = e - e.mean()
        power = float(e @ e)
        rho = float(e[1:] @ e[:-1]) / power if power > 0 else 0.0
        total += len(e) * (1 - max(rho, 0.0)) / (1 + max(rho, 0.0))
    return max(total, 1.0)


def _free_form(loops: Sequence[Loop], seen: Sequence[int]) -> float:
    """Share of power that a smooth surface with a hysteretic surrogate leaves on the part kept back."""
    cut = [(loop.d[:n], loop.v[:n], loop.f[:n]) for loop, n in zip(loops, seen, strict=True)]
    zero = float(np.mean([np.mean(x[2]) for x in cut]))
    fit = fit_free_form([x[0] for x in cut], [x[1] for x in cut], [x[2] - zero for x in cut], loops[0].dt)
    left = power = 0.0
    for loop, n in zip(loops, seen, strict=True):
        e = (loop.f - zero - fit.force(loop.d, loop.v, loop.dt))[n:]
        left, power = left + float(e @ e), power + float(loop.f[n:] @ loop.f[n:])
    return left / power
