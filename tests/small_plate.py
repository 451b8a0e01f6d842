"""A plate on supports that may give way."""

from __future__ import annotations

from pathlib import Path

from femend.model import Model, Parameter, Place, find_places, read_model

NX, NY, SIDE = 12, 8, 0.025
CORNERS = (1, 13, 105, 117)


def plate(folder: Path, held: tuple[int, ...], more: str = "", parameters: tuple[Parameter, ...] = ()) -> Model:
    """A plate on its corners; in-plane motion held everywhere, as for a plate that bends."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    lines += ["PSHELL,1,1,0.003,1,,1"]
    for j in range(NY + 1):
        for i in range(NX + 1):
            lines.append(f"GRID,{1 + i + (NX + 1) * j},,{i * SIDE:.3f},{j * SIDE:.3f},0.")
    for j in range(NY):
        for i in range(NX):
            n = 1 + i + (NX + 1) * j
            lines.append(f"CQUAD4,{1 + i + NX * j},1,{n},{n + 1},{n + NX + 2},{n + NX + 1}")
    lines += [f"SPC1,1,126,1,THRU,{(NX + 1) * (NY + 1)}", *(f"SPC1,1,3,{n}" for n in held)]
    lines += [*([more] if more else []), "ENDDATA", ""]
    path = folder / "plate.bdf"
    path.write_text("\n".join(lines))
    return read_model(path, parameters=parameters)


def supports(model: Model) -> list[Place]:
    return [p for p in find_places(model) if p.kind == "support"]
