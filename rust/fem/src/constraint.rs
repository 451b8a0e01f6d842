//! Constraints by elimination: `u_g = T u_a`, with T sparse.
//!
//! Each dependent DOF has one equation `u_m = sum c u_j` whose right-hand DOFs may be dependent elsewhere; chains
//! are followed, circles and double dependence are errors. SPC DOFs are zero.

use crate::dof::NodeTable;
use crate::error::FemError;
use crate::mesh::{Components, Id, Mesh, Mpc, Rbar, Rbe2, Rbe3, Rotation};
use crate::small::{Mat, inverse_spd, matmul, norm3, rigid, rotations, sub3};
use std::collections::BTreeMap;

/// One dependent DOF: its equation and where it comes from.
struct Equation {
    source: String,
    terms: Vec<(usize, f64)>,
}

/// Rows of T over the DOFs that are neither dependent nor held ("free", numbered in g-set order).
#[derive(Debug, Clone)]
pub struct Elimination {
    /// For every g-set row its terms (free index, coefficient), ascending.
    pub rows: Vec<Vec<(u32, f64)>>,
    /// g-set row of every free DOF.
    pub free: Vec<usize>,
}

/// Eliminates SPC, MPC, RBAR, RBE2 and RBE3 of the mesh.
///
/// # Errors
/// [`FemError::DoublyDependent`], [`FemError::DependentHeld`], [`FemError::Circular`], [`FemError::Constraint`],
/// [`FemError::UnknownNode`].
pub fn eliminate(mesh: &Mesh, nodes: &NodeTable) -> Result<Elimination, FemError> {
    let mut equations: BTreeMap<usize, Equation> = BTreeMap::new();
    let mut add = |row: usize, source: String, terms: Vec<(usize, f64)>| {
        if let Some(first) = equations.get(&row) {
            let (dof, first) = (nodes.component(row), first.source.clone());
            return Err(FemError::DoublyDependent { dof, first, second: source });
        }
        equations.insert(row, Equation { source, terms });
        Ok(())
    };
    for r in &mesh.rbe2 {
        for (row, terms) in rbe2(r, nodes)? {
            add(row, format!("RBE2 {}", r.id), terms)?;
        }
    }
    for r in &mesh.rbar {
        for (row, terms) in rbar(r, nodes)? {
            add(row, format!("RBAR {}", r.id), terms)?;
        }
    }
    for r in &mesh.rbe3 {
        for (row, terms) in rbe3(r, nodes)? {
            add(row, format!("RBE3 {}", r.id), terms)?;
        }
    }
    for m in &mesh.mpc {
        let (row, terms) = mpc(m, nodes)?;
        add(row, format!("MPC {}", m.id), terms)?;
    }
    let held = held(mesh, nodes)?;
    for (&row, &set) in &held {
        if let Some(e) = equations.get(&row) {
            return Err(FemError::DependentHeld { dof: nodes.component(row), first: e.source.clone(), set });
        }
    }
    solve(nodes, &equations, &held)
}

fn held(mesh: &Mesh, nodes: &NodeTable) -> Result<BTreeMap<usize, Id>, FemError> {
    let mut out = BTreeMap::new();
    for s in &mesh.spc {
        let node = nodes.find(s.node, "SPC set", s.id)?;
        for c in s.components.iter() {
            out.insert(6 * node + c as usize - 1, s.id);
        }
    }
    Ok(out)
}

/// Follows chains until only free DOFs are left.
fn solve(
    nodes: &NodeTable,
    equations: &BTreeMap<usize, Equation>,
    held: &BTreeMap<usize, Id>,
) -> Result<Elimination, FemError> {
    let n_g = nodes.n_g();
    let free: Vec<usize> = (0..n_g).filter(|r| !equations.contains_key(r) && !held.contains_key(r)).collect();
    let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n_g];
    for (i, &row) in free.iter().enumerate() {
        rows[row] = vec![(i as u32, 1.0)];
    }
    let mut done = vec![false; n_g];
    let mut on_path = vec![false; n_g];
    for &start in equations.keys() {
        // depth first without recursion: chains can be long
        let mut stack = vec![start];
        while let Some(&row) = stack.last() {
            if done[row] {
                on_path[row] = false;
                stack.pop();
                continue;
            }
            let equation = &equations[&row];
            on_path[row] = true;
            let next = equation.terms.iter().map(|t| t.0).find(|j| equations.contains_key(j) && !done[*j]);
            if let Some(j) = next {
                if on_path[j] {
                    let through = format!("{} and {}", equation.source, equations[&j].source);
                    return Err(FemError::Circular { dof: nodes.component(j), through });
                }
                stack.push(j);
                continue;
            }
            rows[row] = combine(&equation.terms, &rows);
            done[row] = true;
        }
    }
    Ok(Elimination { rows, free })
}

