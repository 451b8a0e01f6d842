"""One sentence for what is wrong with many channels, or with many recordings alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from femend.data import Remark

__all__ = ["gathered"]


def gathered(told: Iterable[tuple[str, str]]) -> list[str]:
    """The sentences `told`, each with the name of its recording, with those in one that tell the same fault of several
    channels (`Remark`), whatever its numbers, and those that tell the same of several recordings to the letter: in the
    order of the first of each.

    >>> gathered([("a", "recording 'a': 1 blow in it"), ("b", "recording 'b': 1 blow in it")])
    ["recordings 'a', 'b': 1 blow in it"]
    >>> weak = [Remark("a", f"has an rms of {c}e-9", f"{c} (s{c})", "weak") for c in (1, 2, 3)]
    >>> gathered(("a", text) for text in weak)
    ["recording 'a': channel 1 (s1) has an rms of 1e-9; the same of 2, 3 in 'a'"]
    """
    channels: dict[str, list[Remark]] = {}
    recordings: dict[str, list[tuple[str, str]]] = {}
    order: list[tuple[bool, str]] = []
    for name, text in told:
        of_channel = isinstance(text, Remark) and bool(text.channel)
        if isinstance(text, Remark) and text.channel:
            key = text.fault or text.said
            channels.setdefault(key, []).append(text)
        else:
            key = text.removeprefix(f"recording {name!r}: ")
            recordings.setdefault(key, []).append((name, text))
        if (of_channel, key) not in order:
            order.append((of_channel, key))
    return [
        _of_channels(channels[key]) if of_channel else _of_recordings(key, recordings[key]) for of_channel, key in order
    ]


def _of_recordings(said: str, found: Sequence[tuple[str, str]]) -> str:
    """The sentence of all recordings of which the same is `said`."""
    names = list(dict.fromkeys(name for name, _ in found))
    if len(names) == 1 or said == found[0][1]:
        return found[0][1]
    return f"recordings {', '.join(repr(name) for name in names)}: {said}"


def _of_channels(found: Sequence[Remark]) -> str:
    """The sentence of all channels that were `found` to have one fault."""
    first, *more = found
    if not more:
        return str(first)
    names = list(dict.fromkeys(r.recording for r in more))
    by_recording = {name: Counter(_short(r) for r in more if r.recording == name) for name in names}
    same: dict[str, list[str]] = {}
    for name, channels in by_recording.items():
        listed = ", ".join(c if n == 1 else f"{c} ({n} times)" for c, n in channels.items())
        same.setdefault(listed, []).append(repr(name))
    return f"{first}; the same of " + " and of ".join(f"{c} in {', '.join(n)}" for c, n in same.items())


def _short(remark: Remark) -> str:
    """A channel without the label that stands behind its DOF in brackets."""
    return remark.channel.split(" (")[0]
