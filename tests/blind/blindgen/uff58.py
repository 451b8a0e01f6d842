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
    over = 0 if f.coherence else FORCE
    axes = (
        (18, "Hz"),
        (0, "NONE") if f.coherence else (ACCELERATION, UNIT[ACCELERATION]),
        (over, UNIT.get(over, "NONE")),
    )
    name, kind = ("coherence", 6) if f.coherence else ("accelerance", 4)
    return _dataset(title, name, kind, f.at, f.force, (f.freq[0], f.freq[1] - f.freq[0]), axes, f.data)


def encode(ch: Channel, title: str, rate: float) -> bytes:
    """One dataset 58b of function type 1 (time record, single real), even spacing."""
    axes = ((17, "s"), (ch.kind, UNIT[ch.kind]), (0, "NONE"))
    return _dataset(title, NAME[ch.kind], 1, (ch.node, ch.direction), (0, 0), (0.0, 1.0 / rate), axes, ch.data)


def _dataset(
    title: str,
    name: str,
    kind: int,
    at: tuple[int, int],
    force: tuple[int, int],
    abscissa: tuple[float, float],
    axes: Sequence[tuple[int, str]],
    values: np.ndarray,
) -> bytes:
    """One dataset 58b: little-endian IEEE of single precision, 11 ASCII lines, spaced evenly from the first `abscissa`
    in steps of the second; `axes` are code and unit of abscissa, ordinate and its denominator."""
    of, number = ("<c8", 5) if np.iscomplexobj(values) else ("<f4", 2)
    data, (start, step) = np.asarray(values, of), abscissa
    head = [
        f"{name} node {at[0]} dir {at[1]}".ljust(80),
        title.ljust(80),
        "20-Nov-26 00:00:00".ljust(80),
        "NONE".ljust(80),
        "NONE".ljust(80),
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{at[0]:10d}{at[1]:4d} {'NONE':10s}{force[0]:10d}{force[1]:4d}",
        f"{number:10d}{data.size:10d}{1:10d}{start:13.5e}{step:13.5e}{0.0:13.5e}",
    ]
    for code, unit in (*axes, (0, "NONE")):
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
