"""What a diagnosis says of effects from a few to a hundred times the noise, on the tests' cantilever:

    python benches/strong_effects.py [LAW ...]

One law at a time acts at the middle or at the tip of the beam, from weak to far stiffer or heavier than it. The truth
is simulated on the same mesh by the program's own core, so that this says nothing of meshes and of chance findings (the
cases of tests/blind do), only whether fits end where they should.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from math import pi
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import small_study

MODULI = (7.2e10, 6.9e10)
NODES = (9, 13)


def absorber(m: float, f: float, zeta: float = 0.03) -> dict[str, float]:
    """An oscillator of mass m (kg) tuned to f (Hz)."""
    omega = 2 * pi * f
    return {"m": m, "k": m * omega**2, "c": 2 * zeta * m * omega}


LAWS: dict[str, list[dict[str, float]]] = {
    "support_stiffness": [{"k": k} for k in (3e3, 1e4, 3e4, 6e4, 1e5, 3e5, 1e6)],
    "viscous_damper": [{"c": c} for c in (3.0, 30.0, 300.0, 3000.0)],
    "added_mass": [{"m": m} for m in (0.1, 1.0, 10.0)],
    "tuned_absorber": [absorber(*of) for of in ((0.05, 30.0), (0.3, 30.0), (1.0, 60.0), (0.3, 120.0))],
    "viscoelastic": [{"k0": k, "k1": k, "tau": 5e-3} for k in (3e3, 3e4, 3e5)],
    "quadratic_damping": [{"c": c} for c in (30.0, 1e3, 3e4)],
    "cubic_stiffness": [{"k3": k} for k in (3e7, 3e9)],
    "bilinear_stiffness": [{"k_plus": k, "k_minus": 0.3 * k} for k in (3e3, 3e4, 3e5)],
    "coulomb_friction": [{"f": f, "kt": k} for f, k in ((0.3, 1e4), (1.0, 1e5), (3.0, 1e5))],
}


def said_of(node: int, law: str, values: dict[str, float]) -> dict[str, Any]:
    """What is said of one law at a node: verdict, names, places, errors with the updated and the final model, CPU s."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        truth = small_study.Truth(MODULI, laws=[(node, law, values)])
        result = small_study.diagnosed(Path(folder), truth).result
    found = [(f["physics"], f["location"]["nodes"]) for f in result["findings"]]
    held = next(f for f in result["fit"] if f["role"] == "validate")
    told = result["verdict"] == "missing-physics"
    return {
        "located": any(node in nodes for _, nodes in found),
        "named": told and found == [(law, [node])],
        "wrong": told and all(name != law for name, _ in found),
        "said": f"{result['verdict']} {', '.join(f'{name or chr(63)} at {nodes}' for name, nodes in found)}",
        "errors": (held["parameters"], held["final"]),
        "seconds": time.process_time() - begun,
    }


def main() -> None:
    """Prints a line for each case, and the sums."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("laws", nargs="*", metavar="LAW", help=f"of {', '.join(LAWS)}; all where none is given")
    rows = []
    for law in parser.parse_args().laws or LAWS:
        for values in LAWS[law]:
            for node in NODES:
                row = said_of(node, law, values)
                rows.append(row)
                sizes = ", ".join(f"{name} {value:.3g}" for name, value in values.items())
                mark = "named" if row["named"] else "WRONG" if row["wrong"] else "-"
                before, after = row["errors"]
                print(
                    f"{mark:6s}{law:20s}node {node:3d}  {sizes:32s}{before:7.3f} ->{after:7.4f}  "
                    f"{row['seconds']:5.1f} s  {row['said']}",
                    flush=True,
                )
    sums = ", ".join(f"{sum(bool(r[key]) for r in rows)} {key}" for key in ("located", "named", "wrong"))
    print(f"{len(rows)} cases: {sums}; {sum(r['seconds'] for r in rows):.0f} s")


if __name__ == "__main__":
    main()
