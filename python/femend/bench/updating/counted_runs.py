"""The orders of a rotor's runs that count in an update: which lines, how well they are known, under which forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.run_compared import ComparedRun
from femend.bench.reading.runs import NOISY, MeasuredRun, in_order
from femend.bench.reading.turned import turned_in
from femend.data import ODS, Channel
from femend.errors import UpdatingError
from femend.estimate.updating import Configuration, OrderDifferences, deck_system, rotor_system
from femend.estimate.updating.order_responses import across

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["CountedRun", "counted_runs", "run_configuration", "turned_as_found"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CountedRun:
    """The lines of a `measured` run that count, with complex accelerations `shapes` (n_ch, n_lines) and deviations `sd`
    (n_lines, n_ch) of real and imaginary part each; forces turn in the `sense` (0: free across the shaft) and grow with
    the speed to the `power`. The shaft turns in the sense `spin` where the deck has rotors, else 0."""

    measured: MeasuredRun
    shapes: ODS
    sd: FloatArray
    sense: int
    power: float
    spin: int = 0

    @property
    def name(self) -> str:
        """The run as it is told of."""
        return f"{self.measured.name}{in_order(self.measured.order)}"

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes at which forces act: those of the unbalance where it is known, else the bearings."""
        return tuple(n for n, _ in self.measured.unbalance) or self.measured.nodes


def counted_runs(prepared: Prepared, before: Sequence[ComparedRun]) -> tuple[tuple[CountedRun, ...], tuple[str, ...]]:
    """What the runs with role fit say in an update, and a sentence for each that has no part in it.

    Lines are taken evenly over those whose shape is less than half noise, as many as the study says. To the noise of
    every value the study's `order_sd`, a share of the line's largest, is added in squares. Forces of order 1 are those
    of unbalance at the bearings, free across the shaft unless the study says the sense; known ones turn as they did in
    the comparison `before` where the study does not say how. Those of other orders grow with the power that suits best
    there (`turned_as_found` looks again). Raises UpdatingError where no run has a part though the study asks for
    orders.
    """
    settings = prepared.study.updating
    if "orders" not in settings.responses:
        return (), ()
    found: list[CountedRun] = []
    told = []
    for c in before:
        m = c.measured
        if m.role != "fit":
            continue
        clear = np.flatnonzero(m.noise < NOISY)
        if c.response is None or not clear.size:
            told.append(c.why or f"recording {m.name!r}{in_order(m.order)} does not count: all its lines are noise")
            continue
        rows = clear[np.unique(np.linspace(0, clear.size - 1, settings.order_lines).round().astype(np.int64))]
        found.append(_counted(c, rows, settings.order_sd))
    if not found:
        why = "; ".join((*told, *(w for w in prepared.warnings if "is not compared" in w)))
        raise UpdatingError(
            "[updating] responses has 'orders', and no rotor's recording to fit can be compared with the model: "
            f"{why or 'there is none with role fit'}"
        )
    return tuple(found), tuple(told)


def _counted(c: ComparedRun, rows: NDArray[np.int64], order_sd: float) -> CountedRun:
    m = c.measured
    assert c.response is not None
    freq = m.freq[rows]
    course = (2 * np.pi * freq) ** 2
    shapes = m.shapes[rows] * course[:, None]
    largest = np.abs(shapes).max(axis=1, keepdims=True)
    sd = np.hypot(m.sd[rows] * course[:, None] / np.sqrt(2.0), order_sd * largest)
    channels = tuple(Channel(d, "acceleration", "m/s^2") for d in m.dofs)
    ods = ODS(m.name, freq, shapes.T, channels, "order", order=m.order, speed=freq / m.order)
    return CountedRun(m, ods, sd, _sense(m, c.response.sense), c.response.power, c.response.spin)


def turned_as_found(runs: Sequence[CountedRun], after: Sequence[ComparedRun]) -> tuple[CountedRun, ...]:
    """The `runs` with the growth of forces, and the sense of a known unbalance where the study does not say it, that
    suit the updated model best (`after`): with the deck as it stands they may be told wrongly."""
    now = {(c.measured.name, c.measured.order): c.response for c in after}
    out = []
    for run in runs:
        response = now[run.measured.name, run.measured.order]
        if response is not None:
            sense = _sense(run.measured, response.sense)
            run = replace(run, sense=sense, power=response.power, spin=response.spin)
        out.append(run)
    return tuple(out)


def _sense(m: MeasuredRun, compared: int) -> int:
    """The sense in which forces turn: as the study says, with a known unbalance else as in the comparison."""
    if m.order != 1.0:
        return 0
    return (m.sense or compared) if m.unbalance else m.sense


def run_configuration(prepared: Prepared, run: CountedRun) -> Configuration:
    """The configuration of the problem in which `run` is compared: the model with the places of forces among its
    sensors, averaged over the width of a line as the run is."""
    m, model = run.measured, prepared.models.of(run.measured.configuration)
    places = [prepared.placed.places[d] for d in m.dofs]
    # of two sensors at one place of the model the first counts
    rows = [i for i, d in enumerate(places) if d.unsigned not in {e.unsigned for e in places[:i]}]
    seen = [places[i] for i in rows]
    forced = across(run.nodes, m.axis, 0)[0]
    sensors = (*seen, *(d for d in forced if d not in {e.unsigned for e in seen}))
    channels = tuple(Channel(d, "acceleration", "m/s^2") for d in seen)
    response, frfs = OrderDifferences.of(
        replace(run.shapes.select(rows), channels=channels),
        sensors,
        run.nodes,
        m.axis,
        order=m.order,
        sense=run.sense,
        spin=run.spin,
        unbalance=dict(m.unbalance) or None,
        power=run.power,
        sd=run.sd[:, rows],
        width=m.width,
    )
    if run.spin:
        parts = turned_in(prepared.models.rotors, m)
        return Configuration(run.name, rotor_system(model, sensors, parts=parts, frfs=frfs), (response,))
    return Configuration(run.name, deck_system(model, sensors, 0, frfs=frfs), (response,))