fn combine(terms: &[(usize, f64)], rows: &[Vec<(u32, f64)>]) -> Vec<(u32, f64)> {
    let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
    for &(j, c) in terms {
        for &(a, v) in &rows[j] {
            *sum.entry(a).or_insert(0.0) += c * v;
        }
    }
    sum.into_iter().filter(|t| t.1 != 0.0).collect()
}

/// Displacements in a node's own frame from those in basic axes (6 x 6).
fn to_frame(nodes: &NodeTable, node: usize) -> Mat<f64> {
    const BASIC: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    rotations(nodes.frame(node).unwrap_or(&BASIC), 2)
}

fn transposed(a: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(a.cols, a.rows);
    for i in 0..a.rows {
        for j in 0..a.cols {
            out[(j, i)] = a[(i, j)];
        }
    }
    out
}

type Equations = Vec<(usize, Vec<(usize, f64)>)>;

fn rbe2(r: &Rbe2, nodes: &NodeTable) -> Result<Equations, FemError> {
    let fail = |why: String| FemError::Constraint { what: "RBE2", id: r.id, why };
    let independent = nodes.find(r.independent, "RBE2", r.id)?;
    let from = transposed(&to_frame(nodes, independent));
    let mut out = Vec::new();
    for id in &r.dependent {
        let node = nodes.find(*id, "RBE2", r.id)?;
        if node == independent {
            return Err(fail(format!("node {id} is both independent and dependent")));
        }
        let arm = sub3(nodes.xyz(node), nodes.xyz(independent));
        let motion = matmul(&to_frame(nodes, node), &matmul(&rigid(arm), &from));
        for c in r.components.iter() {
            let i = c as usize - 1;
            let terms =
                (0..6).filter(|&j| motion[(i, j)] != 0.0).map(|j| (6 * independent + j, motion[(i, j)]));
            out.push((6 * node + i, terms.collect()));
        }
    }
    Ok(out)
}

/// The body's motion q at end A from its six independent components, `u_i = R_i q`; then `u_d = R_d R_i⁻¹ u_i`.
fn rbar(r: &Rbar, nodes: &NodeTable) -> Result<Equations, FemError> {
    let fail = |why: &str| FemError::Constraint { what: "RBAR", id: r.id, why: why.to_owned() };
    let ends = [nodes.find(r.nodes[0], "RBAR", r.id)?, nodes.find(r.nodes[1], "RBAR", r.id)?];
    if ends[0] == ends[1] {
        return Err(fail("both ends are the same node"));
    }
    if (0..2).any(|e| r.independent[e].0 & r.dependent[e].0 != 0) {
        return Err(fail("a component is both independent and dependent"));
    }
    let motion = ends.map(|n| matmul(&to_frame(nodes, n), &rigid(sub3(nodes.xyz(n), nodes.xyz(ends[0])))));
    let rows = |set: &[Components; 2]| -> Vec<(usize, usize)> {
        (0..2).flat_map(|e| set[e].iter().map(move |c| (e, c as usize - 1)).collect::<Vec<_>>()).collect()
    };
    let independent = rows(&r.independent);
    if independent.len() != 6 {
        return Err(fail("needs six independent components at both ends together"));
    }
    // rotations times the length of the bar, so that the singular values compare
    let length = norm3(sub3(nodes.xyz(ends[1]), nodes.xyz(ends[0])));
    let scale = |j: usize| if j < 3 || length == 0.0 { 1.0 } else { 1.0 / length };
    let weight = |i: usize| if i < 3 || length == 0.0 { 1.0 } else { length };
    let a = nalgebra::Matrix6::from_fn(|i, j| {
        let (e, c) = independent[i];
        weight(c) * motion[e][(c, j)] * scale(j)
    });
    let svd = a.svd(false, false).singular_values;
    let inverse = a
        .try_inverse()
        .filter(|_| svd.min() > 1e-8 * svd.max())
        .ok_or_else(|| fail("its independent components do not determine a rigid motion; choose others"))?;
    let mut out = Vec::new();
    for (e, c) in rows(&r.dependent) {
        let mut terms = Vec::new();
        for (k, &(f, d)) in independent.iter().enumerate() {
            let value: f64 = (0..6).map(|j| motion[e][(c, j)] * scale(j) * inverse[(j, k)] * weight(d)).sum();
            if value.abs() > 1e-14 * weight(d) * weight(c).max(1.0) {
                terms.push((6 * ends[f] + d, value));
            }
        }
        out.push((6 * ends[e] + c, terms));
    }
    Ok(out)
}

