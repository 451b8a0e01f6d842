"""Reading a study file: syntax, unknown keys, values, names and files, in that order."""

from __future__ import annotations

import difflib
import math
import os
import re
import tomllib
import types
import typing
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec

from femend.data.recording import EXCITATIONS, ROLES
from femend.dof import parse_direction
from femend.errors import StudyError, UnitError
from femend.io.channel_map import CHANNEL_QUANTITIES, ChannelMap
from femend.model import Parameter
from femend.model.parameter import same_target
from femend.study.file.bench_tables import correlation_settings, pretest_settings, updating_settings
from femend.study.file.parameter_targets import ALL_PROPERTIES, OF_TARGET, TARGETS, checked_prior, whose
from femend.study.file.rotating_tables import rotating_of
from femend.study.file.schema import ChannelTable, ParameterTable, RecordingTable, StudyFile
from femend.study.file.solver_tables import solver_settings
from femend.study.file.study import AS_MODELLED, Configuration, Study, StudyRecording
from femend.study.file.toml_hint import toml_hint
from femend.study.file.wrong_type import wrong_type
from femend.units import QUANTITIES, ROTATIONAL, SYSTEMS, parse_unit, quantity_factor

__all__ = ["FORMAT", "load_study"]

FORMAT = "femend-study/1"


class _Checker:
    """Makes every message name the study file and the key."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def fail(self, key: str, fact: str) -> StudyError:
        return StudyError(f"{self.file}: {key}: {fact}" if key else f"{self.file}: {fact}", key=key or None)

    def one_of(self, key: str, value: str, allowed: tuple[str, ...]) -> None:
        if value not in allowed:
            raise self.fail(key, f"{value!r} is none of {', '.join(allowed)}{_nearest(value, allowed)}")

    def unique(self, table: str, names: list[str]) -> None:
        for name, count in Counter(names).items():
            if count > 1:
                raise self.fail(f"{table}.name", f"{count} [[{table}]] are named {name!r}; give each its own name")
            if not name.strip():
                raise self.fail(f"{table}.name", f"a [[{table}]] has an empty name; give it one")

    def existing(self, key: str, text: str) -> Path:
        path = Path(os.path.expanduser(text))
        path = (path if path.is_absolute() else self.file.parent / path).resolve()
        if not path.is_file():
            what = "is a folder, not a file" if path.is_dir() else "does not exist"
            there = sorted(p.name for p in path.parent.iterdir() if p != path) if path.parent.is_dir() else []
            raise self.fail(
                key,
                f"{path} {what}{_nearest(path.name, there)}; correct the name, paths are relative to "
                "the study's folder",
            )
        return path


def _nearest(value: str, known: typing.Iterable[str]) -> str:
    by_small = {name.lower(): name for name in known}
    close = difflib.get_close_matches(value.lower(), list(by_small), n=1, cutoff=0.5)
    return f"; did you mean {by_small[close[0]]!r}?" if close else ""


def _table_of(kind: Any) -> type[msgspec.Struct] | None:
    """The struct inside a field's type such as ``list[T]`` or ``T | None``."""
    if isinstance(kind, type) and not isinstance(kind, types.GenericAlias) and issubclass(kind, msgspec.Struct):
        return kind
    for inner in typing.get_args(kind):
        found = _table_of(inner)
        if found is not None:
            return found
    return None


def _refuse_unknown(check: _Checker, value: Any, kind: type[msgspec.Struct], path: str) -> None:
    """Raises StudyError for the first key that the contract does not know, with the nearest one it does."""
    if isinstance(value, list):
        for i, entry in enumerate(value):
            _refuse_unknown(check, entry, kind, f"{path}[{i}]")
        return
    if not isinstance(value, dict):
        return
    fields = {f.encode_name: f.type for f in msgspec.structs.fields(kind)}
    for key, inner in value.items():
        here = f"{path}.{key}" if path else key
        if key not in fields:
            where = f"[{path}]" if path else "the study"
            raise check.fail(
                here, f"{key!r} is no key of {where}{_nearest(key, fields) or '; known are ' + ', '.join(fields)}"
            )
        table = _table_of(fields[key])
        if table is not None:
            _refuse_unknown(check, inner, table, here)


