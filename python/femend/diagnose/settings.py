"""Thresholds of the diagnosis, one set for every study, set on generated cases (tests/blind)."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["AT_NOISE", "CLEARLY", "Settings"]

# misfit up to which a model explains the recordings, and cost by which one has to be better than a simpler one (as
# `consistent` and `gain_cost` of the settings, where these are not at hand)
AT_NOISE, CLEARLY = 1.2, 40.0


@dataclass(frozen=True, slots=True)
class Settings:
    """Every threshold with its meaning.

    Attributes:
        places: places whose laws are fitted.
        margin: places within this cost of the best (in tempered log-posterior units) belong to its ambiguity set.
        kinds: kinds of places, told apart by how they move the sensors, of which at least one place is tried.
        reach: cost by which a place may be worse than the best (in tempered log-posterior units) to be tried so.
        further: the same as a share of the best one's cost, in addition.
        members: members whose stiffness factor is tried in any case: a factor explains less than a free force.
        beddings: the same of elastic beddings under lines and areas.
        nonlinear_places: places at which nonlinear laws are tried too.
        refined: candidates that are fitted with all unknowns together.
        gain_cost: fall of the score (tempered log posterior on unseen data) that a law must bring.
        gain_chosen: relative fall ln(v0/v) of the unseen misfit that a law must bring.
        explained: share of what is wrong with the updated model that a law must take away.
        weak: unseen misfit of the updated model up to which it is `nearly` in place of `explained`: many things take
            part of what is hardly above the noise, the right law takes all of it.
        nearly: the share that a law must take away there.
        partly: the share from which a law that stands out is told as the likeliest, without a name for what is missing.
        clear: the same share from which no further places are tried, if it is enough for a name.
        gain_nonlinear: the same for a nonlinear law against the best linear one.
        parameter_z: prior deviation beyond which a parameter, or the frequency of a mode, alone is a finding.
        adequate: unseen misfit, as a multiple of the law-free one, up to which a name is given.
        strained: prior cost of the model's own unknowns beside a law, in `gain_cost`, from which they stand in for
            something else.
        bent: the same from which the law is no name. Right ones cost 56 at most on sets 82, 83 and 151, a mass told in
            place of a soft support on set 150 cost 1143.
        price: score a fitted law parameter costs, in logarithms of the effective number of values (1: BIC).
        worse: error of the final model on the recordings it was fitted to, as a whole, as a multiple of the updated
            one's, beyond which what was added is not told: it won by what it does outside the band.
        silent: the same error from which what was added only silences the model.
        second: misfit of all recordings up to which a second law is told beside a first one that is told by itself:
            pairs that were right leave 2.0 at most, and what more they leave, motion that depends on its past too much
            to be followed does, of which any other law takes a part.
        together: error of the final model on a fitted recording, in units of its noise, up to which two laws are told
            of which neither is told by itself; beyond, they are the likeliest. Of 22 pairs that were right 20 left 2.5
            at most, the others 3.2 and 7.1 (a stop); what more they leave something else may do, of which one of the
            two has taken a part. A single law that explains the beginning of the recordings alone is held to it, too:
            of those that were right on sets 167 to 170 one was such, and left 1.3.
        same_law: relative difference of two laws' forces below which the simpler one is named.
        worth_naming: share of the updated model's cost that a free force somewhere has to take away, where the model is
            at the noise already, before laws are tried at all.
        far: misfit from which something is missing whatever it is; what is left below it may be many small things.
        consistent: misfit up to which the deck as it stands explains the recordings; where the updated model does, a
            law is given only for what it takes off the model's own priors.
    """

    places: int = 3
    margin: float = 10.0
    kinds: int = 6
    reach: float = 100.0
    further: float = 0.1
    members: int = 3
    beddings: int = 2
    nonlinear_places: int = 3
    refined: int = 3
    gain_cost: float = 40.0
    gain_chosen: float = 0.05
    explained: float = 0.6
    weak: float = 2.0
    nearly: float = 0.88
    partly: float = 0.4
    clear: float = 0.8
    gain_nonlinear: float = 0.15
    parameter_z: float = 5.0
    adequate: float = 1.5
    strained: float = 2.0
    bent: float = 5.0
    price: float = 1.0
    far: float = 3.6
    consistent: float = 1.2
    worse: float = 1.1
    silent: float = 0.95
    second: float = 2.5
    together: float = 3.0
    same_law: float = 0.08
    worth_naming: float = 0.02

    def strains(self, prior: float) -> bool:
        """Whether a law of this prior cost explains by bending the rest of the model."""
        return prior > self.strained * self.gain_cost

    def bends(self, prior: float) -> bool:
        """Whether the model leaves its priors by so much beside a law of this prior cost that the law is no name."""
        return prior > self.bent * self.gain_cost

    def wins(self, gain: float, less: float, relieved: float) -> bool:
        """Whether a fall of the score by `gain` is what a law has to bring: with a relative fall `less` of the unseen
        misfit, or with as much prior cost `relieved` of the model's own unknowns."""
        return bool(gain > self.gain_cost and (less > self.gain_chosen or relieved > self.gain_cost))
