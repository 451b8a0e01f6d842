"""What the README tells people to type exists."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path


def shell_lines(text: str) -> list[str]:
    """The lines of the README's shell blocks, without prompts and comments."""
    blocks = re.findall(r"```(?:sh|bash|console)\n(.*?)```", text, flags=re.DOTALL)
    lines = (line.split("#")[0].strip().removeprefix("$ ") for block in blocks for line in block.splitlines())
    return [line for line in lines if line]


def test_make_targets_exist(project_root: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (project_root / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    asked = [
        line.split()[1]
        for name in ("README.md", "CONTRIBUTING.md", "benches/README.md")
        for line in shell_lines((project_root / name).read_text(encoding="utf-8"))
        if line.startswith("make ")
    ]
    assert {"demo", "test"} <= set(asked), "the README's two commands"
    assert set(asked) <= targets


def test_subcommands_exist(project_root: Path) -> None:
    from femend import cli

    asked = [
        line.split()[1]
        for line in shell_lines((project_root / "README.md").read_text(encoding="utf-8"))
        if line.startswith("femend ")
    ]
    assert asked, "the README shows no femend command"
    assert set(asked) <= set(cli.main.commands)


def test_the_sketch_uses_names_that_exist(project_root: Path) -> None:
    import femend

    readme = (project_root / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", readme, flags=re.DOTALL)
    asked = {name for block in blocks for name in re.findall(r"\bfe\.(\w+)", block)}
    assert asked, "the README shows no Python"
    assert asked <= set(femend.__all__)


def test_version_is_told_once(project_root: Path) -> None:
    import femend

    workspace = tomllib.loads((project_root / "Cargo.toml").read_text(encoding="utf-8"))
    assert femend.__version__ == workspace["workspace"]["package"]["version"]


def test_the_first_study_is_valid_toml(project_root: Path) -> None:
    readme = (project_root / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", readme, flags=re.DOTALL)
    studies = [study for study in map(tomllib.loads, blocks) if study.get("format") == "femend-study/1"]
    assert len(studies) == 1
    assert {recording["role"] for recording in studies[0]["recording"]} <= {"fit", "validate", "predict"}
