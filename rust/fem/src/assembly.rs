//! Element matrices into the fixed pattern: `K_a = sum T_eᵀ K_e T_e`, element by element, so that constraints and
//! displacement frames are in the pattern once and for all.

use crate::constraint::Elimination;
use crate::dof::NodeTable;
use crate::element::Element;
use crate::error::FemError;
use crate::pattern::{element_pattern, mirror, symmetrise};
use crate::small::Mat;
use femend_linalg::Pattern;

/// From an element's rows to the DOFs it acts on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Map {
    /// Every row is one DOF or none: local row of each DOF.
    Select(Vec<u16>),
    /// Rows are combinations: (rows x DOFs).
    Dense(Mat<f64>),
}

/// An element's DOFs (ascending) and map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Placement {
    pub(crate) dofs: Vec<u32>,
    pub(crate) map: Map,
}

impl Placement {
    /// Placement of an element given the rows of T.
    pub(crate) fn new(element: &Element, nodes: &NodeTable, rows: &[Vec<(u32, f64)>]) -> Self {
        let local: Vec<Vec<(u32, f64)>> =
            element.rows.iter().map(|&g| row_of(element, nodes, rows, g)).collect();
        let mut dofs: Vec<u32> = local.iter().flatten().map(|t| t.0).collect();
        dofs.sort_unstable();
        let distinct = dofs.windows(2).all(|w| w[0] != w[1]);
        dofs.dedup();
        if distinct && local.iter().all(|r| r.is_empty() || (r.len() == 1 && r[0].1 == 1.0)) {
            let mut select = vec![0_u16; dofs.len()];
            for (i, row) in local.iter().enumerate() {
                if let Some(p) = row.first().and_then(|t| dofs.binary_search(&t.0).ok()) {
                    select[p] = i as u16;
                }
            }
            return Self { dofs, map: Map::Select(select) };
        }
        let mut t = Mat::zeros(local.len(), dofs.len());
        for (i, row) in local.iter().enumerate() {
            for (dof, value) in row {
                if let Ok(p) = dofs.binary_search(dof) {
                    t[(i, p)] = *value;
                }
            }
        }
        Self { dofs, map: Map::Dense(t) }
    }

    /// The same placement over more DOFs (ascending); `None` when one of its own is not among them.
    pub(crate) fn on(&self, dofs: &[u32], n_rows: usize) -> Option<Self> {
        if self.dofs == dofs {
            return Some(self.clone());
        }
        let mut t = Mat::zeros(n_rows, dofs.len());
        for (p, dof) in self.dofs.iter().enumerate() {
            let q = dofs.binary_search(dof).ok()?;
            match &self.map {
                Map::Select(select) => t[(select[p] as usize, q)] = 1.0,
                Map::Dense(own) => (0..n_rows).for_each(|i| t[(i, q)] = own[(i, p)]),
            }
        }
        Some(Self { dofs: dofs.to_vec(), map: Map::Dense(t) })
    }

    /// Calls `entry(local row, local column, value)` for the lower triangle of `T_eᵀ A T_e`.
    pub(crate) fn lower(&self, a: &Mat<f64>, mut entry: impl FnMut(usize, usize, f64)) {
        match &self.map {
            Map::Select(select) => {
                for (j, &q) in select.iter().enumerate() {
                    for (i, &p) in select.iter().enumerate().skip(j) {
                        entry(i, j, a[(p as usize, q as usize)]);
                    }
                }
            }
            Map::Dense(t) => {
                let reduced = a.congruence(t);
                for j in 0..t.cols {
                    for i in j..t.cols {
                        entry(i, j, reduced[(i, j)]);
                    }
                }
            }
        }
    }
}

