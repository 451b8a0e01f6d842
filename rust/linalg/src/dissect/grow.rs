//! First separators: one side grown from a vertex.

use super::graph::Graph;
use super::queue::Queue;
use super::random::Random;
use super::refine::refine;
use super::split::{LARGEST_SIDE, SEPARATOR, Split, score};

/// Not yet in this growth.
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
    let limit = (LARGEST_SIDE * graph.total() as f64) as i64;
    let mut growth = Growth::new(graph);
    let mut queue = Queue::new(graph.len());
    growth.reach(seed);
    queue.set(seed, 0);
    let (mut best, mut kept) = (score(growth.weights), 0);
    while let Some(v) = queue.pop().map(|(_, v)| v).or_else(|| growth.elsewhere()) {
        growth.take(v);
        for &u in graph.neighbours(v) {
            if growth.reached(u) {
                continue;
            }
            growth.reach(u);
            let mut fresh = 0;
            for &k in graph.neighbours(u) {
                if !growth.reached(k) {
                    fresh += graph.weight(k);
                } else if !growth.taken(k) {
                    queue.add(k, graph.weight(u));
                }
            }
            queue.set(u, graph.weight(u) - fresh);
        }
        let now = score(growth.weights);
        if now < best {
            (best, kept) = (now, growth.time);
        }
        if growth.weights[0] > limit {
            break;
        }
    }
    growth.split_at(kept)
}

/// Side 0 while it grows, with the front around it.
struct Growth<'a> {
    graph: &'a Graph,
    /// Vertices in side 0.
    time: u32,
    /// The time when a vertex came into the front, and when it came into side 0.
    front: Vec<u32>,
    inside: Vec<u32>,
    /// Of side 0, of the rest, of the front.
    weights: [i64; 3],
    /// All vertices before it have been reached.
    rest: usize,
}

impl<'a> Growth<'a> {
    fn new(graph: &'a Graph) -> Self {
        let never = vec![NEVER; graph.len()];
        Self { graph, time: 0, front: never.clone(), inside: never, weights: [0, graph.total(), 0], rest: 0 }
    }

    /// Is the vertex in the front or in side 0?
    fn reached(&self, v: u32) -> bool {
        self.front[v as usize] != NEVER
    }

    /// Is the vertex in side 0?
    fn taken(&self, v: u32) -> bool {
        self.inside[v as usize] != NEVER
    }

    /// Takes a vertex from the rest into the front.
    fn reach(&mut self, v: u32) {
        let weight = self.graph.weight(v);
        self.front[v as usize] = self.time;
        self.weights[1] -= weight;
        self.weights[2] += weight;
    }

    /// Takes a vertex from the front into side 0.
    fn take(&mut self, v: u32) {
        let weight = self.graph.weight(v);
        self.time += 1;
        self.inside[v as usize] = self.time;
        self.weights[2] -= weight;
        self.weights[0] += weight;
    }

    /// Begins again in another part of a graph that is not connected.
    fn elsewhere(&mut self) -> Option<u32> {
        while self.front.get(self.rest).is_some_and(|&time| time != NEVER) {
            self.rest += 1;
        }
        if self.rest == self.graph.len() {
            return None;
        }
        let v = self.rest as u32;
        self.reach(v);
        Some(v)
    }

    /// Side 0 and its front as they were at `time`.
    fn split_at(&self, time: u32) -> Split {
        let part = self.front.iter().zip(&self.inside).map(|(&front, &inside)| match (front, inside) {
            (_, i) if i <= time => 0,
            (f, _) if f <= time => SEPARATOR,
            _ => 1,
        });
        Split::new(self.graph, part.collect())
    }
}
