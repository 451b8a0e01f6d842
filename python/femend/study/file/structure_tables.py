"""Checking the nominally equal structures whose recordings a study holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from femend.study.file.bench_settings import StructureSettings
from femend.study.file.check import FileCheck
from femend.study.file.schema import StructureTable

__all__ = ["FEWEST", "structure_settings"]

# of fewer structures no scatter is told
FEWEST = 3


def structure_settings(
    check: FileCheck, tables: Sequence[StructureTable], roles: Mapping[str, str]
) -> tuple[StructureSettings, ...]:
    """``[[updating.structure]]`` of a study with recordings of these `roles` by name; raises StudyError, naming the
    key, for fewer than three, a recording that is none or stands twice, and one to fit that no structure has."""
    if not tables:
        return ()
    check.unique("updating.structure", [t.name for t in tables])
    if len(tables) < FEWEST:
        raise check.fail(
            "updating.structure", f"{len(tables)} structures tell no scatter; give {FEWEST} or more, or leave them out"
        )
    of: dict[str, str] = {}
    for i, table in enumerate(tables):
        key, who = f"updating.structure[{i}].recordings", f"structure {table.name!r}"
        if not table.recordings:
            raise check.fail(key, f"{who}: the list is empty; name its recordings")
        for name in table.recordings:
            check.one_of(key, name, tuple(roles))
            if name in of:
                raise check.fail(key, f"{who}: {name!r} is of structure {of[name]!r} already; each recording is of one")
            of[name] = table.name
        if not any(roles[name] == "fit" for name in table.recordings):
            raise check.fail(key, f"{who}: none has role fit, so that nothing is told of it; leave it out")
    lost = next((name for name, role in roles.items() if role == "fit" and name not in of), None)
    if lost is not None:
        raise check.fail(
            "updating.structure", f"recording {lost!r} is to be fitted and is of no structure; say of which it is"
        )
    return tuple(StructureSettings(t.name, tuple(t.recordings)) for t in tables)
