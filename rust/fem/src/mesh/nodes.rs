//! Nodes and sets of their displacement components.

/// Id of a node, element, property or material, as in the deck.
pub type Id = u32;

/// Direction cosines of a local frame: row i is local axis i in basic coordinates, so `local = R * basic`.
pub type Rotation = [[f64; 3]; 3];

/// A set of displacement components, bit `c - 1` for component `c` in 1..=6 (X Y Z RX RY RZ).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Components(pub u8);

impl Components {
    /// All six components.
    pub const ALL: Self = Self(0b11_1111);

    /// The set holding the components in `list`; anything outside 1..=6 is ignored.
    #[must_use]
    pub fn from_list(list: &[u8]) -> Self {
        Self(list.iter().filter(|c| (1..=6).contains(*c)).fold(0, |set, c| set | 1 << (c - 1)))
    }

    /// Is component `c` (1..=6) in the set?
    #[must_use]
    pub fn contains(self, c: u8) -> bool {
        (1..=6).contains(&c) && self.0 & (1 << (c - 1)) != 0
    }

    /// The components of the set, ascending, 1..=6.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=6).filter(move |&c| self.contains(c))
    }

    /// Is the set empty?
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 & Self::ALL.0 == 0
    }
}

/// One displacement component (1..=6, in the node's displacement frame) of one node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeComponent {
    /// Node id.
    pub node: Id,
    /// Component 1..=6.
    pub component: u8,
}

/// Component that carries the one DOF of a scalar point (SPOINT); its other five are held.
///
/// A rotation, because whoever looks for motion in space (sensors, forces, supports, mass along an axis) looks at
/// translations, and those of a scalar point stand still.
pub const SCALAR_COMPONENT: u8 = 4;

/// GRID: position and displacement frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Node id.
    pub id: Id,
    /// Position, basic coordinates, length.
    pub xyz: [f64; 3],
    /// Displacement (CD) frame *at this node* (a cylindrical or spherical CD already evaluated); `None` = basic.
    pub frame: Option<Rotation>,
}
