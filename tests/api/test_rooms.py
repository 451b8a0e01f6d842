"""Within the large packages the rooms stand on one another: each imports from those before it alone.

The order is that of the table in `python/docs/architecture.md`; a room is a folder, or a module that stands beside
folders.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ORDER: dict[str, tuple[str, ...]] = {
    "model": (
        "parameter",
        "cards",
        "target_words",
        "geometry",
        "free_body",
        "known_mesh",
        "sensor_point",
        "model",
        "pairing",
        "sensor_frames",
        "surfaces",
        "patched",
        "reduced",
        "terms",
        "idealisation",
        "places",
        "mesh",
        "beddings",
    ),
    "diagnose": (
        "settings",
        "evidence",
        "locating",
        "fitting",
        "element",
        "updating",
        "recordings",
        "driven",
        "naming",
        "loads",
        "several",
        "deciding",
        "diagnosis",
        "responses_alone",
    ),
    "bench": ("page", "steps", "words", "reading", "doubting", "correlation", "planning", "updating", "populations"),
    "study": (
        "steps",
        "file",
        "doubts",
        "time_limit",
        "free_dashpots",
        "damping_told",
        "result",
        "shown",
        "staged",
        "run",
    ),
}
# rooms that no other room of their package leads to, nor they to one
APART: dict[str, frozenset[str]] = {"diagnose": frozenset({"staged", "residual"})}


def rooms_imported(source: str, package: str) -> set[str]:
    """Rooms of `package` that the text of a module imports from."""
    modules = [node.module for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom) and node.module]
    parts = [module.split(".") for module in modules]
    return {part[2] for part in parts if part[:2] == ["femend", package] and len(part) > 2}


def violations(folder: Path, order: tuple[str, ...], apart: frozenset[str]) -> list[str]:
    """Every import between rooms of the package in `folder` that does not go down, as text."""
    wrong = []
    for path in sorted(folder.rglob("*.py")):
        relative = path.relative_to(folder)
        own = relative.parts[0].removesuffix(".py")
        if own == "__init__":  # the front door
            continue
        for room in sorted(rooms_imported(path.read_text(encoding="utf-8"), folder.name) - {own}):
            if own in apart or room in apart or order.index(room) >= order.index(own):
                wrong.append(f"{relative} imports femend.{folder.name}.{room}")
    return wrong


@pytest.mark.parametrize("package", sorted(ORDER))
def test_every_room_has_a_place(package: str, package_root: Path) -> None:
    found = {path.name.removesuffix(".py") for path in (package_root / package).iterdir()}
    assert found - {"__init__", "__pycache__"} == APART.get(package, frozenset()) | set(ORDER[package])


@pytest.mark.parametrize("package", sorted(ORDER))
def test_rooms_import_from_those_before_them(package: str, package_root: Path) -> None:
    assert violations(package_root / package, ORDER[package], APART.get(package, frozenset())) == []


def test_the_check_sees_imports_that_go_up_or_to_those_apart(tmp_path: Path) -> None:
    diagnose = tmp_path / "diagnose"
    (diagnose / "locating").mkdir(parents=True)
    (diagnose / "locating" / "locate.py").write_text(
        "from femend.diagnose.naming.judge import Given\nfrom femend.diagnose.settings import Settings\n"
    )
    (diagnose / "diagnosis.py").write_text("def f():\n    from femend.diagnose.staged.stages import run\n")
    assert violations(diagnose, ORDER["diagnose"], APART["diagnose"]) == [
        "diagnosis.py imports femend.diagnose.staged",
        "locating/locate.py imports femend.diagnose.naming",
    ]
