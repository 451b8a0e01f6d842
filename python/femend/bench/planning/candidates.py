"""The physics that a study asks a planned test to tell, on its deck: terms it lacks and supports that give way."""

from __future__ import annotations

from femend.errors import PretestError
from femend.model import Model
from femend.model.cards.near_ids import near_ids
from femend.model.terms.linear_terms import LinearTerm, point_dashpot, point_mass, point_spring, weaker_element
from femend.pretest import GivingSupport
from femend.study.file.bench_settings import CandidateSettings

__all__ = ["support_of", "term_of"]


def support_of(model: Model, c: CandidateSettings, where: str) -> GivingSupport:
    """The support of an entry of the study; raises PretestError, saying `where` the entry is, for a node that the deck
    does not have."""
    for node in c.nodes:
        _known(model, node, where)
    return GivingSupport(c.nodes, c.components, c.k)


def term_of(model: Model, c: CandidateSettings, where: str) -> LinearTerm:
    """The term of an entry of the study; raises PretestError, saying `where` the entry is, for a node or element that
    the deck does not have, and for a node at which nothing can move."""
    if c.physics == "joint_stiffness":
        assert c.element is not None
        known = {int(e) for e, _, _ in model.fe.elements()}
        if c.element not in known:
            raise PretestError(f"{where}: element {c.element} is not among the {len(known)} elements of the model")
        return weaker_element(model, c.element)
    assert c.node is not None
    _known(model, c.node, where)
    if c.physics == "added_mass":
        made = point_mass(model, c.node, c.size)
    else:
        to_ground = point_dashpot if c.physics == "viscous_damper" else point_spring
        made = to_ground(model, c.node, c.component, c.size)
    T = model.transformation()
    if not any(abs(T.T @ part.matrix @ T).sum() for part in made.parts):
        raise PretestError(f"{where}: {made.name} acts on nothing that moves, since the deck holds its DOFs")
    return made


def _known(model: Model, node: int, where: str) -> None:
    ids = model.node_ids[~model.is_scalar]
    if node not in set(ids.tolist()):
        near = near_ids(node, ids)
        raise PretestError(f"{where}: node {node} is not among the {len(ids)} nodes of the model ({near}); correct it")
