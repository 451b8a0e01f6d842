//! Coordinate systems: CORD1i, CORD2i, evaluated in the basic system on first use.

use std::collections::HashMap;

use super::Deck;
use super::card::CardRef;
use super::error::Result;
use super::index::Space;
use crate::mesh::{Id, Rotation};

/// New positions of nodes, basic coordinates.
pub type Positions = HashMap<Id, V3>;

/// Point or vector.
pub type V3 = [f64; 3];

/// a + b.
#[must_use]
pub fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[must_use]
pub fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Vector product.
#[must_use]
pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length.
#[must_use]
pub fn norm(a: V3) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

/// a / |a|; `None` for the zero vector.
#[must_use]
pub fn unit(a: V3) -> Option<V3> {
    let n = norm(a);
    (n > 0.0).then(|| a.map(|x| x / n))
}

/// Local components to basic: transposed `r` times `v` (rows of `r` are the local axes).
#[must_use]
pub fn to_basic(r: &Rotation, v: V3) -> V3 {
    std::array::from_fn(|i| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2])
}

fn to_local(r: &Rotation, v: V3) -> V3 {
    std::array::from_fn(|i| r[i][0] * v[0] + r[i][1] * v[1] + r[i][2] * v[2])
}

/// Tensor in local axes to basic axes: rᵀ t r.
#[must_use]
pub fn tensor_to_basic(r: &Rotation, t: &[V3; 3]) -> [V3; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let mut sum = 0.0;
            for k in 0..3 {
                for l in 0..3 {
                    sum += r[k][i] * t[k][l] * r[l][j];
                }
            }
            sum
        })
    })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Rectangular,
    Cylindrical,
    Spherical,
}

/// A coordinate system in the basic one.
#[derive(Debug, Clone, Copy)]
pub struct Coord {
    kind: Kind,
    origin: V3,
    axes: Rotation,
}

/// The basic system.
pub const BASIC: Coord = Coord {
    kind: Kind::Rectangular,
    origin: [0.0; 3],
    axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
};

impl Coord {
    /// Are its axes the same everywhere?
    #[must_use]
    pub fn is_rectangular(&self) -> bool {
        self.kind == Kind::Rectangular
    }

    /// Coordinates in this system (angles in degrees) to basic ones.
    #[must_use]
    pub fn point(&self, p: V3) -> V3 {
        let (a, b) = (p[1].to_radians(), p[2].to_radians());
        let local = match self.kind {
            Kind::Rectangular => p,
            Kind::Cylindrical => [p[0] * a.cos(), p[0] * a.sin(), p[2]],
            Kind::Spherical => [p[0] * a.sin() * b.cos(), p[0] * a.sin() * b.sin(), p[0] * a.cos()],
        };
        add(self.origin, to_basic(&self.axes, local))
    }

    /// Coordinates in this system (angles in degrees) of the basic point `at`; of the angles that mean the same the ones
    /// nearest to those of `near`, and those of `near` where they have no meaning.
    #[must_use]
    pub fn coordinates(&self, at: V3, near: V3) -> V3 {
        let p = to_local(&self.axes, sub(at, self.origin));
        let radius = p[0].hypot(p[1]);
        let angle = |y: f64, x: f64, near: f64| {
            let found = y.atan2(x).to_degrees();
            found + 360.0 * ((near - found) / 360.0).round()
        };
        let turn = |near: f64| if radius > 0.0 { angle(p[1], p[0], near) } else { near };
        match self.kind {
            Kind::Rectangular => p,
            Kind::Cylindrical => [radius, turn(near[1]), p[2]],
            Kind::Spherical => {
                let polar = if norm(p) > 0.0 { radius.atan2(p[2]).to_degrees() } else { near[1] };
                [norm(p), polar, turn(near[2])]
            }
        }
    }

    /// Its third axis in basic coordinates, of a cylindrical or spherical system the one that its angle goes about.
    #[must_use]
    pub fn third_axis(&self) -> V3 {
        self.axes[2]
    }

    /// Direction cosines of this system's axes at the basic point `at`: those of the radius and the angles for a
    /// curved system (angles taken as zero on its axis, where they have no meaning).
    #[must_use]
    pub fn frame(&self, at: V3) -> Rotation {
        let p = to_local(&self.axes, sub(at, self.origin));
        let radius = p[0].hypot(p[1]);
        let (c, s) = if radius > 1e-12 * norm(p).max(f64::MIN_POSITIVE) {
            (p[0] / radius, p[1] / radius)
        } else {
            (1.0, 0.0)
        };
        let local = match self.kind {
            Kind::Rectangular => return self.axes,
            Kind::Cylindrical => [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]],
            Kind::Spherical => {
                let r = norm(p);
                let (ct, st) = if r > 0.0 { (p[2] / r, radius / r) } else { (1.0, 0.0) };
                [[st * c, st * s, ct], [ct * c, ct * s, -st], [-s, c, 0.0]]
            }
        };
        local.map(|axis| to_basic(&self.axes, axis))
    }
}

