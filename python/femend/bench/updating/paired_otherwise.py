"""Modes that an update fits with another mode of the model than the one they look most like in the end."""

from __future__ import annotations

from collections.abc import Sequence

from femend.bench.reading.compared import Compared
from femend.bench.updating.counted import Counted
from femend.estimate.updating import UpdateResult
from femend.numerals import plain

__all__ = ["paired_otherwise"]

# frequencies of one mode of the updated model, solved for twice, differ by less
SAME = 1e-4


def paired_otherwise(found: UpdateResult, counted: Sequence[Counted], after: Sequence[Compared]) -> list[str]:
    """Modes that count, fitted with one mode of the model and compared with another one where all modes of their
    recording are paired together: the tables show the latter, and the fit meets the former."""
    let_go = found.let_go()
    rows = {(r.configuration, r.mode): r for r in found.modes() if (r.configuration, r.mode) not in let_go}
    shown = {c.measured.name: {r.a + 1: r for r in c.comparison.table.rows} for c in after}
    told = []
    for c in counted:
        for number in c.numbers:
            fitted, compared = rows.get((c.name, number)), shown.get(c.sources[0], {}).get(number)
            if len(c.sources) > 1 or fitted is None or compared is None or not fitted.mate:
                continue
            if abs(compared.freq_b / fitted.freq_after - 1) > SAME:
                told.append(
                    f"recording {c.name!r}: mode {number} at {plain(fitted.freq)} Hz was fitted with the model's mode "
                    f"at {plain(fitted.freq_after)} Hz (MAC {plain(fitted.mac_after, 2)}), and beside all measured "
                    f"modes is paired with that at {plain(compared.freq_b)} Hz (MAC {plain(compared.mac, 2)}), which "
                    "the tables show: which of them it is has to be settled before its frequency counts (sensors, or "
                    "[updating] modes)"
                )
    return told
