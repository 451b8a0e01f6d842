"""Writer (and a small reader for the checks) of universal dataset 58, binary single precision, as test systems write
it.
"""

from __future__ import annotations

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

ACCELERATION, FORCE = 12, 13
UNIT = {ACCELERATION: "m/s^2", FORCE: "N"}
NAME = {ACCELERATION: "acceleration", FORCE: "force"}
# ordinate data types of real values: single and double precision
_TYPE = {2: "<f4", 4: "<f8"}


@dataclass
class Channel:
    """One time record: deck node, direction 1..6, ordinate type (12 acceleration, 13 force) and samples."""

    node: int
    direction: int
    kind: int
    data: np.ndarray


@dataclass
class ResponseFunction:
    """Accelerance (complex), or its coherence, of one pair of response and force on lines `freq` (Hz) that are even."""

    at: tuple[int, int]
    force: tuple[int, int]
    freq: np.ndarray
    data: np.ndarray
    coherence: bool = False


def encode_function(f: ResponseFunction, title: str) -> bytes:
    """One dataset 58b of function type 4 (FRF, single complex) or 6 (coherence, single real), even spacing."""
    data = np.asarray(f.data, "<f4" if f.coherence else "<c8")
    (node, direction), (force_node, force_direction) = f.at, f.force
    head = [
        f"{'coherence' if f.coherence else 'accelerance'} node {node} dir {direction}".ljust(80),
        title.ljust(80),
        "20-Nov-26 00:00:00".ljust(80),
        "NONE".ljust(80),
        "NONE".ljust(80),
        f"{6 if f.coherence else 4:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{direction:4d} {'NONE':10s}"
        f"{force_node:10d}{force_direction:4d}",
        f"{2 if f.coherence else 5:10d}{data.size:10d}{1:10d}{f.freq[0]:13.5e}{f.freq[1] - f.freq[0]:13.5e}{0.0:13.5e}",
    ]
    over = 0 if f.coherence else FORCE
    axes = ((18, "Hz"), (0 if f.coherence else ACCELERATION, UNIT[ACCELERATION]), (over, UNIT[FORCE]), (0, "NONE"))
    for code, unit in axes:
        head.append(f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {unit if code else 'NONE':20s}")
    first = f"{58:6d}b{1:6d}{2:6d}{11:12d}{data.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return ("    -1\n" + first + "\n" + "\n".join(head) + "\n").encode("ascii") + data.tobytes() + b"\n    -1\n"


def encode(ch: Channel, title: str, rate: float) -> bytes:
    """One dataset 58b: little-endian IEEE, 11 ASCII lines, even spacing."""
    data = np.asarray(ch.data, "<f4")
    head = [
        f"{NAME[ch.kind]} node {ch.node} dir {ch.direction}".ljust(80),
        title.ljust(80),
        "20-Nov-26 00:00:00".ljust(80),
        "NONE".ljust(80),
        "NONE".ljust(80),
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{ch.node:10d}{ch.direction:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{2:10d}{data.size:10d}{1:10d}{0.0:13.5e}{1.0 / rate:13.5e}{0.0:13.5e}",
    ]
    for code, unit in ((17, "s"), (ch.kind, UNIT[ch.kind]), (0, "NONE"), (0, "NONE")):
        head.append(f"{code:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {unit:20s}")
    first = f"{58:6d}b{1:6d}{2:6d}{11:12d}{data.nbytes:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return ("    -1\n" + first + "\n" + "\n".join(head) + "\n").encode("ascii") + data.tobytes() + b"\n    -1\n"


def write(path: pathlib.Path, channels: Sequence[Channel | ResponseFunction], title: str, rate: float) -> None:
    """Write all channels, or functions, to one file."""
    path.write_bytes(
        b"".join(encode(c, title, rate) if isinstance(c, Channel) else encode_function(c, title) for c in channels)
    )


def read(path: pathlib.Path) -> list[Channel]:
    """Read back real records, also of double precision (nothing more general: the package has its own reader)."""
    raw, out, at = path.read_bytes(), [], 0
    while (start := raw.find(b"    -1\n", at)) >= 0:
        lines, pos = [], start + 7
        for _ in range(12):
            end = raw.index(b"\n", pos)
            lines.append(raw[pos:end].decode("ascii"))
            pos = end + 1
        size = int(lines[0][31:43])
        out.append(
            Channel(
                int(lines[6][41:51]),
                int(lines[6][51:55]),
                int(lines[9][:10]),
                np.frombuffer(raw[pos : pos + size], _TYPE[int(lines[7][:10])]).astype(float),
            )
        )
        at = pos + size + len(b"\n    -1\n")
    return out