/// Deepest nesting of systems defined in one another.
const DEPTH: usize = 500;

/// Evaluates coordinate systems and node positions, which may depend on each other.
pub struct Coords<'d> {
    deck: &'d Deck,
    default_cp: Option<Id>,
    moved: Positions,
    known: HashMap<Id, Coord>,
    underway: Vec<Id>,
}

impl<'d> Coords<'d> {
    /// `default_cp` is GRDSET's.
    #[must_use]
    pub fn new(deck: &'d Deck, default_cp: Option<Id>) -> Self {
        Self { deck, default_cp, moved: Positions::new(), known: HashMap::new(), underway: Vec::new() }
    }

    /// Nodes that stand elsewhere than the deck says.
    #[must_use]
    pub fn with(mut self, moved: &Positions) -> Self {
        self.moved = moved.clone();
        self
    }

    /// The system that `field` of `card` names; 0 and blank are the basic one.
    pub fn of(&mut self, card: CardRef<'_>, field: usize) -> Result<Coord> {
        match card.opt_id(field)? {
            None => Ok(BASIC),
            Some(id) => self.get(id, card, field),
        }
    }

    /// System `id`, to which `field` of `card` refers.
    pub fn get(&mut self, id: Id, card: CardRef<'_>, field: usize) -> Result<Coord> {
        if let Some(coord) = self.known.get(&id) {
            return Ok(*coord);
        }
        let missing = || card.missing(field, "coordinate system", id);
        let entry = self.deck.index.get(Space::Coord, id).ok_or_else(missing)?;
        if self.underway.contains(&id) || self.underway.len() > DEPTH {
            return Err(card.value_error(format!(
                "coordinate system {id} is defined by itself through {} others; refer it to the basic system",
                self.underway.len().saturating_sub(1)
            )));
        }
        self.underway.push(id);
        let coord = self.evaluate(self.deck.card(entry.card as usize), usize::from(entry.slot) * 4);
        self.underway.pop();
        let coord = coord?;
        self.known.insert(id, coord);
        Ok(coord)
    }

    fn evaluate(&mut self, card: CardRef<'d>, shift: usize) -> Result<Coord> {
        let kind = match card.name().as_bytes()[5] {
            b'R' => Kind::Rectangular,
            b'C' => Kind::Cylindrical,
            _ => Kind::Spherical,
        };
        let [a, b, c] = if card.name().starts_with("CORD1") {
            let mut points = [[0.0; 3]; 3];
            for (k, point) in points.iter_mut().enumerate() {
                *point = self.node(card, 3 + k + shift)?;
            }
            points
        } else {
            let base = self.of(card, 3)?;
            let [a, b, c] = [[4, 5, 6], [7, 8, 9], [12, 13, 14]].map(|fields| card.vector(fields));
            [base.point(a?), base.point(b?), base.point(c?)]
        };
        let z = unit(sub(b, a));
        let y = z.and_then(|z| {
            let side = cross(z, sub(c, a));
            unit(side).filter(|_| norm(side) > 1e-9 * norm(sub(c, a)))
        });
        match (y, z) {
            (Some(y), Some(z)) => Ok(Coord { kind, origin: a, axes: [cross(y, z), y, z] }),
            _ => {
                Err(card
                    .value_error("its three points lie on one line and define no axes; move the third one"))
            }
        }
    }

    /// Position of the node that `field` of `card` names.
    fn node(&mut self, card: CardRef<'d>, field: usize) -> Result<V3> {
        let id = card.id(field, "a node")?;
        let entry = self.deck.index.get(Space::Node, id).filter(|entry| !entry.scalar);
        let entry = entry.ok_or_else(|| card.missing(field, "GRID", id))?;
        if self.moved.contains_key(&id) {
            return Err(card.value_error(format!(
                "its axes stand on node {id}, which is moved, so that everything given in them would move too; leave the \
                 node where it is, or define the system by points (CORD2)"
            )));
        }
        self.position(self.deck.card(entry.card as usize))
    }

    /// Position of a GRID in basic coordinates.
    pub fn position(&mut self, grid: CardRef<'_>) -> Result<V3> {
        if !self.moved.is_empty()
            && let Some(moved) = self.moved.get(&grid.id(2, "the id")?)
        {
            return Ok(*moved);
        }
        let point = grid.vector([4, 5, 6])?;
        Ok(self.system(grid)?.point(point))
    }

    /// Coordinates of the basic point `at` in the system that a GRID is given in.
    pub fn coordinates(&mut self, grid: CardRef<'_>, at: V3) -> Result<V3> {
        let near = grid.vector([4, 5, 6])?;
        Ok(self.system(grid)?.coordinates(at, near))
    }

    /// System that a GRID is given in.
    fn system(&mut self, grid: CardRef<'_>) -> Result<Coord> {
        match if grid.blank(3) { self.default_cp } else { grid.opt_id(3)? } {
            None => Ok(BASIC),
            Some(id) => self.get(id, grid, 3),
        }
    }
}
