//! Direct matrices of the mesh into elements: one dense block for DOFs that are all coupled, one per term otherwise.

use super::Resolver;
use crate::element::direct::DirectElement;
use crate::element::{Data, Element};
use crate::error::FemError;
use crate::mesh::{DirectKind, DirectMatrix};
use crate::small::Mat;
use std::collections::{BTreeMap, BTreeSet};

/// A connected part with at least this share of all its pairs becomes one block.
const DENSE: f64 = 0.25;

type Terms = BTreeMap<(usize, usize), f64>;

impl Resolver<'_> {
    pub(super) fn direct(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        for matrix in &self.mesh.direct {
            let mut terms = self.terms(matrix)?;
            if matrix.kind == DirectKind::M {
                // assembly multiplies all mass by WTMASS, which leaves direct mass as it is
                terms.values_mut().for_each(|v| *v /= self.mesh.options.wtmass);
            }
            for part in parts(&terms) {
                let n = part.rows.len();
                if part.terms.len() as f64 >= DENSE * (n * (n + 1) / 2) as f64 {
                    out.push(block(matrix.kind, part.rows, &part.terms));
                    continue;
                }
                for (&(i, j), &v) in &part.terms {
                    let rows: Vec<usize> = BTreeSet::from([i, j]).into_iter().collect();
                    out.push(block(matrix.kind, rows, &Terms::from([((i, j), v)])));
                }
            }
        }
        Ok(())
    }

    /// Terms by rows of the g-set, the smaller first.
    fn terms(&self, matrix: &DirectMatrix) -> Result<Terms, FemError> {
        let mut out = Terms::new();
        for (a, b, value) in &matrix.terms {
            let mut rows = [0; 2];
            for (row, dof) in rows.iter_mut().zip([a, b]) {
                let node = self.nodes.find(dof.node, "DMIG", 0)?;
                if !(1..=6).contains(&dof.component) {
                    let why = format!(
                        "{}: component {} of node {} must be 1 to 6",
                        matrix.name, dof.component, dof.node
                    );
                    return Err(FemError::Element { what: "DMIG".to_owned(), id: 0, why });
                }
                *row = 6 * node + dof.component as usize - 1;
            }
            *out.entry((rows[0].min(rows[1]), rows[0].max(rows[1]))).or_insert(0.0) += value;
        }
        Ok(out)
    }
}

struct Part {
    rows: Vec<usize>,
    terms: Terms,
}

/// Connected parts of the matrix.
fn parts(terms: &Terms) -> Vec<Part> {
    let rows: Vec<usize> =
        terms.keys().flat_map(|&(i, j)| [i, j]).collect::<BTreeSet<_>>().into_iter().collect();
    let at = |row: usize| rows.partition_point(|&r| r < row);
    let mut parent: Vec<usize> = (0..rows.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for &(i, j) in terms.keys() {
        let (a, b) = (root(&mut parent, at(i)), root(&mut parent, at(j)));
        parent[a.max(b)] = a.min(b);
    }
    let mut out: BTreeMap<usize, Part> = BTreeMap::new();
    for (k, &row) in rows.iter().enumerate() {
        let part = out.entry(root(&mut parent, k));
        part.or_insert_with(|| Part { rows: Vec::new(), terms: Terms::new() }).rows.push(row);
    }
    for (&(i, j), &v) in terms {
        if let Some(part) = out.get_mut(&root(&mut parent, at(i))) {
            part.terms.insert((i, j), v);
        }
    }
    out.into_values().collect()
}

fn block(kind: DirectKind, rows: Vec<usize>, terms: &Terms) -> Element {
    let mut values = Mat::zeros(rows.len(), rows.len());
    for (&(i, j), &v) in terms {
        let (a, b) = (rows.partition_point(|&r| r < i), rows.partition_point(|&r| r < j));
        values[(a, b)] = v;
        values[(b, a)] = v;
    }
    let nodes: BTreeSet<usize> = rows.iter().map(|r| r / 6).collect();
    Element {
        id: 0,
        card: "DMIG",
        property: None,
        materials: vec![],
        nodes: nodes.into_iter().collect(),
        rows,
        in_displacement_frames: true,
        data: Data::Direct(DirectElement { kind, values }),
    }
}
