"""The public half of a case: bulk-data deck and study file in the style of a hand-made test case."""

from __future__ import annotations

from collections.abc import Sequence

from .structures import Structure


def num(x: float) -> str:
    """Nine digits and a decimal point (or exponent), as free-field bulk data wants it."""
    s = f"{x:.9g}"
    return s if "." in s or "e" in s else s + "."


def bulk(s: Structure) -> str:
    """The deck: grids, groups, bars, lumps, supports."""
    out = [
        "$ nominal model, SI units (m, kg, s, N)",
        "SOL 103",
        "CEND",
        "SPC = 1",
        "METHOD = 1",
        "BEGIN BULK",
        "EIGRL,1,,,20",
        "PARAM,COUPMASS,1",
    ]
    out += [f"GRID,{n},,{num(p[0])},{num(p[1])},{num(p[2])}" for n, p in sorted(s.xyz.items())]
    for pid, name in s.groups.items():
        q = s.sections[pid]
        out += [
            f"$ group {name}",
            f"MAT1,{pid},{num(s.E)},,0.33,2700.",
            f"PBAR,{pid},{pid},{num(q.A)},{num(q.I1)},{num(q.I2)},{num(q.J)}",
            "+,0.,0.,0.,0.,0.,0.,0.,0.",
            f"+,{q.shear:.6f},{q.shear:.6f}",
        ]
    eid = 1
    for m in s.members:
        for a, b in zip(m.chain[:-1], m.chain[1:], strict=True):
            out.append(f"CBAR,{eid},{m.pid},{a},{b},{num(m.v[0])},{num(m.v[1])},{num(m.v[2])}")
            eid += 1
    out += [f"CONM2,{90000 + k},{n},,{num(m)}" for k, (n, m) in enumerate(s.lumps.items(), 1)]
    out.append("SPC1,1,123456," + ",".join(map(str, s.clamped)))
    if s.held:
        rest = [n for n in sorted(s.xyz) if n not in s.clamped]
        out += [f"SPC1,1,{s.held}," + ",".join(map(str, rest[k : k + 6])) for k in range(0, len(rest), 6)]
    return "\n".join([*out, "ENDDATA", ""])


FITTED = ("low", "mid", "high")


def study(title: str, groups: dict[int, str], unmeasured: bool = False, fitted: Sequence[str] = FITTED) -> str:
    """The study file; parameters are the groups' moduli. `unmeasured`: no fit recording holds the shaker's force."""
    out = f'format = "femend-study/1"\ntitle = "{title}"\n\n[model]\nfile = "model.bdf"\nunits = "SI"\n\n'
    out += "[damping]\nratio = 0.01            # starting value of every mode\n"
    for pid, name in groups.items():
        out += f'\n[[parameter]]\nname = "E_{name}"\nproperty = "E"\nmaterial = {pid}\n'
        out += "prior_sd = 0.10         # relative\n"
    for name in (*fitted, "sweep", "random"):
        role = "predict" if name in ("sweep", "random") else "fit"
        known = role == "predict" or not unmeasured
        out += f'\n[[recording]]\nname = "{name}"\nfile = "{name}.uff"\nrole = "{role}"\n'
        out += f'excitation = "{"measured" if known else "unknown"}"\n'
    return out
