//! First separators: one side grown from a vertex.

use super::graph::Graph;
use super::queue::Queue;
use super::random::Random;
use super::refine::refine;
use super::split::{LARGEST_SIDE, SEPARATOR, Split, score};

/// Never in this growth.
const NEVER: u32 = u32::MAX;

/// The best refined separator of several growths from random vertices. The graph must have a vertex.
pub(crate) fn first_split(graph: &Graph, growths: usize, random: &mut Random) -> Split {
    let mut best = grown(graph, random.below(graph.len()) as u32);
    refine(graph, &mut best);
    for _ in 1..growths.min(graph.len()) {
        let mut split = grown(graph, random.below(graph.len()) as u32);
        refine(graph, &mut split);
        if split.score() < best.score() {
            best = split;
        }
    }
    best
}

/// Grows side 0 from a vertex, always by the vertex of the front that lengthens the front least, and keeps the best moment.
fn grown(graph: &Graph, seed: u32) -> Split {
    let n = graph.len();
    // the growth when a vertex came into the front, and when it came into side 0
    let (mut front, mut inside) = (vec![NEVER; n], vec![NEVER; n]);
    let mut weights = [0, graph.total() - graph.weight(seed), graph.weight(seed)];
    let limit = (LARGEST_SIDE * graph.total() as f64) as i64;
    front[seed as usize] = 0;
    let mut queue = Queue::new(n);
    queue.set(seed, 0);
    let (mut best, mut kept) = (score(weights), 0);
    let (mut time, mut rest) = (0, 0);
    loop {
        let v = match queue.pop() {
            Some((_, v)) => v,
            // another part of a graph that is not connected
            None => {
                while rest < n && front[rest] != NEVER {
                    rest += 1;
                }
                if rest == n {
                    break;
                }
                let v = rest as u32;
                front[rest] = time;
                (weights[1], weights[2]) = (weights[1] - graph.weight(v), weights[2] + graph.weight(v));
                v
            }
        };
        time += 1;
        inside[v as usize] = time;
        (weights[0], weights[2]) = (weights[0] + graph.weight(v), weights[2] - graph.weight(v));
        for &u in graph.neighbours(v) {
            if front[u as usize] != NEVER {
                continue;
            }
            front[u as usize] = time;
            (weights[1], weights[2]) = (weights[1] - graph.weight(u), weights[2] + graph.weight(u));
            let mut fresh = 0;
            for &k in graph.neighbours(u) {
                match front[k as usize] {
                    NEVER => fresh += graph.weight(k),
                    _ if inside[k as usize] == NEVER => queue.add(k, graph.weight(u)),
                    _ => {}
                }
            }
            queue.set(u, graph.weight(u) - fresh);
        }
        let now = score(weights);
        if now < best {
            (best, kept) = (now, time);
        }
        if weights[0] > limit {
            break;
        }
    }
    let part = (0..n).map(|v| match (front[v], inside[v]) {
        (_, i) if i <= kept => 0,
        (f, _) if f <= kept => SEPARATOR,
        _ => 1,
    });
    Split::new(graph, part.collect())
}