/// Terms of one element row: the T row itself, or, for a row in basic axes at a node with its own frame, their mix.
fn row_of(element: &Element, nodes: &NodeTable, rows: &[Vec<(u32, f64)>], g: usize) -> Vec<(u32, f64)> {
    let frame = nodes.frame(g / 6).filter(|_| !element.in_displacement_frames);
    let Some(frame) = frame else { return rows[g].clone() };
    let first = g - g % 3;
    let mut sum: std::collections::BTreeMap<u32, f64> = std::collections::BTreeMap::new();
    for c in 0..3 {
        for &(dof, value) in &rows[first + c] {
            *sum.entry(dof).or_insert(0.0) += frame[c][g % 3] * value;
        }
    }
    sum.into_iter().filter(|t| t.1 != 0.0).collect()
}

/// Pattern, placements and positions of all elements.
#[derive(Debug, Clone)]
pub(crate) struct Scatter {
    pub(crate) pattern: Pattern,
    mirror: Vec<u32>,
    pub(crate) placements: Vec<Placement>,
    /// Positions of each element's lower triangle, column by column.
    positions: Vec<u32>,
    start: Vec<usize>,
}

impl Scatter {
    pub(crate) fn new(n: usize, placements: Vec<Placement>) -> Result<Self, FemError> {
        let lists: Vec<Vec<u32>> = placements.iter().map(|p| p.dofs.clone()).collect();
        let pattern = element_pattern(n, &lists).map_err(|e| FemError::Pattern(e.to_string()))?;
        let mut positions = Vec::new();
        let mut start = Vec::with_capacity(placements.len() + 1);
        start.push(0);
        for dofs in &lists {
            for (j, &column) in dofs.iter().enumerate() {
                let range = pattern.range(column as usize);
                let (mut at, end) = (range.start, range.end);
                for &row in &dofs[j..] {
                    at += pattern.row_idx()[at..end].partition_point(|&r| r < row);
                    positions.push(at as u32);
                }
            }
            start.push(positions.len());
        }
        Ok(Self { mirror: mirror(&pattern), pattern, placements, positions, start })
    }

    /// Positions of element `e`'s lower triangle.
    pub(crate) fn positions(&self, e: usize) -> &[u32] {
        &self.positions[self.start[e]..self.start[e + 1]]
    }

    /// Position of the transposed entry of every entry.
    pub(crate) fn mirror(&self) -> &[u32] {
        &self.mirror
    }

    /// Copies the lower triangle onto the upper one.
    pub(crate) fn symmetrise(&self, values: &mut [f64]) {
        symmetrise(&self.pattern, &self.mirror, values);
    }

    /// Adds element `e`'s matrix to the lower triangle of `values`.
    pub(crate) fn add(&self, e: usize, a: &Mat<f64>, values: &mut [f64]) {
        self.add_placed(e, &self.placements[e], a, values);
    }

    /// As [`Self::add`], through a `placement` of its own on the same DOFs.
    pub(crate) fn add_placed(&self, e: usize, placement: &Placement, a: &Mat<f64>, values: &mut [f64]) {
        let mut position = self.positions(e).iter();
        placement.lower(a, |_, _, v| {
            if let Some(&p) = position.next() {
                values[p as usize] += v;
            }
        });
    }
}

