"""How far the small model of a study is from the whole one where its parameters differ.

    python benches/basis_error.py ../shared/cases/c*/public/study.toml
    python benches/basis_error.py --without-moves STUDY ...    # without what parameters do to the modes

For every study accelerations per force of its sensors and first force over the band of its recordings, at factors of
the parameters 10 % and 20 % up (the first) and down (the others), with a loss factor of 2 %: RMS over lines and sensors
of the difference to the whole model, as a share of the RMS of the response.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.updating.update import modelled
from femend.estimate import FitRecord, fit_records, pair_test
from femend.model import Model, ReducedModel, read_model
from femend.model.reduced import parameter_moves
from femend.study import load_study

Complex = NDArray[np.complex128]

LINES, LOSS, APART = 60, 0.02, (0.0, 0.1, 0.2)


def whole(model: Model, factors: Mapping[str, float], record: FitRecord, freq: NDArray[np.float64]) -> Complex:
    """Accelerations (K, n_out) per force of one of all DOFs."""
    from scipy.sparse.linalg import spsolve

    K, M = model.matrices(dict(factors))
    T = model.transformation().tocsr()
    force, sensors = T[record.in_rows[:1]].T.toarray()[:, 0], T[record.out_rows]
    s2 = (2j * np.pi * freq) ** 2
    return np.array([s * (sensors @ spsolve((K * (1 + 1j * LOSS) + s * M).tocsc(), force)) for s in s2])


def small(reduced: ReducedModel, factors: Mapping[str, float], record: FitRecord, freq: NDArray[np.float64]) -> Complex:
    """The same in the basis."""
    K, M = reduced.K_fixed.astype(complex), reduced.M_fixed.copy()
    own = [factors.get(name, 1.0) for name in reduced.names]
    for term in reduced.terms:
        size = float(np.prod([own[i] ** power for i, power in term.exponents]))
        K += 0.0 if term.K is None else size * term.K
        M += 0.0 if term.M is None else size * term.M
    force, sensors = reduced.V[record.in_rows[0]], reduced.V[record.out_rows]
    s2 = (2j * np.pi * freq) ** 2
    return np.array([s * (sensors @ np.linalg.solve(K * (1 + 1j * LOSS) + s * M, force)) for s in s2])


def main() -> None:
    """Prints a row for each study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", type=Path, nargs="+")
    parser.add_argument("--without-moves", action="store_true")
    given = parser.parse_args()
    if given.without_moves:
        parameter_moves.ENOUGH = np.inf
    print("study                                    DOFs  basis" + "".join(f"{100 * a:9.0f} %" for a in APART))
    for path in given.studies:
        study = load_study(path)
        model = read_model(study.model_file, units=study.units, parameters=study.parameters)
        test = study.read_recordings()
        fitted = [r for r in test if r.role == "fit"]
        (record, *_) = fit_records(fitted, model, pair_test(test, model))
        model, reduced, problem = modelled(model, [record], study.damping_ratio, refine=False)
        freq = np.linspace(*problem.band, LINES)
        row = []
        for apart in APART:
            factors = {p.name: 1 - apart if i else 1 + apart for i, p in enumerate(model.parameters)}
            a, b = (f(m, factors, record, freq) for f, m in ((whole, model), (small, reduced)))
            row.append(np.linalg.norm(a - b) / np.linalg.norm(a))
        print(f"{str(path)[-38:]:38s}{model.fe.n_a:7d}{reduced.r:7d}" + "".join(f"{e:11.1e}" for e in row), flush=True)


if __name__ == "__main__":
    main()
