"""The study's deck in each of its configurations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from femend import _core
from femend.analysis.model_modes import model_modes
from femend.bench.reading.fields import field_parameters
from femend.bench.reading.morphs import morphs_on
from femend.data import ModeSet
from femend.errors import FemendError
from femend.io.deck import read_deck
from femend.model import Model, Parameter, model_of
from femend.model.sensor_point import SensorPoint
from femend.model.terms.rotors import Rotors, deck_rotors
from femend.study.file.study import AS_MODELLED, Study

__all__ = ["LOWEST", "Models", "modes_up_to"]

# modes of the model that are looked at: up to this multiple of the highest measured one
ABOVE = 1.5
# modes of the model among which is an elastic one, whatever is free
LOWEST = 10
# below this share of the highest frequency of interest a mode is one of a free body
RIGID = 1e-4


class Models:
    """The models of a study's configurations, read once and made when they are first asked for; with `morphs` they have
    those of the study's table [updating], with `fields` the parameters of its fields."""

    def __init__(self, study: Study, morphs: bool = False, fields: bool = False) -> None:
        self.study = study
        self._fields = study.updating.field if fields else ()
        self._morphs = study.updating.morph if morphs else ()
        self._made: dict[str, Model] = {}
        self._points: tuple[SensorPoint, ...] = ()

    @cached_property
    def _deck(self) -> _core.Deck:
        return read_deck(self.study.model_file)

    @cached_property
    def rotors(self) -> Rotors:
        """The rotors that the deck declares; raises what the reading of the deck raises."""
        return deck_rotors(self._deck)

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        """Those of the study and its fields; none beside a solver, whose values change in their place, as is told (a
        deck of nodes alone has nothing that they could be of)."""
        if self.study.solver is not None:
            return ()
        return (*self.study.parameters, *field_parameters(self._deck, self._fields))

    @cached_property
    def _alone(self) -> tuple[tuple[int, float], ...]:
        """Masses at the nodes of a deck that has nothing else and stands beside a solver: it is asked for places alone,
        and a model moves somewhere."""
        if self.study.solver is None or self._deck.elements():
            return ()
        return tuple((int(n), 1.0) for n in self._deck.node_ids)

    def of(self, configuration: str = AS_MODELLED) -> Model:
        """The model of a `configuration` by name: its SPC set and added masses.

        Raises StudyError for a name that is none, and what the reading of the deck raises.
        """
        if configuration not in self._made:
            how = self.study.configuration(configuration)
            try:
                made = model_of(
                    self._deck,
                    units=self.study.units,
                    parameters=self._parameters,
                    spc=how.spc,
                    added_mass=how.added_mass or self._alone,
                )
                if self._morphs:
                    made = made.with_morphs(morphs_on(made, self._morphs))
                self._made[configuration] = replace(made, points=self._points)
            except FemendError as error:
                error.add_note(f"in configuration {configuration!r} of {self.study.file}")
                raise
        return self._made[configuration]

    def see(self, points: Sequence[SensorPoint]) -> None:
        """All models have sensors at `points` between nodes from now on."""
        self._points = tuple(points)
        self._made = {name: replace(model, points=self._points) for name, model in self._made.items()}

    def all(self, configurations: Sequence[str]) -> dict[str, Model]:
        """The models of the `configurations` by name, each once."""
        return {name: self.of(name) for name in dict.fromkeys(configurations)}


def modes_up_to(
    model: Model, f_max: float, least: int, zeta: float = 0.0, factors: Mapping[str, float] | None = None
) -> ModeSet:
    """Elastic modes of `model` up to one and a half times `f_max` Hz, at least `least` of them where it has so many;
    each has the damping ratio `zeta`, `factors` are as of `model_modes`. Modes of a free body are left out;
    raises what `model_modes` raises."""
    found = model_modes(model, f_max=ABOVE * f_max, zeta=zeta, factors=factors)
    elastic = found.freq > RIGID * f_max
    if int(elastic.sum()) < least:
        more = least + int((~elastic).sum())
        found = model_modes(model, n_modes=more, zeta=zeta, factors=factors)
        elastic = found.freq > RIGID * f_max
    if elastic.all():
        return found
    keep = np.flatnonzero(elastic)
    return ModeSet(found.freq[keep], found.zeta[keep], found.phi[:, keep], found.dofs, found.scaling)
