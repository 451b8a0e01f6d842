"""An overhung rotor whose bearings stiffen with the speed, for the tests of updating at speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend import SpinningPart
from femend.dof import Dof
from femend.estimate.updating import SpeedTerm, bearing_term, disc_term
from femend.model import Model, Parameter, read_model
from femend.model.terms.linear_terms import SpeedPower

Array = NDArray[np.float64]
BEARINGS, AXIS, DISC = (2, 6), 0, 9
SENSORS = tuple(Dof(n, c) for n in (2, 6, 8, 9) for c in (2, 3))
IP, ID = 0.05, 0.03
# rad/s; stiffness of a bearing over the speed W is K (k + growth (W / TOP)^2)
TOP, K = 400.0, 6.0e5
PARAMETERS = (
    Parameter("E", "E", "material", (1,), 0.1),
    Parameter("J disc", "m", "mass", (41,), 0.3),
    Parameter("k", "k1", "property_id", (21,), 0.3),
    Parameter("c", "c1", "property_id", (31,), 0.5),
)
CROSS = np.array([[0.0, 8.0e3], [-8.0e3, 0.0]])


def rotor(folder: Path, parameters: tuple[Parameter, ...] = PARAMETERS) -> Model:
    """A steel shaft of 0.8 m and 24 mm with a disc of 4 kg at its free end, on springs and dashpots at two nodes."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850."]
    lines += [f"GRID,{n},,{0.1 * (n - 1)},0.,0." for n in range(1, 10)]
    lines += ["PBAR,1,1,4.524-4,1.629-8,1.629-8,3.257-8"]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,1.,0." for n in range(1, 9)]
    # the disc's inertia has a card and a factor of its own
    lines += [f"CONM2,40,{DISC},,4.0", f"CONM1,41,{DISC},,0.,0.,0.,0.,0.,+A", f"+A,0.,0.,0.,0.,{IP},0.,0.,0.,+B"]
    lines += [f"+B,0.,{ID},0.,0.,0.,0.,0.,{ID}", f"PELAS,21,{K}", "PDAMP,31,120.0"]
    places = [(n, c) for n in BEARINGS for c in (2, 3)]
    lines += [f"CELAS1,{100 + i},21,{n},{c}" for i, (n, c) in enumerate(places)]
    lines += [f"CDAMP1,{200 + i},31,{n},{c}" for i, (n, c) in enumerate(places)]
    lines += [f"SPC1,1,14,{','.join(map(str, range(1, 8)))}", "SPC1,1,14,8,9", "ENDDATA"]
    path = folder / "rotor.bdf"
    path.write_text("\n".join(lines) + "\n")
    return read_model(path, parameters=parameters)


def parts() -> list[SpinningPart]:
    """The shaft, its disc among it."""
    return [SpinningPart((1.0, 0.0, 0.0), (*range(1, 9), 41))]


def terms(model: Model) -> list[SpeedTerm]:
    """Stiffness that grows with the speed squared at both bearings, and a cross-coupled one of an oil film."""
    return [
        bearing_term(model, "growth", BEARINGS, AXIS, K * np.eye(2), course=SpeedPower(2, TOP)),
        bearing_term(model, "film", BEARINGS, AXIS, CROSS, course=SpeedPower(1, TOP, signed=True)),
        disc_term(model, "coupling", 4, AXIS, 0.01),
    ]


def dense(model: Model, factors: Array, extra: Array, speed: float) -> tuple[Array, Array, Array]:
    """K, C, M (n, n) at `speed` in rad/s from the deck's matrices and tables of what turns, entry by entry.

    `factors` are the deck's, `extra` those of growth, film, and coupling; the shaft's own polar inertia is that of
    lumped pieces with 1 / 30, 4 / 30 and 1 / 10 of their slopes and deflections (Nelson and McVaugh, J. Eng. Ind. 98
    (1976) 593: G of a Rayleigh beam is 2 x its rotary inertia, across planes).
    """
    indptr, indices, *values = model.fe.assemble(factors)
    n = model.fe.n_a
    stiffness, M, C, _ = (csc_array((v, indices, indptr), shape=(n, n)).toarray() for v in values)
    T = model.transformation().toarray()

    def rows(node: int, *components: int) -> Array:
        return T[[model.row(Dof(node, c)) for c in components]]

    G, added = np.zeros((n, n)), np.zeros((n, n))
    for node, Ip in ((DISC, factors[1] * IP), (4, extra[2] * 0.01)):
        tilt = rows(node, 5, 6)
        G += tilt.T @ (Ip * np.array([[0.0, 1.0], [-1.0, 0.0]])) @ tilt
    L, per_length = 0.1, 7850.0 * 1.629e-8
    block = np.array([[36, 3 * L, -36, 3 * L], [3 * L, 4 * L**2, -3 * L, -(L**2)]])
    block = np.vstack([block, -block[0], [3 * L, -(L**2), -3 * L, 4 * L**2]]) * per_length / (30 * L)
    for e in range(1, 9):
        v = np.vstack([rows(e, 2, 6), rows(e + 1, 2, 6)])
        w = np.vstack([rows(e, 3), -rows(e, 5), rows(e + 1, 3), -rows(e + 1, 5)])
        # tilts theta_z = v', theta_y = -w' of all points: moments 2 rho I W theta_z' about y, against theta_y' about z
        G += 2 * (v.T @ block @ w - w.T @ block @ v)
    for node in BEARINGS:
        at = rows(node, 2, 3)
        added += at.T @ (extra[0] * K * (speed / TOP) ** 2 * np.eye(2) + extra[1] * CROSS * speed / TOP) @ at
    return stiffness + added, C + speed * G, M
