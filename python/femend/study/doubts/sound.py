"""What is doubtful about a study's deck and its recordings' channels: refused where nothing is left of them, else
told."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femend import _core
from femend.data import Test
from femend.model.cards.material_units import material_doubts
from femend.model.cards.negative import negative_values
from femend.model.cards.no_area import zero_areas
from femend.model.cards.unheeded import unheeded
from femend.model.cards.unselected import unselected_supports
from femend.study.doubts.frf_levels import frf_levels
from femend.study.doubts.gathered import gathered
from femend.study.doubts.overlapping import overlaps
from femend.study.doubts.priors import prior_doubts
from femend.study.doubts.rotor_doubts import rotor_doubts
from femend.study.doubts.unused_configurations import unused_configurations

if TYPE_CHECKING:
    from femend.study.file.study import Study

__all__ = ["deck_doubts", "deck_warnings", "warnings_of"]


def warnings_of(study: Study, deck: _core.Deck, test: Test) -> list[str]:
    """What is told of the `deck` of a `study`, of configurations without a recording, of the channels of all
    recordings, of recordings that hold the same stretch of time, and of FRFs that do not agree."""
    channels = gathered((r.name, w) for r in test for w in r.warnings)
    unused = unused_configurations(study)
    return [*deck_warnings(study, deck), *unused, *channels, *overlaps(test.recordings), *frf_levels(test)]


def deck_doubts(study: Study, deck: _core.Deck) -> list[str]:
    """What makes the `deck` of a `study` hardly the one that is meant: its units, and supports that are not
    selected."""
    free = unselected_supports(deck) if _own_supports(study) else []
    return [*material_doubts(deck, study.units), *free]


def _own_supports(study: Study) -> bool:
    """Whether some configuration that is fitted is held as the deck's case control says."""
    used = {r.configuration for r in study.recordings if r.role == "fit"}
    return not used or any(study.configuration(name).spc is None for name in used)


def deck_warnings(study: Study, deck: _core.Deck) -> list[str]:
    """What is told of the `deck` of a `study` and of how well it is said to be known: units, supports that are not
    selected, what its case control asks for and does not get, values below nothing, bars without a cross-section,
    priors that are hardly meant, rotors."""
    return [
        *deck_doubts(study, deck),
        *unheeded(deck, _own_supports(study)),
        *negative_values(deck),
        *zero_areas(deck),
        *prior_doubts(study.parameters),
        *rotor_doubts(study, deck),
    ]
