"""A law of one's own: registered in a few lines, put into a structure, and found again in its recordings.

python python/examples/own_law.py
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

import femend as fe
from femend import Test, _core
from femend.demo import STUDY
from femend.model import Model
from femend.physics import register
from femend.workflow import Named

TRUE = {"k": 8e4, "reach": 4e-4}
# samples that are used of each recording, and parts of a step in which the force is taken as linear
SAMPLES, FINE = 2048, 8


def force(d: float, v: float, k: float, reach: float) -> float:
    """A spring that saturates: slope k at rest, force k*reach far out."""
    return k * reach * np.tanh(d / reach)


def pretended(model: Model, test: Test, law: str) -> Test:
    """The recordings' forces, with the responses of a structure that has the law at node 3."""
    K, M = (a.toarray() for a in model.matrices())
    lam, phi = eigh(K, M, subset_by_value=(0, (2 * np.pi * 1500) ** 2))
    phi, omega = model.transformation() @ phi, np.sqrt(lam)
    at = [6 * model.index(node) + 2 for node in (3, 3, 4, 6, 7)]
    rng, out = np.random.default_rng(1), []
    for recording in test:
        measured = recording.data.values[0, :SAMPLES]
        u = np.fft.irfft(np.fft.rfft(measured, 2 * SAMPLES), 2 * SAMPLES * FINE)[: SAMPLES * FINE] * FINE
        y, *_ = _core.simulate(
            omega, np.full(len(omega), 0.012), phi[at[:1]], phi[at[1:]], phi[at[:1]], [[(law, TRUE)]],
            u[None], recording.data.dt / FINE, stride=FINE,
        )  # fmt: skip
        y = y + 0.01 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
        out.append(replace(recording, data=replace(recording.data, values=np.vstack([measured, y]))))
    return Test(tuple(out))


def main() -> Named:
    """Registers the law, makes recordings of a structure that has it, and asks which of three laws is missing."""
    law = register("tanh_spring", force, {"k": ("N/m", 1e4), "reach": ("m", 1e-3)})
    folder = STUDY.parent
    model = fe.read_model(folder / "model.bdf", parameters=["E:1", "E:2"])
    test = pretended(model, fe.read_recordings([folder / f"{level}.uff" for level in ("low", "mid", "high")]), law.name)
    start = fe.update(model, test, fe.pair(test, model), damping=0.01)
    where = fe.locate(start)
    what = fe.name(start, where, laws=[law, "cubic_stiffness", "clearance"])
    print(f"places where a free force explains most\n{where}\n\n{what}")
    return what


if __name__ == "__main__":
    main()
