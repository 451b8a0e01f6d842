"""No two files import each other, by however many others: not even for the names of types alone."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest


def imports(package_root: Path) -> dict[str, set[str]]:
    """Modules that each module of the package imports, anywhere in it; faces of packages hand names on and are passed
    through."""
    files = {".".join(p.relative_to(package_root.parent).with_suffix("").parts): p for p in package_root.rglob("*.py")}
    found: dict[str, set[str]] = {}
    for module, path in files.items():
        if path.name == "__init__.py":
            continue
        nodes = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.ImportFrom)]
        named = {f"{n.module}.{a.name}" for n in nodes for a in n.names} | {str(n.module) for n in nodes}
        found[module] = {name for name in named if name in files}
    return found


def test_no_files_import_each_other(package_root: Path) -> None:
    graph = imports(package_root)
    assert len(graph) > 100
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"a circle: {' <- '.join(error.args[1])}")


def test_the_check_sees_a_circle_of_types(tmp_path: Path) -> None:
    root = tmp_path / "femend"
    root.mkdir()
    (root / "a.py").write_text("from femend.b import f\n")
    (root / "b.py").write_text("if TYPE_CHECKING:\n    from femend.a import A\n")
    with pytest.raises(CycleError):
        tuple(TopologicalSorter(imports(root)).static_order())
