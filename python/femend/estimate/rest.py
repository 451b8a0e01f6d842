"""Records without the rest before a blow and after what it or a burst left has died away.

There the sensors show noise alone. Left in, it stands on every line beside what the structure did, which then hardly
shows in a mean over lines; and a window exp(-sigma t) that opens a second before the blow shows nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate.lines import FitRecord
from femend.estimate.noise import BLOCKS, SILENT

__all__ = ["at_work", "beginning"]

FloatArray = NDArray[np.float64]

# samples before the force in which a recorder's filter lets it ring, and the fewest in front of those that are a rest:
# others are a force that grows
RINGS, FEWEST = 8, 16
# standard errors of a block's variance by which it has to be above that of the noise for motion to be in it, and the
# blocks kept after the last one of these
ABOVE, KEPT = 4.0, 1


def at_work(record: FitRecord) -> FitRecord:
    """The time record from where its measured forces begin to where motion is lost in the noise; as it is where the
    forces are there from the beginning to the end."""
    if record.frf is not None or not record.driven or record.start > 0 or record.n < 8 * BLOCKS:
        return record
    begin, end = beginning(record.u), _end(record, record.n - 1 - _silence(record.u[:, ::-1]))
    # a force that nobody recorded moves the structure before the blow, too; the recorder's filter rings right before it
    begin = 0 if _moves(record.y[:, None, : begin // 2], record.noise).any() else begin
    if begin == 0 and end == record.n:
        return record
    return record.part(begin, end)


def beginning(u: FloatArray) -> int:
    """Sample at which forces u (n_in, n) begin after a rest; 0 where there is none."""
    begin = _silence(u) - RINGS
    return begin if begin >= FEWEST else 0


def _silence(u: FloatArray) -> int:
    """Samples before forces u (n_in, n) are there."""
    size = np.abs(u).max(axis=0)
    return int(np.argmax(size > SILENT * size.max()))


def _end(record: FitRecord, last: int) -> int:
    """Sample up to which something moves, the forces until sample `last` included."""
    length = record.n // BLOCKS
    n_out, n = record.y.shape
    moving = _moves(record.y[:, n - BLOCKS * length :].reshape(n_out, BLOCKS, length), record.noise)
    ends = n - (BLOCKS - 1 - np.arange(BLOCKS)) * length
    until = int(np.max(ends[moving], initial=0)) + KEPT * length
    return min(max(until, last + 1 + length), n)


def _moves(blocks: FloatArray, noise: FloatArray) -> NDArray[np.bool_]:
    """In which blocks (n_out, n_blocks, n) of responses there is more than their noise (n_out,)."""
    if blocks.shape[2] == 0:
        return np.zeros(blocks.shape[1], dtype=bool)
    ratio = (blocks**2).mean(axis=2) / noise[:, None] ** 2
    error = np.sqrt(2 / blocks.shape[2])
    together = ratio.mean(axis=0) > 1 + ABOVE * error / np.sqrt(len(blocks))
    return np.asarray((ratio > 1 + ABOVE * error).any(axis=0) | together)
