"""Print pins of everything `pyproject.toml` asks for, as `requirements/lock.txt` wants them.

The pins come from a fresh environment, so that nothing installed by hand slips in. Run it through `make lock` with the
oldest Python the project serves: a release that still installs there has wheels for the newer ones as well.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

HEADER = "# Written by `make lock` from pyproject.toml: build, run time, tests and lint. Do not edit by hand."


def main() -> None:
    """Resolve the requirements in a temporary environment and print the pins."""
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    for extra in ("test", "dev"):
        wanted += project["project"]["optional-dependencies"][extra]
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder) / "bin" / "python")
        subprocess.run([python, "-m", "pip", "install", "--quiet", *wanted], check=True)
        pins = subprocess.run([python, "-m", "pip", "freeze"], check=True, capture_output=True, text=True).stdout
    sys.stdout.write(f"{HEADER}\n{pins}")


if __name__ == "__main__":
    main()