def _typed(check: _Checker, data: dict[str, Any]) -> StudyFile:
    try:
        return msgspec.convert(data, StudyFile)
    except msgspec.ValidationError as error:
        text = str(error)
        match = re.search(r" - at `\$\.?(.*?)`$", text)
        key = match[1] if match else ""
        raise check.fail(key, wrong_type(text[: match.start()] if match else text, data, key)) from None


def load_study(path: str | os.PathLike[str], *, recordings: bool = True, use: str = "a diagnosis") -> Study:
    """Reads and checks the study file at `path`, or `study.toml` in that folder.

    With `recordings` False a study without any is taken, as one is that only plans a test; else `use` is what the
    message about their absence says they are needed for. Raises StudyError, naming file and key, for a syntax error,
    an unknown key (with the nearest known one), a missing or wrong value, a name that stands twice, and a file that is
    not there; FileNotFoundError for the study itself.

    >>> load_study("study.toml").units       # doctest: +SKIP
    'SI'
    """
    file = Path(path)
    if file.is_dir():
        file = file / "study.toml"
    if not file.is_file():
        raise FileNotFoundError(f"there is no study file {file}")
    file = file.resolve()
    check = _Checker(file)
    try:
        data = tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except tomllib.TOMLDecodeError as error:
        other = "" if file.suffix == ".toml" else "; a study is a .toml file, which names its deck and its recordings"
        raise check.fail("", f"is not valid TOML: {error}{toml_hint(str(error), file)}{other}") from None
    except UnicodeDecodeError as error:
        raise check.fail("", f"is not UTF-8 text (byte {error.start}); save it as UTF-8") from None
    if "format" in data and data["format"] != FORMAT:
        raise check.fail("format", f"{data['format']!r} is not {FORMAT!r}, the only one this version reads")
    _refuse_unknown(check, data, StudyFile, "")
    return _study(check, _typed(check, data), use if recordings else None)


def _study(check: _Checker, content: StudyFile, use: str | None) -> Study:
    """The study of a file's `content`; `use` is what needs its recordings, None where nothing does."""
    check.one_of("model.units", content.model.units, tuple(SYSTEMS))
    if not (0 < content.damping.ratio < 1):
        raise check.fail("damping.ratio", f"{content.damping.ratio:g} is not between 0 and 1 (1 % is 0.01)")
    check.unique("parameter", [p.name for p in content.parameter])
    check.unique("configuration", [c.name for c in content.configuration])
    check.unique("recording", [r.name for r in content.recording])
    if use is not None and not content.recording:
        raise check.fail("recording", f'there is no [[recording]]; {use} needs at least one with role = "fit"')
    parameters = tuple(_parameter(check, p, f"parameter[{i}]") for i, p in enumerate(content.parameter))
    shared = same_target(parameters)
    if shared is not None:
        raise check.fail(f"parameter[{shared[0]}]", shared[1])
    configurations = []
    for i, table in enumerate(content.configuration):
        for j, added in enumerate(table.added_mass):
            if not (math.isfinite(added.m) and added.m > 0):
                raise check.fail(f"configuration[{i}].added_mass[{j}].m", f"{added.m:g} is not a positive mass")
        masses = tuple((m.node, m.m) for m in table.added_mass)
        configurations.append(Configuration(table.name, table.spc, masses, table.note))
    names = tuple(c.name for c in configurations)
    recordings = tuple(_recording(check, r, f"recording[{i}]", names) for i, r in enumerate(content.recording))
    if use is not None and not any(r.role == "fit" for r in recordings):
        raise check.fail("recording", f'no [[recording]] has role = "fit"; {use} needs at least one')
    known, roles = [p.name for p in content.parameter], {r.name: r.role for r in recordings}
    updating = updating_settings(check, content.updating, known, (AS_MODELLED, *names), roles)
    return Study(
        check.file,
        content.title or check.file.parent.name,
        check.existing("model.file", content.model.file),
        content.model.units,
        content.damping.ratio,
        parameters,
        tuple(configurations),
        recordings,
        correlation_settings(check, content.correlation),
        updating,
        pretest_settings(check, content.pretest, names, {p.name: p.prior_sd for p in content.parameter}),
        solver_settings(check, content.solver),
    )


