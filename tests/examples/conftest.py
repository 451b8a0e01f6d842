"""The scripts of python/examples as modules."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def script(project_root: Path) -> Callable[[str], ModuleType]:
    """Runs an example by its path in python/examples without suffix, and gives what it defines."""

    def loaded(name: str) -> ModuleType:
        path = project_root / "python" / "examples" / f"{name}.py"
        # a name of its own: examples import each other's scripts by their names, of which some are alike
        spec = importlib.util.spec_from_file_location(f"example_{name.replace('/', '_')}", path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # where dataclasses look for it
        spec.loader.exec_module(module)
        return module

    return loaded
