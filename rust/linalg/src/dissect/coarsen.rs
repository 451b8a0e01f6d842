//! Coarsening: neighbours joined by heavy edges become one vertex.

use super::graph::Graph;
use super::random::Random;

/// A coarser graph and the coarse vertex of each fine one.
#[derive(Debug)]
pub(crate) struct Coarse {
    pub(crate) graph: Graph,
    pub(crate) of: Vec<u32>,
}

/// Joins vertices in pairs, none heavier than `limit` afterwards.
pub(crate) fn coarsen(graph: &Graph, limit: i64, random: &mut Random) -> Coarse {
    let partner = matching(graph, limit, random);
    contract(graph, &partner)
}

/// Sorted heavy-edge matching (Karypis, Kumar 1998): vertices with few neighbours choose first, because later nothing may
/// be left to them. Vertices that are left alone are joined with another of the same neighbour, without which stars would
/// not coarsen.
fn matching(graph: &Graph, limit: i64, random: &mut Random) -> Vec<u32> {
    let n = graph.len();
    let mut sequence: Vec<u32> = (0..n as u32).collect();
    random.shuffle(&mut sequence);
    sequence.sort_by_key(|&v| graph.neighbours(v).len());
    let mut partner = vec![u32::MAX; n];
    for &v in &sequence {
        if partner[v as usize] != u32::MAX {
            continue;
        }
        let mut best = (0, v);
        for (u, edge) in graph.links(v) {
            if partner[u as usize] == u32::MAX && edge > best.0 && graph.weight(v) + graph.weight(u) <= limit
            {
                best = (edge, u);
            }
        }
        if best.0 > 0 {
            partner[v as usize] = best.1;
            partner[best.1 as usize] = v;
        }
    }
    let mut waiting = vec![u32::MAX; n];
    for &v in &sequence {
        if partner[v as usize] != u32::MAX {
            continue;
        }
        partner[v as usize] = v;
        let Some(&hub) = graph.neighbours(v).iter().max_by_key(|&&u| graph.neighbours(u).len()) else {
            continue;
        };
        let other = std::mem::replace(&mut waiting[hub as usize], v);
        if other != u32::MAX && graph.weight(v) + graph.weight(other) <= limit {
            partner[v as usize] = other;
            partner[other as usize] = v;
            waiting[hub as usize] = u32::MAX;
        }
    }
    partner
}

fn contract(graph: &Graph, partner: &[u32]) -> Coarse {
    let n = graph.len();
    let mut of = vec![u32::MAX; n];
    let mut count = 0;
    for v in 0..n {
        if of[v] == u32::MAX {
            of[v] = count;
            of[partner[v] as usize] = count;
            count += 1;
        }
    }
    let mut coarse = Graph::with_capacity(count as usize, graph.n_links());
    // where the coarse neighbour stands in the row at hand
    let mut place = vec![u32::MAX; count as usize];
    let mut row: Vec<(u32, u32)> = Vec::new();
    for v in 0..n {
        let u = partner[v] as usize;
        if u < v {
            continue;
        }
        row.clear();
        let mut take = |member: usize| {
            for (k, edge) in graph.links(member as u32) {
                let c = of[k as usize];
                if c == of[v] {
                    continue;
                }
                match place[c as usize] {
                    u32::MAX => {
                        place[c as usize] = row.len() as u32;
                        row.push((c, edge));
                    }
                    at => row[at as usize].1 += edge,
                }
            }
        };
        take(v);
        let mut weight = graph.weight(v as u32);
        if u != v {
            take(u);
            weight += graph.weight(u as u32);
        }
        row.iter().for_each(|&(c, _)| place[c as usize] = u32::MAX);
        coarse.push(weight as u32, row.iter().copied());
    }
    Coarse { graph: coarse, of }
}

#[cfg(test)]
mod tests {
    use super::super::graph::grid;
    use super::*;

    #[test]
    fn a_grid_is_halved_and_keeps_its_weight_and_links() {
        let graph = grid([8, 8, 8]);
        let coarse = coarsen(&graph, 2, &mut Random::new(1));
        assert!(coarse.graph.len() as f64 <= 0.6 * graph.len() as f64, "{}", coarse.graph.len());
        assert_eq!(coarse.graph.total(), graph.total());
        let across = (0..graph.len() as u32)
            .flat_map(|v| graph.neighbours(v).iter().map(move |&u| (v, u)))
            .filter(|&(v, u)| coarse.of[v as usize] != coarse.of[u as usize]);
        let links: u32 =
            (0..coarse.graph.len() as u32).flat_map(|v| coarse.graph.links(v)).map(|l| l.1).sum();
        assert_eq!(links as usize, across.count());
    }

    #[test]
    fn a_star_coarsens_too() {
        let n = 101;
        let mut star = Graph::with_capacity(n, 2 * n);
        star.push(1, (1..n as u32).map(|u| (u, 1)));
        (1..n).for_each(|_| star.push(1, [(0, 1)]));
        let coarse = coarsen(&star, 10, &mut Random::new(1));
        assert!(coarse.graph.len() < 60, "{}", coarse.graph.len());
    }
}
