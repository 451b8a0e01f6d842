//! RBAR, RBE2, RBE3, MPC, SPC, SPC1 and the sets that combine them.

use super::{Builder, Choice, Selection};
use crate::deck::number::{parse_int, parse_real};
use crate::deck::{CardRef, Result};
use crate::mesh::{Components, Id, Mpc, NodeComponent, Rbar, Rbe2, Rbe3, Rbe3Group, SCALAR_COMPONENT, Spc};

impl<'d> Builder<'d> {
    pub(super) fn rigid(&mut self) -> Result<()> {
        for card in self.deck.cards("RBE2") {
            let rbe2 = self.rbe2(card)?;
            self.mesh.rbe2.push(rbe2);
        }
        for card in self.deck.cards("RBAR") {
            let rbar = self.rbar(card)?;
            self.mesh.rbar.push(rbar);
        }
        for card in self.deck.cards("RBE3") {
            let rbe3 = self.rbe3(card)?;
            self.mesh.rbe3.push(rbe3);
        }
        Ok(())
    }

    /// A real behind the nodes is the thermal expansion coefficient.
    fn rbe2(&self, card: CardRef<'d>) -> Result<Rbe2> {
        let independent = self.node(card, 3)?;
        let components = self.some_components(card, 4)?;
        let mut dependent = Vec::new();
        for (field, id) in card.node_list(5, true)? {
            dependent.push(self.known_node(card, field, id)?);
        }
        if dependent.is_empty() {
            return Err(card.value_error("no dependent node; give at least one from field 5 on"));
        }
        Ok(Rbe2 { id: card.id(2, "the element id")?, independent, components, dependent })
    }

    /// Without dependent components (fields 7 and 8) all that are not independent depend.
    fn rbar(&self, card: CardRef<'d>) -> Result<Rbar> {
        let nodes = [self.node(card, 3)?, self.node(card, 4)?];
        let independent = [card.components(5)?, card.components(6)?];
        let mut dependent = [card.components(7)?, card.components(8)?];
        if dependent.iter().all(|c| c.is_empty()) {
            dependent = independent.map(|c| Components(Components::ALL.0 & !c.0));
        }
        Ok(Rbar { id: card.id(2, "the element id")?, nodes, independent, dependent })
    }

    fn some_components(&self, card: CardRef<'d>, field: usize) -> Result<Components> {
        let components = card.components(field)?;
        if components.is_empty() {
            return Err(card.value_error(format!("field {field}: no components; give some of 123456")));
        }
        Ok(components)
    }

    /// Behind the reference: weight (a real), components, nodes, again a weight ...; then UM with pairs, ALPHA.
    fn rbe3(&self, card: CardRef<'d>) -> Result<Rbe3> {
        let id = card.id(2, "the element id")?;
        let reference = self.node(card, 4)?;
        let components = self.some_components(card, 5)?;
        let mut rbe3 = Rbe3 { id, reference, components, groups: Vec::new(), um: Vec::new() };
        let mut fields = card.fields_from(6).filter(|&field| !card.blank(field)).peekable();
        while let Some(field) = fields.next() {
            let text = card.text(field);
            if text.eq_ignore_ascii_case(b"ALPHA") {
                break;
            }
            if text.eq_ignore_ascii_case(b"UM") {
                while let Some(node) = fields.next_if(|&field| parse_int(card.text(field)).is_some()) {
                    let components =
                        fields.next().ok_or_else(|| card.value_error("UM: a node without components"))?;
                    let components = self.some_components(card, components)?;
                    let node = self.node(card, node)?;
                    rbe3.um.extend(components.iter().map(|component| NodeComponent { node, component }));
                }
            } else if parse_int(text).is_some() && !rbe3.groups.is_empty() {
                let node = self.node(card, field)?;
                rbe3.groups.last_mut().into_iter().for_each(|group| group.nodes.push(node));
            } else if text.eq_ignore_ascii_case(b"THRU") {
                let last = fields.next().map_or(Ok(0), |field| self.node(card, field))?;
                if let Some(group) = rbe3.groups.last_mut()
                    && let Some(&first) = group.nodes.last()
                {
                    let between = self.deck.index.nodes_between(first.saturating_add(1), last);
                    group.nodes.extend(between.filter(|entry| !entry.scalar).map(|entry| entry.id));
                }
            } else {
                let weight =
                    parse_real(text).ok_or_else(|| card.wrong(field, "a weight, a node, UM or ALPHA"))?;
                let components =
                    fields.next().ok_or_else(|| card.value_error("a weight without components and nodes"))?;
                rbe3.groups.push(Rbe3Group {
                    weight,
                    components: self.some_components(card, components)?,
                    nodes: Vec::new(),
                });
            }
        }
        if rbe3.groups.iter().all(|group| group.nodes.is_empty()) {
            return Err(
                card.value_error("no node carries weight; give weight, components and nodes from field 6 on")
            );
        }
        Ok(rbe3)
    }

