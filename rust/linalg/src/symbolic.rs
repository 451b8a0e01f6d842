//! The symbolic factor: computed once per pattern, used for every set of values.

use std::ops::Range;
use std::sync::Arc;

use crate::memory::Memory;
use crate::nodes::Nodes;
use crate::tree::{ROOT, Tree};
use crate::{LinalgError, Ordering, Pattern, Permutation, order};

/// Part of the operations below which a subtree is one task.
const TASK_SHARE: f64 = 1.0 / 24.0;

/// Operations below which a subtree is never divided.
const TASK_LEAST: f64 = 1e8;

/// Consecutive rows of a front that are consecutive in the parent's front too.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// First row among those below the child's own columns.
    pub(crate) from: u32,
    /// The same row in the parent's front.
    pub(crate) to: u32,
    /// Number of rows.
    pub(crate) len: u32,
}

/// An entry of the matrix and its place in the panel of its supernode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    /// Position in the values of the pattern.
    pub(crate) source: u32,
    /// Position in the panel.
    pub(crate) place: u32,
}

/// One supernode: `columns` of the permuted matrix and the rows coupled below them.
#[derive(Debug, Clone)]
pub(crate) struct Supernode {
    pub(crate) columns: Range<usize>,
    /// Rows below, positions in [`Symbolic::rows`].
    pub(crate) rows: Range<usize>,
    /// Panel of the factor, (columns + rows below) x columns, column-major.
    pub(crate) panel: Range<usize>,
    pub(crate) entries: Range<usize>,
    /// Runs that place the rows below in the parent's front.
    pub(crate) runs: Range<usize>,
    pub(crate) children: Vec<u32>,
    /// First supernode of the subtree.
    pub(crate) start: u32,
    /// Depth below the root is odd.
    pub(crate) odd: bool,
    /// Its children are tasks of their own.
    pub(crate) divided: bool,
}

