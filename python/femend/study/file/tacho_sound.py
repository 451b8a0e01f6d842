"""What is doubtful about the tacho of a rotor's run, before its speed is taken."""

from __future__ import annotations

from femend.data import Recording, Remark
from femend.data.recording import RESPONSES
from femend.errors import FemendError, SignalError
from femend.numerals import plain
from femend.signal import find_edges, repair_pulses, speed_from_edges
from femend.signal.pulses import find_jump
from femend.signal.tacho_doubts import turns_per_pulse, without_pulses

__all__ = ["tacho_told"]


def tacho_told(recording: Recording) -> list[str]:
    """A tacho that measures motion or force, that has no pulses at an end of the record, whose pulses become twice as
    many at once, or stand for several turns each. What cannot be read at all is refused where the speed is taken."""
    rotating, data = recording.rotating, recording.time
    if rotating is None:
        return []
    try:
        row = data.index(rotating.tacho)
        edges = find_edges(data.values[row], data.dt, data.t0)
    except FemendError:
        return []
    channel, told = data.channels[row], []
    if channel.quantity in (*RESPONSES, "force"):
        said = (
            f"is named as the tacho and measures {channel.quantity} [{channel.unit}]: its cycles are taken as pulses; "
            "name the channel that holds the pulses"
        )
        told.append(Remark(recording.name, said, channel.text, "tacho that measures motion"))
    for a, b in without_pulses(data, edges):
        said = (
            f"holds no pulses from {plain(a, 4)} to {plain(b, 4)} s of the record's {plain(data.duration, 4)} s: the "
            "speed is taken to stay there as it is beside; cut the record to what the tacho covers, or mend its level "
            "(a machine at rest, an offset that drifts, a sensor that sets in late)"
        )
        told.append(Remark(recording.name, said, channel.text, f"tacho without pulses from {a:g} s"))
    pulses = int(rotating.pulses_per_revolution)
    try:
        jump = find_jump(repair_pulses(edges, pulses_per_revolution=pulses))
        speed = speed_from_edges(edges, pulses_per_revolution=pulses, smoothing=0.0)
    except SignalError:
        return [*told]
    if jump is not None:
        at, times = jump
        apart = f"{plain(times, 3)} times as far" if times > 1 else f"1/{plain(1 / times, 3)} as far"
        said = (
            f"has pulses {apart} apart from about {plain(at, 4)} s on as just before, from one to the next: pulses are "
            "lost regularly on one side of it, or doubled on the other, unless the drive steps so; cut the recording "
            "there, or mend the sensor's level"
        )
        told.append(Remark(recording.name, said, channel.text, f"tacho that jumps at {at:g} s"))
    # several pulses to a turn are judged where the speed is used: counted_otherwise tells another number of them
    found = turns_per_pulse(data, speed) if pulses == 1 else None
    if found is not None:
        said = (
            f"gives a speed of which the responses hold {plain(100 * found.share, 2)} % of their power at order "
            f"{found.pulses} and next to nothing ({plain(100 * found.first, 2)} %) at order 1, where unbalance acts: "
            f"does the shaft turn {found.pulses} times for each pulse (every second pulse lost, an output that toggles "
            "or divides)? Then record every pulse; forces of that order alone look the same"
        )
        told.append(Remark(recording.name, said, channel.text, "tacho of several turns a pulse"))
    return [*told]
