//! Graphs with weights on vertices and edges, the form that dissection works on.

use std::ops::Range;

/// A symmetric graph in compressed rows, without loops and without repeated edges.
#[derive(Debug, Clone, Default)]
pub(crate) struct Graph {
    ptr: Vec<u32>,
    adj: Vec<u32>,
    edges: Vec<u32>,
    weights: Vec<u32>,
}

impl Graph {
    /// Takes compressed rows whose edges all weigh 1.
    pub(crate) fn new(ptr: Vec<u32>, adj: Vec<u32>, weights: Vec<u32>) -> Self {
        let edges = vec![1; adj.len()];
        Self { ptr, adj, edges, weights }
    }

    /// A graph without vertices, to which [`Graph::push`] adds.
    pub(crate) fn with_capacity(vertices: usize, edges: usize) -> Self {
        let mut ptr = Vec::with_capacity(vertices + 1);
        ptr.push(0);
        let (adj, edges) = (Vec::with_capacity(edges), Vec::with_capacity(edges));
        Self { ptr, adj, edges, weights: Vec::with_capacity(vertices) }
    }

    /// Adds a vertex with its neighbours and the weights of the edges to them.
    pub(crate) fn push(&mut self, weight: u32, row: impl IntoIterator<Item = (u32, u32)>) {
        for (neighbour, edge) in row {
            self.adj.push(neighbour);
            self.edges.push(edge);
        }
        self.ptr.push(self.adj.len() as u32);
        self.weights.push(weight);
    }

    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    fn range(&self, v: u32) -> Range<usize> {
        self.ptr[v as usize] as usize..self.ptr[v as usize + 1] as usize
    }

    pub(crate) fn neighbours(&self, v: u32) -> &[u32] {
        &self.adj[self.range(v)]
    }

    /// Neighbours with the weights of the edges to them.
    pub(crate) fn links(&self, v: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        let range = self.range(v);
        self.adj[range.clone()].iter().copied().zip(self.edges[range].iter().copied())
    }

    pub(crate) fn weight(&self, v: u32) -> i64 {
        i64::from(self.weights[v as usize])
    }

    pub(crate) fn total(&self) -> i64 {
        self.weights.iter().map(|&w| i64::from(w)).sum()
    }

    /// Edges, each counted from both ends.
    pub(crate) fn n_links(&self) -> usize {
        self.adj.len()
    }

    /// The subgraph on some vertices, edges of weight 1. `local` is scratch with [`u32::MAX`] for each vertex, and is left so.
    pub(crate) fn induced(&self, members: &[u32], local: &mut [u32]) -> Self {
        members.iter().enumerate().for_each(|(k, &v)| local[v as usize] = k as u32);
        let links = members.iter().map(|&v| self.neighbours(v).len()).sum();
        let mut graph = Self::with_capacity(members.len(), links);
        for &v in members {
            let row = self.neighbours(v).iter().map(|&u| local[u as usize]).filter(|&u| u != u32::MAX);
            graph.push(self.weights[v as usize], row.map(|u| (u, 1)));
        }
        members.iter().for_each(|&v| local[v as usize] = u32::MAX);
        graph
    }

    /// Connected parts, each with its vertices rising, in order of their first vertices.
    pub(crate) fn components(&self) -> Vec<Vec<u32>> {
        let mut of = vec![u32::MAX; self.len()];
        let mut count = 0;
        let mut stack = Vec::new();
        for v in 0..self.len() as u32 {
            if of[v as usize] != u32::MAX {
                continue;
            }
            of[v as usize] = count;
            stack.push(v);
            while let Some(u) = stack.pop() {
                for &k in self.neighbours(u) {
                    if of[k as usize] == u32::MAX {
                        of[k as usize] = count;
                        stack.push(k);
                    }
                }
            }
            count += 1;
        }
        let mut parts = vec![Vec::new(); count as usize];
        of.iter().enumerate().for_each(|(v, &c)| parts[c as usize].push(v as u32));
        parts
    }
}

/// Grid of vertices of weight 1, coupled through faces.
#[cfg(test)]
pub(crate) fn grid(sides: [usize; 3]) -> Graph {
    let [a, b, c] = sides.map(|s| s as u32);
    let mut graph = Graph::with_capacity(0, 0);
    for k in 0..a * b * c {
        let (x, y, z) = (k / (b * c), k / c % b, k % c);
        let near = [
            (x > 0).then(|| k - b * c),
            (x + 1 < a).then(|| k + b * c),
            (y > 0).then(|| k - c),
            (y + 1 < b).then(|| k + c),
            (z > 0).then(|| k - 1),
            (z + 1 < c).then(|| k + 1),
        ];
        graph.push(1, near.into_iter().flatten().map(|u| (u, 1)));
    }
    graph
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subgraphs_keep_what_lies_between_their_vertices() {
        let graph = grid([1, 3, 3]);
        let mut local = vec![u32::MAX; graph.len()];
        let part = graph.induced(&[0, 1, 2, 6, 7], &mut local);
        assert_eq!(part.components(), vec![vec![0, 1, 2], vec![3, 4]]);
        assert_eq!((part.total(), part.n_links()), (5, 6));
        assert!(local.iter().all(|&l| l == u32::MAX));
    }
}