impl Supernode {
    pub(crate) fn width(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn below(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn height(&self) -> usize {
        self.columns.len() + self.rows.len()
    }

    fn flops(&self) -> f64 {
        let (c, r) = (self.width() as f64, self.below() as f64);
        c * r * r + c * c * r + c * c * c / 3.0
    }
}

/// Ordering and supernodes of a pattern.
#[derive(Debug)]
pub struct Symbolic {
    pattern: Arc<Pattern>,
    permutation: Permutation,
    supernodes: Vec<Supernode>,
    roots: Vec<u32>,
    rows: Vec<u32>,
    runs: Vec<Run>,
    entries: Vec<Entry>,
    nnz: usize,
    memory: Memory,
}

impl Symbolic {
    /// Orders a pattern and finds the supernodes of its factor.
    ///
    /// # Errors
    /// [`LinalgError::Library`] or [`LinalgError::Memory`].
    pub fn new(pattern: Arc<Pattern>, ordering: Ordering) -> Result<Self, LinalgError> {
        let nodes = Nodes::new(&pattern);
        let chosen = order::choose(&nodes, ordering)?;
        let tree = Tree::new(&nodes, &chosen.order);
        let permutation = chosen.expand(&nodes, &tree.order);
        let mut symbolic = Self {
            pattern,
            permutation,
            supernodes: Vec::with_capacity(tree.parent.len()),
            roots: vec![],
            rows: vec![],
            runs: vec![],
            entries: vec![],
            nnz: 0,
            memory: Memory::default(),
        };
        symbolic.lay_out(&nodes, &tree);
        symbolic.place_runs();
        symbolic.place_entries()?;
        symbolic.divide();
        symbolic.memory = Memory::of(&symbolic);
        Ok(symbolic)
    }

    /// Supernodes and their rows by DOF.
    fn lay_out(&mut self, nodes: &Nodes, tree: &Tree) {
        let mut start = Vec::with_capacity(tree.order.len() + 1);
        start.push(0u32);
        for &g in &tree.order {
            start.push(start[start.len() - 1] + nodes.dofs[g as usize].len() as u32);
        }
        for s in 0..tree.parent.len() {
            let columns = start[tree.first[s] as usize] as usize..start[tree.first[s + 1] as usize] as usize;
            let first_row = self.rows.len();
            for &r in &tree.rows[s] {
                self.rows.extend(start[r as usize]..start[r as usize + 1]);
            }
            let rows = first_row..self.rows.len();
            let size = (columns.len() + rows.len()) * columns.len();
            self.supernodes.push(Supernode {
                columns,
                rows,
                panel: self.nnz..self.nnz + size,
                entries: 0..0,
                runs: 0..0,
                children: vec![],
                start: s as u32,
                odd: false,
                divided: false,
            });
            self.nnz += size;
        }
        for s in 0..tree.parent.len() {
            let start = self.supernodes[s].start;
            match tree.parent[s] {
                ROOT => self.roots.push(s as u32),
                p => {
                    let parent = &mut self.supernodes[p as usize];
                    parent.children.push(s as u32);
                    parent.start = parent.start.min(start);
                }
            }
        }
        for s in (0..self.supernodes.len()).rev() {
            let odd = !self.supernodes[s].odd;
            for c in self.supernodes[s].children.clone() {
                self.supernodes[c as usize].odd = odd;
            }
        }
    }

    /// Where the rows below each supernode stand in its parent's front.
    fn place_runs(&mut self) {
        let mut local = vec![0u32; self.pattern.n()];
        for p in 0..self.supernodes.len() {
            let parent = self.supernodes[p].clone();
            for (k, at) in parent.columns.clone().enumerate() {
                local[at] = k as u32;
            }
            for (k, &at) in self.rows[parent.rows.clone()].iter().enumerate() {
                local[at as usize] = (parent.width() + k) as u32;
            }
            for &c in &parent.children {
                let first = self.runs.len();
                for (k, &at) in self.rows[self.supernodes[c as usize].rows.clone()].iter().enumerate() {
                    let to = local[at as usize];
                    match self.runs[first..].last_mut() {
                        Some(run) if run.to + run.len == to => run.len += 1,
                        _ => self.runs.push(Run { from: k as u32, to, len: 1 }),
                    }
                }
                self.supernodes[c as usize].runs = first..self.runs.len();
            }
        }
    }

    /// Where each entry of the lower triangle stands in the panels.
    fn place_entries(&mut self) -> Result<(), LinalgError> {
        let (pattern, permutation) = (self.pattern.clone(), &self.permutation);
        let mut local = vec![0u32; pattern.n()];
        self.entries.reserve_exact((pattern.nnz() + pattern.n()) / 2);
        for node in &mut self.supernodes {
            let height = node.height();
            if height.saturating_mul(node.width()) > u32::MAX as usize {
                return Err(LinalgError::Library(format!(
                    "a front of {height} rows and {} columns exceeds 32-bit positions",
                    node.width()
                )));
            }
            for (k, at) in node.columns.clone().enumerate() {
                local[at] = k as u32;
            }
            for (k, &at) in self.rows[node.rows.clone()].iter().enumerate() {
                local[at as usize] = (node.columns.len() + k) as u32;
            }
            let first = self.entries.len();
            for (c, column) in node.columns.clone().enumerate() {
                let j = permutation.forward[column] as usize;
                for source in pattern.range(j) {
                    let row = permutation.inverse[pattern.row_idx()[source] as usize] as usize;
                    if row >= column {
                        let place = (c * height) as u32 + local[row];
                        self.entries.push(Entry { source: source as u32, place });
                    }
                }
            }
            node.entries = first..self.entries.len();
        }
        Ok(())
    }

    /// Marks the supernodes at the top of the tree, whose subtrees are large enough to be divided.
    fn divide(&mut self) {
        let mut total = vec![0.0; self.supernodes.len()];
        for s in 0..self.supernodes.len() {
            total[s] += self.supernodes[s].flops();
            for &c in &self.supernodes[s].children {
                total[s] += total[c as usize];
            }
        }
        let all: f64 = self.roots.iter().map(|&r| total[r as usize]).sum();
        let limit = (all * TASK_SHARE).max(TASK_LEAST);
        for (node, total) in self.supernodes.iter_mut().zip(total) {
            node.divided = total > limit && !node.children.is_empty();
        }
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The order of elimination with its cost.
    pub fn permutation(&self) -> &Permutation {
        &self.permutation
    }

    /// Stored values of the factor, zeros of merged supernodes and upper halves of diagonal blocks included.
    pub fn nnz(&self) -> usize {
        self.nnz
    }

    /// Multiplications and additions of the factorisation.
    pub fn flops(&self) -> f64 {
        self.permutation.flops
    }

    /// Memory a factorisation will take, known before it begins.
    pub fn memory(&self) -> Memory {
        self.memory
    }

    pub(crate) fn supernodes(&self) -> &[Supernode] {
        &self.supernodes
    }

    pub(crate) fn roots(&self) -> &[u32] {
        &self.roots
    }

    pub(crate) fn rows(&self, node: &Supernode) -> &[u32] {
        &self.rows[node.rows.clone()]
    }

    pub(crate) fn runs(&self, node: &Supernode) -> &[Run] {
        &self.runs[node.runs.clone()]
    }

    pub(crate) fn entries(&self, node: &Supernode) -> &[Entry] {
        &self.entries[node.entries.clone()]
    }

    /// Bytes of the index arrays.
    pub(crate) fn index_bytes(&self) -> usize {
        4 * self.rows.len() + 12 * self.runs.len() + 8 * self.entries.len() + 8 * self.pattern.n()
    }
}
