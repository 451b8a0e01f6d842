"""Imports go down only: each package imports lower floors, and siblings of one floor leave each other alone.

The floors are those of `python/docs/architecture.md`; a package that is not on one fails here until it has a place.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

FLOORS: tuple[frozenset[str], ...] = (
    frozenset({"_core", "errors", "units", "dof", "numerals", "progress", "threads"}),
    frozenset({"data"}),
    frozenset({"io", "signal", "correlate", "expansion", "modal", "physics"}),
    frozenset({"model"}),
    frozenset({"analysis"}),
    frozenset({"estimate"}),
    frozenset({"diagnose", "pretest"}),
    frozenset({"study", "bench", "batch", "report", "app", "demo", "cli", "selftest", "workflow", "__main__"}),
)
# On these floors modules of the same floor may import each other: they are single files that build on one another,
# and the top floor is where everything is put together.
OPEN_FLOORS = frozenset({0, 7})


def floor_of(part: str) -> int:
    for number, names in enumerate(FLOORS):
        if part in names:
            return number
    pytest.fail(f"femend.{part} has no floor; give it one here and in python/docs/architecture.md")


def imported_parts(source: str, module: tuple[str, ...]) -> set[str]:
    """First-level names of femend that `source`, the text of `module` (a file in package module[:-1]), imports."""
    parts: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = list(module[: len(module) - node.level]) if node.level else []
            base += node.module.split(".") if node.module else []
            names = [base] if len(base) > 1 else [[*base, alias.name] for alias in node.names]
        else:
            continue
        parts |= {name[1] for name in names if name[0] == "femend" and len(name) > 1}
    return parts


def violations(package_root: Path) -> list[str]:
    """Every import that does not go down, as text."""
    wrong = []
    for path in sorted(package_root.rglob("*.py")):
        relative = path.relative_to(package_root)
        if relative.parts == ("__init__.py",):  # the front door names every floor
            continue
        own = relative.parts[0].removesuffix(".py")
        own_floor = floor_of(own)
        for part in sorted(imported_parts(path.read_text(encoding="utf-8"), ("femend", *relative.parts))):
            if part == own or part.startswith("__"):
                continue
            floor = floor_of(part)
            if floor > own_floor or (floor == own_floor and floor not in OPEN_FLOORS):
                wrong.append(f"{relative} (floor {own_floor + 1}) imports femend.{part} (floor {floor + 1})")
    return wrong


def test_imports_go_down_only(package_root: Path) -> None:
    assert violations(package_root) == []


def test_the_check_sees_upward_and_sideways_imports(tmp_path: Path) -> None:
    (tmp_path / "io").mkdir()
    (tmp_path / "io" / "reader.py").write_text(
        "from femend import errors\nfrom ..physics import laws\ndef f():\n    import femend.model.build\n"
    )
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "__init__.py").write_text("from . import frf\nfrom .. import diagnose\n")
    assert violations(tmp_path) == [
        "data/__init__.py (floor 2) imports femend.diagnose (floor 7)",
        "io/reader.py (floor 3) imports femend.model (floor 4)",
        "io/reader.py (floor 3) imports femend.physics (floor 3)",
    ]
