"""The page of the study file is what is read: every table and key with its type and default, values, and examples."""

from __future__ import annotations

import re
import tomllib
import types
import typing
from pathlib import Path
from typing import Any

import msgspec
import pytest

from femend.data.recording import EXCITATIONS, ROLES
from femend.io.channel_map import CHANNEL_QUANTITIES
from femend.study.file.bench_settings import DAMPING_MODELS, METHODS, POSTERIORS, RESPONSES, RULES
from femend.study.file.candidate_tables import CANDIDATE_KEYS
from femend.study.file.field_tables import NEIGHBOURS
from femend.study.file.load import FORMAT
from femend.study.file.morph_tables import MOVES
from femend.study.file.parameter_targets import ALL_PROPERTIES
from femend.study.file.schema import StudyFile
from femend.study.file.solver_settings import FORMATS
from femend.units import SYSTEMS

WORDS = {str: ("text", "texts"), int: ("whole number", "whole numbers"), float: ("number", "numbers")}
# keys that take one of a few values, which the page has to name
VALUES = {
    "format": (FORMAT,),
    "model.units": tuple(SYSTEMS),
    "recording.role": ROLES,
    "recording.excitation": EXCITATIONS,
    "recording.channel.quantity": CHANNEL_QUANTITIES,
    "updating.responses": RESPONSES,
    "updating.damping_model": DAMPING_MODELS,
    "updating.posterior": POSTERIORS,
    "updating.regularisation": tuple(RULES),
    "updating.morph.move": tuple(MOVES),
    "updating.field.neighbours": NEIGHBOURS,
    "solver.format": tuple(FORMATS),
    "pretest.method": METHODS,
    "pretest.distinguish.physics": tuple(CANDIDATE_KEYS),
}


def is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


def table_of(kind: Any) -> tuple[type[msgspec.Struct], bool] | None:
    """The table a key is, and whether it is a list of them."""
    if is_table(kind):
        return kind, False
    inner = next((found for k in typing.get_args(kind) if (found := table_of(k)) is not None), None)
    return None if inner is None else (inner[0], inner[1] or typing.get_origin(kind) is list)


def tables(
    struct: type[msgspec.Struct] = StudyFile, path: tuple[str, ...] = (), many: bool = False
) -> dict[str, tuple[tuple[str, ...], type[msgspec.Struct]]]:
    """Every table by its heading on the page: its path and what it is read as."""
    name = ".".join(path)
    heading = "The file itself" if not path else f"`[[{name}]]`" if many else f"`[{name}]`"
    found = {heading: (path, struct)}
    for key, kind in typing.get_type_hints(struct).items():
        inner = table_of(kind)
        if inner is not None:
            found |= tables(inner[0], (*path, key), inner[1])
    return found


def type_text(kind: Any) -> str:
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        return " or ".join(type_text(k) for k in typing.get_args(kind) if k is not type(None))
    if typing.get_origin(kind) is list:
        (inner,) = typing.get_args(kind)
        return "tables" if is_table(inner) else f"list of {WORDS[inner][1]}"
    if kind is bool:
        return "true or false"
    return "table" if is_table(kind) else WORDS[kind][0]


def default_text(field: msgspec.structs.FieldInfo) -> str:
    if field.required:
        return "needed"
    value = field.default if field.default_factory is msgspec.NODEFAULT else field.default_factory()
    if value is None or value in ([], "") or isinstance(value, msgspec.Struct):
        return "–"
    return toml_text(value)


def toml_text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(toml_text, value))}]"
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"


@pytest.fixture(scope="module")
def sections(project_root: Path) -> dict[str, str]:
    """The page's sections by their headings."""
    text = (project_root / "python" / "docs" / "study.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def rows(section: str) -> dict[str, list[str]]:
    """The rows of a section's table by key: type, default, unit and what it is."""
    found = [
        [cell.strip() for cell in line.strip("|").split(" | ")] for line in section.splitlines() if line[:3] == "| `"
    ]
    return {row[0].strip("` "): row[1:] for row in found}


def test_every_table_is_on_the_page(sections: dict[str, str]) -> None:
    assert list(sections) == list(tables())


def test_every_key_has_its_type_and_default(sections: dict[str, str]) -> None:
    for heading, (_, struct) in tables().items():
        hints = typing.get_type_hints(struct)
        wanted = {f.name: [type_text(hints[f.name]), default_text(f)] for f in msgspec.structs.fields(struct)}
        shown = rows(sections[heading])
        assert {key: row[:2] for key, row in shown.items()} == wanted, heading
        for key, row in shown.items():
            assert len(row) == 4, (heading, key)
            assert row[2], (heading, key)
            assert row[3].strip(" |"), (heading, key)


def test_every_value_that_is_taken_is_named(sections: dict[str, str]) -> None:
    by_path = {".".join(path): heading for heading, (path, _) in tables().items()}
    for name, values in VALUES.items():
        table, _, key = name.rpartition(".")
        said = rows(sections[by_path[table]])[key][3]
        assert [v for v in values if f'"{v}"' not in said] == [], name
    said = rows(sections["`[[parameter]]`"])["property"][3]
    assert [p for p in ALL_PROPERTIES if p[0] not in "kc" and f"`{p}`" not in said] == []


def test_every_table_has_an_example_that_is_read(sections: dict[str, str]) -> None:
    least = {"format": FORMAT, "model": {"file": "model.bdf"}}
    for heading, (path, _) in tables().items():
        (block,) = re.findall(r"```toml\n(.*?)```", sections[heading], re.DOTALL)
        content: Any = tomllib.loads(block)
        msgspec.convert(least | content, StudyFile)
        for key in path:
            assert key in content, (heading, key)
            content = content[key][0] if isinstance(content[key], list) else content[key]
        assert content, heading
