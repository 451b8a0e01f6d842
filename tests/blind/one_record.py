#!/usr/bin/env python3
"""Leave one fit recording in every case:  one_record.py CASES OUT [--keep high]

OUT holds the cases of CASES with studies whose other fit recordings are gone, to see what a diagnosis tells where only
one level was recorded; `score_blind.py RESULTS OUT` scores it. The sealed truth is linked and not changed.
"""

from __future__ import annotations

import argparse
import pathlib
import shutil

BLOCK = "[[recording]]"


def kept_alone(study: str, name: str) -> str:
    """The text of a study.toml in which the recording `name` is the only one with role "fit"; ValueError where it is
    none."""
    head, *blocks = study.split(BLOCK)
    fits = [b for b in blocks if 'role = "fit"' in b]
    if not any(f'name = "{name}"' in b for b in fits):
        raise ValueError(f'no recording {name!r} with role = "fit"')
    left = [b for b in blocks if b not in fits or f'name = "{name}"' in b]
    return BLOCK.join([head, *left])


def main() -> None:
    """Make the set."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("cases", type=pathlib.Path)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--keep", default="high", help="the recording that is left to fit")
    a = ap.parse_args()
    for case in sorted(p for p in a.cases.iterdir() if (p / "public").is_dir()):
        to = a.out / case.name
        shutil.copytree(case / "public", to / "public")
        (to / "sealed").symlink_to((case / "sealed").resolve())
        study = to / "public" / "study.toml"
        study.write_text(kept_alone(study.read_text(encoding="utf-8"), a.keep), encoding="utf-8")


if __name__ == "__main__":
    main()
