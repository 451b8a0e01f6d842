//! DOFs of one node found although their adjacency differs: some of their stiffnesses are zero and are not stored.
//!
//! The factor then holds those zeros, most of which elimination fills anyway, and the graph of nodes is several times
//! smaller, which dissection needs to see separators at all.

use crate::Pattern;

/// DOFs that a node may have when they are joined by likeness.
const NODE_DOFS: usize = 6;

/// Share of common neighbours from which two consecutive DOFs belong to one node. Neighbouring nodes of a regular mesh of
/// solids share 0.5, on its faces 0.67.
const ALIKE: f64 = 0.75;

/// Share from which they may belong to one node if the nodes they couple agree: displacement and rotation of a node with
/// beams in oblique directions share 0.67, and so do neighbours on faces.
const LIKELY: f64 = 0.6;

/// Share of common neighbouring nodes from which what was likely is taken. Neighbours joined in pairs along a line share
/// a third of the pairs around them.
const AGREED: f64 = 0.75;

/// Joins the groups of DOFs that belong to one node. `group` has the group of each DOF; groups are numbered anew, by their
/// first DOFs.
pub(crate) fn join(pattern: &Pattern, group: &mut Vec<u32>) {
    join_alike(pattern, group, ALIKE);
    let mut likely = group.clone();
    join_alike(pattern, &mut likely, LIKELY);
    if likely != *group {
        split_where_nodes_differ(pattern, group, &mut likely);
        number(&mut likely);
        *group = likely;
    }
}

/// Members of each group, rising.
pub(crate) fn members(group: &[u32]) -> Vec<Vec<u32>> {
    let count = group.iter().max().map_or(0, |&g| g as usize + 1);
    let mut dofs = vec![Vec::new(); count];
    group.iter().enumerate().for_each(|(j, &g)| dofs[g as usize].push(j as u32));
    dofs
}

/// Joins groups of consecutive DOFs that share most of their neighbours.
fn join_alike(pattern: &Pattern, group: &mut [u32], alike: f64) {
    let mut dofs = members(group);
    for j in 1..pattern.n() {
        let (g, h) = (group[j - 1] as usize, group[j] as usize);
        if g == h || dofs[g].len() + dofs[h].len() > NODE_DOFS {
            continue;
        }
        if share(pattern.column(dofs[g][0] as usize), pattern.column(j)) >= alike {
            let moved = std::mem::take(&mut dofs[h]);
            moved.iter().for_each(|&d| group[d as usize] = g as u32);
            dofs[g].extend(moved);
            dofs[g].sort_unstable();
        }
    }
    number(group);
}

/// Takes joined groups apart again where the parts do not couple the same nodes.
fn split_where_nodes_differ(pattern: &Pattern, parts: &[u32], joined: &mut [u32]) {
    let nodes_around = |part: &[u32]| {
        let rows = part.iter().flat_map(|&d| pattern.column(d as usize));
        let mut around: Vec<u32> = rows.map(|&i| joined[i as usize]).collect();
        around.sort_unstable();
        around.dedup();
        around
    };
    let part_dofs = members(parts);
    let mut apart = Vec::new();
    for dofs in members(joined) {
        let mut own: Vec<u32> = dofs.iter().map(|&d| parts[d as usize]).collect();
        own.sort_unstable();
        own.dedup();
        let around: Vec<Vec<u32>> = own.iter().map(|&p| nodes_around(&part_dofs[p as usize])).collect();
        if around.windows(2).any(|pair| share(&pair[0], &pair[1]) < AGREED) {
            apart.extend(own);
        }
    }
    let fresh = joined.len() as u32;
    for part in apart {
        part_dofs[part as usize].iter().for_each(|&d| joined[d as usize] = fresh + part);
    }
}

/// Numbers groups by their first DOFs.
fn number(group: &mut [u32]) {
    let mut of = vec![u32::MAX; 2 * group.len()];
    let mut count = 0;
    for g in group {
        if of[*g as usize] == u32::MAX {
            of[*g as usize] = count;
            count += 1;
        }
        *g = of[*g as usize];
    }
}

/// Entries that two rising lists have in common, as a part of all; 0 where their lengths already say it is small.
fn share(a: &[u32], b: &[u32]) -> f64 {
    let least = LIKELY.min(AGREED);
    if (a.len().min(b.len()) as f64) < least * a.len().max(b.len()) as f64 {
        return 0.0;
    }
    let (mut i, mut j, mut common) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        common += usize::from(a[i] == b[j]);
        (i, j) = (i + usize::from(a[i] <= b[j]), j + usize::from(b[j] <= a[i]));
    }
    common as f64 / ((a.len() + b.len() - common) as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of nodes with 3 displacements and 3 rotations; a displacement meets the two rotations across it.
    fn beams(nodes: usize) -> Pattern {
        let mut entries = Vec::new();
        for a in 0..nodes {
            for b in a.saturating_sub(1)..(a + 2).min(nodes) {
                for d in 0..6 {
                    entries
                        .extend((0..6).filter(|e| d % 3 != e % 3 || d == *e).map(|e| (6 * a + d, 6 * b + e)));
                }
            }
        }
        Pattern::from_entries(6 * nodes, entries).unwrap()
    }

    #[test]
    fn displacements_and_rotations_of_a_beam_node_are_joined() {
        let p = beams(50);
        let mut group: Vec<u32> = (0..p.n() as u32).collect();
        join(&p, &mut group);
        assert!(group.iter().enumerate().all(|(j, &g)| g as usize == j / 6), "{:?}", &group[..24]);
    }

    #[test]
    fn nodes_at_the_ends_of_lines_of_solids_stay_apart_although_they_share_most() {
        let (m, w) = (6, 3);
        let near = |a: usize, b: usize| a.abs_diff(b) <= 1;
        let mut entries = Vec::new();
        for i in 0..m * m * m {
            for j in 0..=i {
                if near(i / m / m, j / m / m) && near(i / m % m, j / m % m) && near(i % m, j % m) {
                    entries.extend((0..w * w).map(|k| (w * i + k / w, w * j + k % w)));
                }
            }
        }
        let p = Pattern::from_entries(m * m * m * w, entries).unwrap();
        let nodes: Vec<u32> = (0..p.n()).map(|j| (j / w) as u32).collect();
        let mut group = nodes.clone();
        join_alike(&p, &mut group, LIKELY);
        assert_ne!(group, nodes);
        let mut group: Vec<u32> = (0..p.n() as u32).collect();
        join(&p, &mut group);
        assert_eq!(group, nodes);
    }

    #[test]
    fn nothing_is_joined_in_an_empty_or_a_diagonal_matrix() {
        for n in [0, 5] {
            let p = Pattern::from_entries(n, []).unwrap();
            let mut group: Vec<u32> = (0..n as u32).collect();
            join(&p, &mut group);
            assert_eq!(group, (0..n as u32).collect::<Vec<_>>());
        }
    }
}
