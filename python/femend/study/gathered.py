"""One sentence for what is wrong with many channels, or with many recordings alike."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence

__all__ = ["gathered"]

# what is told of a channel: its name may hold anything, what comes behind it is one of these
_CHANNEL = re.compile(
    r"recording (?P<recording>'.+?'|\".+?\"): channel (?P<channel>.+?) "
    r"(?P<said>(?:has an? |stays at its |holds |is (?!at ))(?s:.*))"
)
_RECORDING = re.compile(r"recording (?P<recording>'.+?'|\".+?\"): (?P<said>(?s:.*))")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def gathered(told: Iterable[str]) -> list[str]:
    """The sentences `told` of recordings, with those in one that tell the same fault, whatever its numbers, of several
    channels, and those that tell the same of several recordings to the letter: in the order of the first of each.

    >>> gathered(["recording 'a': 1 blow in it", "recording 'b': 1 blow in it"])
    ["recordings 'a', 'b': 1 blow in it"]
    >>> for text in gathered(f"recording 'a': channel {c} (s{c}) has an rms of {c}e-9" for c in (1, 2, 3)):
    ...     print(text)
    recording 'a': channel 1 (s1) has an rms of 1e-9; the same of 2, 3 in 'a'
    """
    groups: dict[tuple[str, str], list[re.Match[str] | str]] = {}
    for text in told:
        channel = _CHANNEL.fullmatch(text)
        recording = channel or _RECORDING.fullmatch(text)
        if channel is not None:
            key = ("channel", _NUMBER.sub("#", channel["said"]))
        else:
            key = ("text", text) if recording is None else ("recording", recording["said"])
        groups.setdefault(key, []).append(recording or text)
    return [_one(kind, found) for (kind, _), found in groups.items()]


def _one(kind: str, found: Sequence[re.Match[str] | str]) -> str:
    """The sentence of all that were `found` to be one."""
    first, matches = found[0], [m for m in found if isinstance(m, re.Match)]
    if isinstance(first, str):
        return first
    if kind == "recording":
        names = list(dict.fromkeys(m["recording"] for m in matches))
        return first.string if len(names) == 1 else f"recordings {', '.join(names)}: {first['said']}"
    more = matches[1:]
    if not more:
        return first.string
    by_recording = {name: Counter(_short(m) for m in more if m["recording"] == name) for name in _names(more)}
    same: dict[str, list[str]] = {}
    for name, channels in by_recording.items():
        listed = ", ".join(c if n == 1 else f"{c} ({n} times)" for c, n in channels.items())
        same.setdefault(listed, []).append(name)
    return f"{first.string}; the same of " + " and of ".join(f"{c} in {', '.join(n)}" for c, n in same.items())


def _names(matches: Sequence[re.Match[str]]) -> list[str]:
    return list(dict.fromkeys(m["recording"] for m in matches))


def _short(match: re.Match[str]) -> str:
    """A channel without the label that stands behind its DOF in brackets."""
    return match["channel"].split(" (")[0]