/// Free DOFs (index into `elimination.free`) that no element resists or loads, one per direction without K, M and C.
///
/// Where K, M and C are positive semidefinite, a direction in which a node's diagonal block vanishes has a vanishing
/// column altogether; holding any one component with a share in it changes nothing else. A direct matrix need not be
/// so (a multiplier that ties two DOFs has no diagonal term): what couples to others stays in the model.
pub(crate) fn unresisted(
    elimination: &Elimination,
    placements: &[Placement],
    matrices: impl Fn(usize) -> Vec<Mat<f64>>,
) -> Vec<usize> {
    // one block per node and per translations / rotations and per matrix kind
    let mut blocks = std::collections::BTreeMap::<usize, [Block; 3]>::new();
    for &g in &elimination.free {
        blocks.entry(g / 3).or_default();
    }
    for (e, placement) in placements.iter().enumerate() {
        for (kind, a) in matrices(e).iter().enumerate() {
            placement.lower(a, |i, j, v| {
                let g = [i, j].map(|x| elimination.free[placement.dofs[x] as usize]);
                if g[0] / 3 != g[1] / 3 {
                    for g in g {
                        if let Some(block) = blocks.get_mut(&(g / 3)) {
                            let coupling = &mut block[kind].coupling[g % 3];
                            *coupling = coupling.max(v.abs());
                        }
                    }
                } else if let Some(block) = blocks.get_mut(&(g[0] / 3)) {
                    block[kind].own[(g[0] % 3, g[1] % 3)] += v;
                    if i != j {
                        block[kind].own[(g[1] % 3, g[0] % 3)] += v;
                    }
                }
            });
        }
    }
    let index: std::collections::HashMap<usize, usize> =
        elimination.free.iter().enumerate().map(|(i, &g)| (g, i)).collect();
    let largest: [f64; 3] =
        std::array::from_fn(|k| blocks.values().map(|b| b[k].own.diagonal().amax()).fold(0.0, f64::max));
    let mut out = Vec::new();
    for (block, kinds) in &blocks {
        let free: Vec<usize> = (0..3).filter(|c| index.contains_key(&(3 * block + c))).collect();
        let tied = |c: usize| kinds.iter().zip(largest).any(|(kind, largest)| kind.ties(c, largest));
        let null = null_components(&kinds.each_ref().map(|kind| kind.own), &free);
        out.extend(null.iter().filter(|&&c| !tied(c)).map(|c| index[&(3 * block + c)]));
    }
    out.sort_unstable();
    out
}

/// Terms of one matrix at the translations or the rotations of a node.
#[derive(Default)]
struct Block {
    /// Among its own components.
    own: nalgebra::Matrix3<f64>,
    /// Largest one of an element to other DOFs, by component.
    coupling: [f64; 3],
}

impl Block {
    /// Whether a component without a diagonal term is coupled to others by more than the rounding of a matrix with
    /// diagonal terms up to `largest`.
    fn ties(&self, c: usize, largest: f64) -> bool {
        self.own[(c, c)] == 0.0 && self.coupling[c] > 1e-12 * largest
    }
}

/// Components to hold so that no direction of the free ones is without all three matrices.
///
/// Negative springs and masses load a direction as positive ones do: each matrix counts by the sizes of its eigenvalues,
/// so that what is below nothing stays in the model, whose solution then says so.
fn null_components(kinds: &[nalgebra::Matrix3<f64>; 3], free: &[usize]) -> Vec<usize> {
    let mut left = free.to_vec();
    let mut held = Vec::new();
    while !left.is_empty() {
        let n = left.len();
        let mut sum = nalgebra::DMatrix::<f64>::zeros(n, n);
        for kind in kinds {
            let block = nalgebra::DMatrix::from_fn(n, n, |i, j| kind[(left[i], left[j])]);
            let size: f64 = free.iter().map(|&c| kind[(c, c)].abs()).sum();
            if size > 0.0 || block.amax() > 0.0 {
                let block = sizes(block);
                sum += &block / size.max(block.trace());
            }
        }
        let eigen = nalgebra::SymmetricEigen::new(sum);
        let (at, low) = eigen.eigenvalues.argmin();
        if low > 1e-12 {
            break;
        }
        let vector = eigen.eigenvectors.column(at);
        // of equal shares the last is held: a node keeps X before Y before Z
        let share = vector.iter().map(|v| (v.abs() * 1e6).round()).collect::<Vec<_>>();
        let best = (0..n).max_by(|&i, &j| share[i].total_cmp(&share[j])).unwrap_or(0);
        held.push(left.remove(best));
    }
    held
}

/// A matrix with the sizes of its eigenvalues in the place of these: itself where none is negative.
fn sizes(a: nalgebra::DMatrix<f64>) -> nalgebra::DMatrix<f64> {
    if a.clone().cholesky().is_some() {
        return a;
    }
    let eigen = nalgebra::SymmetricEigen::new(a);
    let sized = nalgebra::DMatrix::from_diagonal(&eigen.eigenvalues.abs());
    &eigen.eigenvectors * sized * eigen.eigenvectors.transpose()
}
