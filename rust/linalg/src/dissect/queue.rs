//! A priority queue of vertices whose keys change.

const ABSENT: u32 = u32::MAX;

/// Binary heap of vertices, largest key first, with the place of each vertex known. Of equal keys the one that was
/// inserted or changed last comes first.
#[derive(Debug, Clone)]
pub(crate) struct Queue {
    heap: Vec<(i64, u64, u32)>,
    place: Vec<u32>,
    clock: u64,
}

impl Queue {
    /// For vertices below `n`.
    pub(crate) fn new(n: usize) -> Self {
        Self { heap: Vec::new(), place: vec![ABSENT; n], clock: 0 }
    }

    pub(crate) fn clear(&mut self) {
        for &(.., v) in &self.heap {
            self.place[v as usize] = ABSENT;
        }
        self.heap.clear();
        self.clock = 0;
    }

    /// The largest key and its vertex.
    pub(crate) fn top(&self) -> Option<(i64, u32)> {
        self.heap.first().map(|&(key, _, v)| (key, v))
    }

    pub(crate) fn pop(&mut self) -> Option<(i64, u32)> {
        let top = self.top()?;
        self.remove(top.1);
        Some(top)
    }

    pub(crate) fn contains(&self, v: u32) -> bool {
        self.place[v as usize] != ABSENT
    }

    /// Inserts a vertex or gives it another key.
    pub(crate) fn set(&mut self, v: u32, key: i64) {
        self.clock += 1;
        let item = (key, self.clock, v);
        match self.place[v as usize] {
            ABSENT => {
                self.heap.push(item);
                self.rise(self.heap.len() - 1);
            }
            k => {
                self.heap[k as usize] = item;
                self.settle(k as usize);
            }
        }
    }

    /// Adds to the key of a vertex, if it is in the queue.
    pub(crate) fn add(&mut self, v: u32, change: i64) {
        if self.contains(v) {
            let key = self.heap[self.place[v as usize] as usize].0;
            self.set(v, key + change);
        }
    }

    /// Removes a vertex, if it is in the queue.
    pub(crate) fn remove(&mut self, v: u32) {
        let k = self.place[v as usize];
        if k == ABSENT {
            return;
        }
        self.place[v as usize] = ABSENT;
        let Some(last) = self.heap.pop() else { return };
        if (k as usize) < self.heap.len() {
            self.heap[k as usize] = last;
            self.settle(k as usize);
        }
    }

    fn settle(&mut self, k: usize) {
        if k > 0 && self.heap[(k - 1) / 2] < self.heap[k] { self.rise(k) } else { self.sink(k) }
    }

    fn rise(&mut self, mut k: usize) {
        let item = self.heap[k];
        while k > 0 && self.heap[(k - 1) / 2] < item {
            self.put(k, self.heap[(k - 1) / 2]);
            k = (k - 1) / 2;
        }
        self.put(k, item);
    }

    fn sink(&mut self, mut k: usize) {
        let item = self.heap[k];
        loop {
            let mut child = 2 * k + 1;
            if child + 1 < self.heap.len() && self.heap[child] < self.heap[child + 1] {
                child += 1;
            }
            if child >= self.heap.len() || self.heap[child] < item {
                break;
            }
            self.put(k, self.heap[child]);
            k = child;
        }
        self.put(k, item);
    }

    fn put(&mut self, k: usize, item: (i64, u64, u32)) {
        self.place[item.2 as usize] = k as u32;
        self.heap[k] = item;
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn vertices_leave_by_their_latest_keys() {
        let mut random = Random::new(7);
        let mut queue = Queue::new(50);
        let mut keys = [None; 50];
        for _ in 0..5000 {
            let (v, key) = (random.below(50), random.below(40) as i64);
            match random.below(4) {
                0 => {
                    queue.remove(v as u32);
                    keys[v] = None;
                }
                1 => {
                    queue.add(v as u32, key - 20);
                    keys[v] = keys[v].map(|k| k + key - 20);
                }
                2 => {
                    queue.set(v as u32, key);
                    keys[v] = Some(key);
                }
                _ => {
                    assert_eq!(queue.top().map(|t| t.0), keys.iter().copied().flatten().max());
                    if let Some((key, v)) = queue.pop() {
                        assert_eq!(keys[v as usize].take(), Some(key));
                    }
                }
            }
        }
        queue.clear();
        assert!(queue.top().is_none() && (0..50).all(|v| !queue.contains(v)));
    }
}
