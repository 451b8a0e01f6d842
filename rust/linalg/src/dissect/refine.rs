//! Refinement of separators by moves of single vertices (Fiduccia, Mattheyses 1982, on vertices instead of edges).

use super::graph::Graph;
use super::queue::Queue;
use super::split::{LARGEST_SIDE, SEPARATOR, Split};

/// Passes over the separator at most; each goes on from the best of the one before.
const PASSES: usize = 10;

/// Moves in a row that may fail to find a better split before a pass ends.
const PATIENCE: usize = 300;

/// A move out of the separator and how many vertices it drew in from the other side.
struct Move {
    vertex: u32,
    to: u8,
    drawn: usize,
}

/// Queues and marks, kept from pass to pass.
struct Refiner<'a> {
    graph: &'a Graph,
    /// Vertices of the separator by what a move to side 0 or 1 takes off the separator.
    queues: [Queue; 2],
    /// Vertices moved out of the separator in this pass: they stay where they are.
    moved: Vec<bool>,
    /// Vertices drawn into the separator in this pass: they may go on only.
    drawn: Vec<u32>,
    moves: Vec<Move>,
}

/// Moves vertices while the split gets better.
pub(crate) fn refine(graph: &Graph, split: &mut Split) {
    let mut refiner = Refiner::new(graph);
    for pass in 0..PASSES {
        if !refiner.pass(split, pass % 2 == 1) {
            break;
        }
    }
}

impl<'a> Refiner<'a> {
    fn new(graph: &'a Graph) -> Self {
        let n = graph.len();
        let queues = [Queue::new(n), Queue::new(n)];
        Self { graph, queues, moved: vec![false; n], drawn: vec![], moves: vec![] }
    }

    /// What a move of a vertex of the separator to a side takes off the separator.
    fn gain(&self, split: &Split, v: u32, to: u8) -> i64 {
        let other = 1 - to;
        let across = self.graph.neighbours(v).iter().filter(|&&u| split.part[u as usize] == other);
        self.graph.weight(v) - across.map(|&u| self.graph.weight(u)).sum::<i64>()
    }

    /// One pass; whether the split is better after it.
    fn pass(&mut self, split: &mut Split, prefer_one: bool) -> bool {
        self.queues.iter_mut().for_each(Queue::clear);
        self.moves.clear();
        self.drawn.clear();
        let members: Vec<u32> = split.members(SEPARATOR);
        let patience = PATIENCE.min(5 * members.len() + 20);
        for &v in &members {
            for to in [0, 1] {
                let gain = self.gain(split, v, to);
                self.queues[to as usize].set(v, gain);
            }
        }
        let (mut best, mut kept) = (split.score(), 0);
        while let Some((v, to)) = self.choose(split, prefer_one) {
            self.apply(split, v, to);
            let now = split.score();
            if now < best {
                (best, kept) = (now, self.moves.len());
            } else if self.moves.len() - kept > patience {
                break;
            }
        }
        self.moves.iter().for_each(|m| self.moved[m.vertex as usize] = false);
        self.undo(split, kept);
        kept > 0
    }

    /// The next move: the better of the two sides' best that keeps the balance.
    fn choose(&self, split: &Split, prefer_one: bool) -> Option<(u32, u8)> {
        let limit = (LARGEST_SIDE * split.weights.iter().sum::<i64>() as f64) as i64;
        let candidate = |to: usize| {
            let (gain, v) = self.queues[to].top()?;
            let after = split.weights[to] + self.graph.weight(v);
            // towards the lighter side every move is allowed, or an unbalanced start could not be mended
            (after <= limit || split.weights[to] <= split.weights[1 - to]).then_some((gain, v, to as u8))
        };
        match (candidate(0), candidate(1)) {
            (Some(a), Some(b)) => {
                let second = b.0 > a.0 || (b.0 == a.0 && prefer_one);
                Some(if second { (b.1, b.2) } else { (a.1, a.2) })
            }
            (a, b) => a.or(b).map(|c| (c.1, c.2)),
        }
    }

    fn apply(&mut self, split: &mut Split, v: u32, to: u8) {
        let other = 1 - to;
        let weight = self.graph.weight(v);
        self.queues.iter_mut().for_each(|q| q.remove(v));
        split.part[v as usize] = to;
        split.weights[SEPARATOR as usize] -= weight;
        split.weights[to as usize] += weight;
        self.moved[v as usize] = true;
        let first = self.drawn.len();
        for &u in self.graph.neighbours(v) {
            match split.part[u as usize] {
                SEPARATOR => self.queues[other as usize].add(u, -weight),
                p if p == other => self.draw(split, u, to),
                _ => {}
            }
        }
        self.moves.push(Move { vertex: v, to, drawn: self.drawn.len() - first });
    }

    /// Takes a vertex of the side opposite to `to` into the separator.
    fn draw(&mut self, split: &mut Split, u: u32, to: u8) {
        let weight = self.graph.weight(u);
        split.part[u as usize] = SEPARATOR;
        split.weights[1 - to as usize] -= weight;
        split.weights[SEPARATOR as usize] += weight;
        self.drawn.push(u);
        for &k in self.graph.neighbours(u) {
            if split.part[k as usize] == SEPARATOR {
                self.queues[to as usize].add(k, weight);
            }
        }
        if !self.moved[u as usize] {
            let gain = self.gain(split, u, to);
            self.queues[to as usize].set(u, gain);
        }
    }

    /// Takes back all moves after the first `kept`.
    fn undo(&mut self, split: &mut Split, kept: usize) {
        while self.moves.len() > kept {
            let Some(Move { vertex, to, drawn }) = self.moves.pop() else { return };
            let weight = self.graph.weight(vertex);
            split.part[vertex as usize] = SEPARATOR;
            split.weights[to as usize] -= weight;
            split.weights[SEPARATOR as usize] += weight;
            for u in self.drawn.drain(self.drawn.len() - drawn..) {
                let weight = self.graph.weight(u);
                split.part[u as usize] = 1 - to;
                split.weights[1 - to as usize] += weight;
                split.weights[SEPARATOR as usize] -= weight;
            }
        }
    }
}
