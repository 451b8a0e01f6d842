"""What the package reads at run time is installed with it; `make wheel-test` runs this against the wheel."""

from __future__ import annotations

from pathlib import Path

import femend


def test_every_data_file_is_installed(tree_files: list[Path], package_root: Path) -> None:
    installed = Path(femend.__file__).parent
    data = [path.relative_to(package_root) for path in tree_files if package_root in path.parents]
    assert data, "no file of the package found: the search is broken"
    assert [str(name) for name in data if not (installed / name).is_file()] == []