def _parameter(check: _Checker, table: ParameterTable, key: str) -> Parameter:
    given = [t for t in TARGETS if getattr(table, t) is not None]
    if len(given) != 1:
        has = "no target" if not given else f"{len(given)} targets ({', '.join(given)})"
        raise check.fail(key, f"parameter {table.name!r} has {has}; give exactly one of {', '.join(TARGETS)}")
    target = given[0]
    allowed = OF_TARGET.get(target, ALL_PROPERTIES)
    owner = whose(table.property)
    if table.property not in allowed and owner is not None:
        raise check.fail(
            f"{key}.property",
            f"parameter {table.name!r}: {table.property!r} is no property of {target}, but of {owner}; give {owner} = "
            f"... in the place of {target}, or one of {', '.join(allowed)}",
        )
    if table.property not in allowed:
        raise check.fail(
            f"{key}.property",
            f"parameter {table.name!r}: {table.property!r} is no property of {target}; use one of "
            f"{', '.join(allowed)}{_nearest(table.property, allowed)}",
        )
    bounds = checked_prior(check, key, f"parameter {table.name!r}", table.prior_sd, table.bounds)
    value = getattr(table, target)
    ids = tuple(value) if isinstance(value, list) else (int(value),)
    if not ids:
        raise check.fail(f"{key}.elements", f"parameter {table.name!r}: the list of elements is empty")
    return Parameter(table.name, table.property, target, ids, table.prior_sd, bounds)


def _recording(check: _Checker, table: RecordingTable, key: str, configurations: tuple[str, ...]) -> StudyRecording:
    check.one_of(f"{key}.role", table.role, ROLES)
    check.one_of(f"{key}.excitation", table.excitation, EXCITATIONS)
    configuration = AS_MODELLED if table.configuration is None else table.configuration
    if configuration != AS_MODELLED and configuration not in configurations:
        known = ", ".join(configurations) or "none"
        raise check.fail(
            f"{key}.configuration",
            f"recording {table.name!r}: no [[configuration]] is named {configuration!r} (there are: {known})"
            f"{_nearest(configuration, configurations)}",
        )
    rotating = None
    if (table.excitation == "rotating") != (table.rotating is not None):
        fact = 'excitation = "rotating" needs' if table.rotating is None else 'only excitation = "rotating" takes'
        raise check.fail(f"{key}.rotating", f"recording {table.name!r}: {fact} a [recording.rotating] table")
    if table.rotating is not None:
        rotating = rotating_of(check, table.rotating, f"{key}.rotating")
    channels = tuple(_channel(check, c, f"{key}.channel[{i}]") for i, c in enumerate(table.channel))
    file = check.existing(f"{key}.file", table.file)
    return StudyRecording(table.name, file, table.role, table.excitation, configuration, rotating, channels)


def _channel(check: _Checker, table: ChannelTable, key: str) -> ChannelMap:
    check.one_of(f"{key}.quantity", table.quantity, CHANNEL_QUANTITIES)
    if table.source is None and table.quantity != "force":
        raise check.fail(f"{key}.source", "is missing; give the column's number (from 0) or name")
    if table.quantity != "tacho" and (table.node is None or table.direction is None):
        missing = "node" if table.node is None else "direction"
        raise check.fail(f"{key}.{missing}", f"is missing; a channel of {table.quantity} needs node and direction")
    if table.node is not None and table.node < 1:
        raise check.fail(f"{key}.node", f"{table.node} is no number of a node; they begin with 1")
    rotational = False
    if table.direction is not None:
        try:
            rotational = parse_direction(table.direction)[0] > 3
        except ValueError as error:
            raise check.fail(f"{key}.direction", str(error)) from None
    if not (math.isfinite(table.scale) and table.scale != 0):
        raise check.fail(f"{key}.scale", f"{table.scale:g} is not a finite factor other than 0")
    try:
        if not _per_force(table.quantity, table.unit, rotational):
            quantity_factor(table.quantity, table.unit, rotational=rotational)
    except UnitError as error:
        raise check.fail(f"{key}.unit", str(error)) from None
    return ChannelMap(table.source, table.node, table.direction, table.quantity, table.unit, table.scale)


def _per_force(quantity: str, unit: str, rotational: bool) -> bool:
    """Whether `unit` is that of an FRF's column, a response over a force or a moment such as m/s^2/N."""
    if quantity in ("tacho", "force"):
        return False
    dims = QUANTITIES[ROTATIONAL.get(quantity, quantity) if rotational else quantity]
    over = (QUANTITIES["force"], QUANTITIES["moment"])
    return parse_unit(unit).dims in [tuple(a - b for a, b in zip(dims, o, strict=True)) for o in over]