fn mpc(m: &Mpc, nodes: &NodeTable) -> Result<(usize, Vec<(usize, f64)>), FemError> {
    let fail = |why: &str| FemError::Constraint { what: "MPC", id: m.id, why: why.to_owned() };
    let mut sum: Vec<(usize, f64)> = Vec::new();
    for (dof, coefficient) in &m.terms {
        if !(1..=6).contains(&dof.component) {
            return Err(fail(&format!("component {} of node {} must be 1 to 6", dof.component, dof.node)));
        }
        let row = 6 * nodes.find(dof.node, "MPC", m.id)? + dof.component as usize - 1;
        match sum.iter_mut().find(|t| t.0 == row) {
            Some(t) => t.1 += coefficient,
            None => sum.push((row, *coefficient)),
        }
    }
    let Some(&(row, a)) = sum.first() else { return Err(fail("has no terms")) };
    if a == 0.0 || !a.is_finite() {
        return Err(fail("the coefficient of its first (dependent) DOF is zero"));
    }
    Ok((row, sum[1..].iter().map(|&(j, c)| (j, -c / a)).collect()))
}

/// Weighted least squares: the rigid motion q of the reference node that minimises
/// `sum w |S q - u|²` over the independent components; rotations are weighted with the square of the mean arm, so
/// that the result does not depend on the unit of length (MSC Nastran theory, RBE3).
fn rbe3(r: &Rbe3, nodes: &NodeTable) -> Result<Equations, FemError> {
    let fail = |why: String| FemError::Constraint { what: "RBE3", id: r.id, why };
    let reference = nodes.find(r.reference, "RBE3", r.id)?;
    let (rows, motion, weights, scale) = rbe3_rows(r, nodes, reference)?;
    // normal equations with rotations scaled by the length, so that the pivots compare
    let mut normal = Mat::<f64>::zeros(6, 6);
    for (s, w) in motion.iter().zip(&weights) {
        for i in 0..6 {
            for j in 0..6 {
                normal[(i, j)] += w * s[i] * s[j];
            }
        }
    }
    let inverse = inverse_checked(&normal).ok_or_else(|| {
        fail("its independent components do not determine a rigid motion; add nodes or components".to_owned())
    })?;
    let frame = to_frame(nodes, reference);
    let mut equations: Vec<Vec<(usize, f64)>> = Vec::new();
    for c in r.components.iter() {
        let mut terms = vec![(6 * reference + c as usize - 1, -1.0)];
        for ((row, s), w) in rows.iter().zip(&motion).zip(&weights) {
            let mut value = 0.0;
            for i in 0..6 {
                let unscale = if i < 3 { 1.0 } else { 1.0 / scale };
                for j in 0..6 {
                    value += frame[(c as usize - 1, i)] * unscale * inverse[(i, j)] * s[j] * w;
                }
            }
            terms.push((*row, value));
        }
        equations.push(terms);
    }
    dependent_form(r, nodes, equations)
}

