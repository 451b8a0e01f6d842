"""Within `femend.diagnose` the folders stand on one another: each imports from those before it alone.

The order is that of the table at the head of `python/docs/diagnosis.md`. `staged` and `residual` stand by themselves.
"""

from __future__ import annotations

import ast
from pathlib import Path

ORDER = (
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
)
APART = frozenset({"staged", "residual"})


def rooms_imported(source: str) -> set[str]:
    """Rooms of `femend.diagnose` that the text of a module imports from."""
    modules = [node.module for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom) and node.module]
    parts = [module.split(".") for module in modules]
    return {part[2] for part in parts if part[:2] == ["femend", "diagnose"] and len(part) > 2}


def violations(diagnose: Path) -> list[str]:
    """Every import between rooms that does not go down, as text."""
    wrong = []
    for path in sorted(diagnose.rglob("*.py")):
        relative = path.relative_to(diagnose)
        own = relative.parts[0].removesuffix(".py")
        if own == "__init__":  # the front door
            continue
        for room in sorted(rooms_imported(path.read_text(encoding="utf-8")) - {own}):
            if own in APART or room in APART or ORDER.index(room) >= ORDER.index(own):
                wrong.append(f"{relative} imports femend.diagnose.{room}")
    return wrong


def test_every_room_has_a_place(package_root: Path) -> None:
    found = {path.name.removesuffix(".py") for path in (package_root / "diagnose").iterdir()}
    assert found - {"__init__", "__pycache__"} == APART | set(ORDER)


def test_rooms_import_from_those_before_them(package_root: Path) -> None:
    assert violations(package_root / "diagnose") == []


def test_the_check_sees_imports_that_go_up_or_to_those_apart(tmp_path: Path) -> None:
    (tmp_path / "locating").mkdir()
    (tmp_path / "locating" / "locate.py").write_text(
        "from femend.diagnose.naming.judge import Given\nfrom femend.diagnose.settings import Settings\n"
    )
    (tmp_path / "diagnosis.py").write_text("def f():\n    from femend.diagnose.staged.stages import run\n")
    assert violations(tmp_path) == [
        "diagnosis.py imports femend.diagnose.staged",
        "locating/locate.py imports femend.diagnose.naming",
    ]
