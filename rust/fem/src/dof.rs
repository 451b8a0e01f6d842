//! Nodes by index and DOFs by number: row of the g-set = `6 * node_index + component - 1`.

use crate::error::FemError;
use crate::mesh::{Id, Node, NodeComponent, Rotation};
use std::collections::HashMap;

/// Nodes of the model in the deck's order, looked up by id.
#[derive(Debug, Clone)]
pub struct NodeTable {
    /// Nodes.
    pub nodes: Vec<Node>,
    index: HashMap<Id, usize>,
}

impl NodeTable {
    /// Table of the nodes.
    ///
    /// # Errors
    /// [`FemError::Duplicate`] when two nodes share an id.
    pub fn new(nodes: &[Node]) -> Result<Self, FemError> {
        let mut index = HashMap::with_capacity(nodes.len());
        for (i, node) in nodes.iter().enumerate() {
            if index.insert(node.id, i).is_some() {
                let count = nodes.iter().filter(|n| n.id == node.id).count();
                return Err(FemError::Duplicate { what: "node", id: node.id, count });
            }
        }
        Ok(Self { nodes: nodes.to_vec(), index })
    }

    /// Index of node `node`, asked for by entity `what` `id`.
    ///
    /// # Errors
    /// [`FemError::UnknownNode`].
    pub fn find(&self, node: Id, what: &str, id: Id) -> Result<usize, FemError> {
        self.index.get(&node).copied().ok_or_else(|| FemError::UnknownNode {
            what: what.to_owned(),
            id,
            node,
        })
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Is there no node?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Number of rows of the g-set.
    #[must_use]
    pub fn n_g(&self) -> usize {
        6 * self.len()
    }

    /// Position of a node by index, basic coordinates.
    #[must_use]
    pub fn xyz(&self, index: usize) -> [f64; 3] {
        self.nodes[index].xyz
    }

    /// Displacement frame of a node by index; `None` = basic.
    #[must_use]
    pub fn frame(&self, index: usize) -> Option<&Rotation> {
        self.nodes[index].frame.as_ref()
    }

    /// Node id and component of a g-set row.
    #[must_use]
    pub fn component(&self, row: usize) -> NodeComponent {
        NodeComponent { node: self.nodes[row / 6].id, component: (row % 6) as u8 + 1 }
    }
}