type Rbe3Rows = (Vec<usize>, Vec<[f64; 6]>, Vec<f64>, f64);

/// Independent rows, their scaled rigid-motion rows, weights and the length scale of rotations.
fn rbe3_rows(r: &Rbe3, nodes: &NodeTable, reference: usize) -> Result<Rbe3Rows, FemError> {
    let fail = |why: String| FemError::Constraint { what: "RBE3", id: r.id, why };
    let origin = nodes.xyz(reference);
    let mut found: Vec<(usize, f64, Components)> = Vec::new();
    for group in &r.groups {
        if !(group.weight > 0.0 && group.weight.is_finite()) {
            return Err(fail(format!("weight {} must be positive", group.weight)));
        }
        for id in &group.nodes {
            found.push((nodes.find(*id, "RBE3", r.id)?, group.weight, group.components));
        }
    }
    if found.is_empty() {
        return Err(fail("has no independent nodes".to_owned()));
    }
    let arm = |n: usize| sub3(nodes.xyz(n), origin);
    let mean = found.iter().map(|f| norm3(arm(f.0))).sum::<f64>() / found.len() as f64;
    let scale = if mean > 0.0 { mean } else { 1.0 };
    let (mut rows, mut motion, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for (node, weight, components) in found {
        let s = matmul(&to_frame(nodes, node), &rigid(arm(node)));
        for c in components.iter() {
            let i = c as usize - 1;
            // unknowns: translation, rotation times scale
            let row: [f64; 6] = std::array::from_fn(|j| if j < 3 { s[(i, j)] } else { s[(i, j)] / scale });
            rows.push(6 * node + i);
            motion.push(row);
            weights.push(if c <= 3 { weight } else { weight * scale * scale });
        }
    }
    Ok((rows, motion, weights, scale))
}

fn inverse_checked(normal: &Mat<f64>) -> Option<Mat<f64>> {
    let mut a = nalgebra::DMatrix::from_row_slice(6, 6, &normal.data);
    a = (&a + a.transpose()) * 0.5;
    let eigen = nalgebra::SymmetricEigen::new(a);
    let (low, high) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
    if low <= 1e-10 * high { None } else { inverse_spd(normal) }
}

/// Solves the equations for the dependent DOFs: the reference node's, or UM where given.
fn dependent_form(
    r: &Rbe3,
    nodes: &NodeTable,
    equations: Vec<Vec<(usize, f64)>>,
) -> Result<Equations, FemError> {
    if r.um.is_empty() {
        return Ok(equations.into_iter().map(|t| (t[0].0, t[1..].to_vec())).collect());
    }
    let fail = |why: String| FemError::Constraint { what: "RBE3", id: r.id, why };
    let n = equations.len();
    if r.um.len() != n {
        return Err(fail(format!("UM names {} DOFs, the reference node has {n} components", r.um.len())));
    }
    let mut um = Vec::new();
    for dof in &r.um {
        um.push(6 * nodes.find(dof.node, "RBE3", r.id)? + dof.component.clamp(1, 6) as usize - 1);
    }
    let mut all: Vec<usize> = equations.iter().flatten().map(|t| t.0).collect();
    all.sort_unstable();
    all.dedup();
    let coefficient =
        |e: &[(usize, f64)], row: usize| e.iter().filter(|t| t.0 == row).map(|t| t.1).sum::<f64>();
    let a = nalgebra::DMatrix::from_fn(n, n, |i, j| coefficient(&equations[i], um[j]));
    let inverse = a
        .try_inverse()
        .filter(|inv| inv.iter().all(|v| v.is_finite() && v.abs() < 1e12))
        .ok_or_else(|| fail("its equations cannot be solved for the UM DOFs; choose others".to_owned()))?;
    let mut out = Vec::new();
    for i in 0..n {
        let mut terms = Vec::new();
        for &row in all.iter().filter(|row| !um.contains(row)) {
            let value: f64 = (0..n).map(|k| -inverse[(i, k)] * coefficient(&equations[k], row)).sum();
            if value != 0.0 {
                terms.push((row, value));
            }
        }
        out.push((um[i], terms));
    }
    Ok(out)
}