    pub(super) fn constraints(&mut self, selection: &Selection) -> Result<()> {
        if let Some(set) = self.chosen(selection.mpc, "MPC")? {
            for id in self.members(set, "MPC", &["MPC"])? {
                self.mpc_set(id)?;
            }
        }
        if let Some(set) = self.chosen(selection.spc, "SPC")? {
            for id in self.members(set, "SPC", &["SPC", "SPC1"])? {
                self.spc_set(id)?;
            }
        }
        Ok(())
    }

    fn chosen(&self, choice: Choice, command: &str) -> Result<Option<Id>> {
        match choice {
            Choice::Nothing => Ok(None),
            Choice::Set(id) => Ok(Some(id)),
            Choice::CaseControl => match self.deck.case_control().get(command).map(|text| text.trim()) {
                None | Some("" | "0") => Ok(None),
                Some(text) => match parse_int(text.as_bytes()).and_then(|id| Id::try_from(id).ok()) {
                    Some(id) => Ok(Some(id)),
                    None => Err(self
                        .deck
                        .selection_error(format!("case control: {command} = {text} names no set id"))),
                },
            },
        }
    }

    /// Sets that set `id` stands for: itself, or those that SPCADD (MPCADD) adds up.
    fn members(&self, id: Id, kind: &str, cards: &[&str]) -> Result<Vec<Id>> {
        let sets = |name: &str| -> Vec<Id> {
            self.deck.cards(name).filter_map(|card| card.opt_id(2).ok().flatten()).collect()
        };
        let exists = |id: Id| cards.iter().any(|name| sets(name).contains(&id));
        let adding = format!("{kind}ADD");
        let Some(card) =
            self.deck.cards(&adding).find(|card| matches!(card.opt_id(2), Ok(Some(found)) if found == id))
        else {
            if exists(id) {
                return Ok(vec![id]);
            }
            let mut known: Vec<Id> = cards.iter().flat_map(|name| sets(name)).chain(sets(&adding)).collect();
            known.sort_unstable();
            known.dedup();
            let known = known.iter().take(20).map(ToString::to_string).collect::<Vec<_>>().join(", ");
            let known = if known.is_empty() { "no such set".to_owned() } else { format!("sets {known}") };
            return Err(self
                .deck
                .selection_error(format!("{kind} set {id} is selected, but the deck has {known}")));
        };
        let mut members = Vec::new();
        for field in card.fields_from(3).filter(|&field| !card.blank(field)) {
            let member = card.id(field, "a set")?;
            if !exists(member) {
                return Err(card.missing(field, "set", member));
            }
            members.push(member);
        }
        Ok(members)
    }

    fn mpc_set(&mut self, set: Id) -> Result<()> {
        for card in self.deck.cards("MPC") {
            if card.id(2, "the set id")? != set {
                continue;
            }
            // three fields a term, two terms a line; the first and last field of a line are not used
            let starts = (0..)
                .map(|k| 10 * (k / 2) + 3 + 3 * (k % 2))
                .take_while(|&field| card.fields_from(field).next().is_some());
            let mut terms = Vec::new();
            for field in starts {
                let Some(dof) = self.opt_dof(card, field)? else { continue };
                terms.push((dof, card.real_or(field + 2, 0.0)?));
            }
            match terms.first() {
                Some((_, a)) if *a != 0.0 => self.mesh.mpc.push(Mpc { id: set, terms }),
                _ => {
                    return Err(card.value_error(
                        "the first term is the dependent one and needs a coefficient other than 0",
                    ));
                }
            }
        }
        Ok(())
    }

    /// Enforced displacements of SPC count as zero: modes do not depend on them.
    fn spc_set(&mut self, set: Id) -> Result<()> {
        for card in self.deck.cards("SPC") {
            if card.id(2, "the set id")? != set {
                continue;
            }
            for field in [3, 6] {
                if let Some(node) = card.opt_id(field)? {
                    let components = self.held_components(card, field, node, field + 1)?;
                    self.mesh.spc.push(Spc { id: set, node, components });
                }
            }
        }
        for card in self.deck.cards("SPC1") {
            if card.id(2, "the set id")? != set {
                continue;
            }
            for (field, node) in card.node_list(4, false)? {
                let components = self.held_components(card, field, node, 3)?;
                self.mesh.spc.push(Spc { id: set, node, components });
            }
        }
        Ok(())
    }

    /// What `components` holds of the node in `field`: of a scalar point its only DOF, given as 0, blank or with 1.
    fn held_components(&self, card: CardRef<'d>, field: usize, node: Id, at: usize) -> Result<Components> {
        if !self.is_scalar(card, field, node)? {
            return self.some_components(card, at);
        }
        let components = card.components(at)?;
        if components.is_empty() || components.contains(1) {
            return Ok(Components::from_list(&[SCALAR_COMPONENT]));
        }
        Err(card.value_error(format!("field {at}: scalar point {node} has component 0 alone")))
    }
}
