//! Memory a factorisation takes, known from the symbolic factor, and memory the machine has left.

use crate::LinalgError;
use crate::symbolic::{Supernode, Symbolic};

/// Bytes of a real factorisation; a complex one takes twice the factor and the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Memory {
    /// Values of the factor.
    pub factor: usize,
    /// Updates that wait for their parents, at most, on all threads.
    pub work: usize,
    /// Index arrays of the symbolic factor, which exist already.
    pub index: usize,
}

impl Memory {
    /// Bytes that a numeric factorisation adds to what is in use, for values of `value_bytes` (8 real, 16 complex).
    pub fn numeric(&self, value_bytes: usize) -> usize {
        (self.factor + self.work).saturating_mul(value_bytes / 8)
    }

    pub(crate) fn of(symbolic: &Symbolic) -> Self {
        let work = work(symbolic, rayon::current_num_threads());
        Self { factor: 8 * symbolic.nnz(), work: 8 * work, index: symbolic.index_bytes() }
    }

    /// Refuses a factorisation that does not fit into what is free.
    ///
    /// # Errors
    /// [`LinalgError::Memory`].
    pub(crate) fn check(&self, value_bytes: usize, free: Option<usize>) -> Result<(), LinalgError> {
        let bytes = self.numeric(value_bytes);
        match free {
            Some(free) if bytes > free => Err(LinalgError::Memory { bytes, free: Some(free) }),
            _ => Ok(()),
        }
    }
}

/// Updates stand on two stacks, those of odd and of even depth: a parent writes to the one its children are not on.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Stacks {
    top: [usize; 2],
    /// Greatest height of both.
    pub(crate) peak: [usize; 2],
}

impl Stacks {
    /// Room for the update of a supernode whose children's have been used; returns its place.
    pub(crate) fn step(&mut self, symbolic: &Symbolic, node: &Supernode) -> usize {
        let side = usize::from(node.odd);
        let place = self.top[side];
        self.top[side] += square(node);
        self.peak[side] = self.peak[side].max(self.top[side]);
        let used: usize = node.children.iter().map(|&c| square(&symbolic.supernodes()[c as usize])).sum();
        self.top[1 - side] -= used;
        place
    }
}

/// Values of a supernode's update.
pub(crate) fn square(node: &Supernode) -> usize {
    node.below() * node.below()
}

/// Values of all updates of a subtree below its root, when one thread works through it.
pub(crate) fn stacks(symbolic: &Symbolic, root: usize) -> Stacks {
    let nodes = symbolic.supernodes();
    let mut stacks = Stacks::default();
    for node in &nodes[nodes[root].start as usize..root] {
        stacks.step(symbolic, node);
    }
    stacks
}

/// Most values that wait at one time on `threads` threads.
fn work(symbolic: &Symbolic, threads: usize) -> usize {
    let nodes = symbolic.supernodes();
    let mut peak = vec![0usize; nodes.len()];
    let together = |children: &[u32], peak: &[usize]| {
        let waiting: usize = children.iter().map(|&c| square(&nodes[c as usize])).sum();
        let mut extra: Vec<usize> =
            children.iter().map(|&c| peak[c as usize].saturating_sub(square(&nodes[c as usize]))).collect();
        extra.sort_unstable_by(|a, b| b.cmp(a));
        (waiting, waiting + extra.iter().take(threads).sum::<usize>())
    };
    let mut s = 0;
    let task_roots: Vec<bool> = {
        let mut marks = vec![false; nodes.len()];
        let mut mark = |c: u32| marks[c as usize] = true;
        symbolic.roots().iter().for_each(|&r| mark(r));
        nodes.iter().filter(|n| n.divided).for_each(|n| n.children.iter().for_each(|&c| mark(c)));
        marks
    };
    while s < nodes.len() {
        if task_roots[s] {
            let own = square(&nodes[s]);
            peak[s] = if nodes[s].divided {
                let (waiting, all) = together(&nodes[s].children, &peak);
                all.max(waiting + own)
            } else {
                stacks(symbolic, s).peak.iter().sum::<usize>() + own
            };
        }
        s += 1;
    }
    together(symbolic.roots(), &peak).1
}

/// Bytes the machine can still give to this process, the least of what is available, a container's limit and the process's
/// own limit of address space; `None` where the system does not say.
pub fn free() -> Option<usize> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let number = |path: &str| read(path).and_then(|text| text.trim().parse::<usize>().ok());
    let machine = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
        line.split_whitespace().nth(1)?.parse::<usize>().ok().map(|kib| kib.saturating_mul(1024))
    });
    // a container's own limit; page cache counted as used there can be given back, so only the limit itself is read
    let limit = number("/sys/fs/cgroup/memory.max");
    let own =
        read("/proc/self/limits").zip(read("/proc/self/status")).and_then(|(l, s)| address_space(&l, &s));
    [machine, limit, own].into_iter().flatten().min()
}

/// Bytes of address space that a process may still map (`ulimit -v`), from the texts of its `limits` and `status`.
fn address_space(limits: &str, status: &str) -> Option<usize> {
    let after =
        |text: &str, name: &str| text.lines().find_map(|line| line.strip_prefix(name).map(str::to_owned));
    let first = |text: String| text.split_whitespace().next()?.parse::<usize>().ok();
    let limit = first(after(limits, "Max address space")?)?;
    let mapped = first(after(status, "VmSize:")?)?;
    Some(limit.saturating_sub(mapped.saturating_mul(1024)))
}

/// Zeros, or the typed error where the allocator refuses.
pub(crate) fn zeros<T: Clone>(zero: T, len: usize) -> Result<Vec<T>, LinalgError> {
    let bytes = len.saturating_mul(size_of::<T>());
    // asked first because `vec!` aborts; `vec!` then, because it takes pages that are zero already
    let mut probe: Vec<T> = Vec::new();
    probe.try_reserve_exact(len).map_err(|_| LinalgError::Memory { bytes, free: free() })?;
    drop(probe);
    Ok(vec![zero; len])
}

/// `n` x `n` values, zero, of which the lower triangle will be used.
///
/// It is written here: where sums are the first to touch new pages, they read the system's page of zeros before they write
/// theirs, and every page that is exchanged so interrupts all other threads (a third of the time of two threads on a
/// solid).
///
/// # Errors
/// As [`zeros`].
pub(crate) fn lower_zeros<T: Copy>(zero: T, n: usize) -> Result<Vec<T>, LinalgError> {
    // behind the box, so that the writes are not taken for needless
    let mut values = std::hint::black_box(zeros(zero, n * n)?);
    for j in 0..n {
        values[j * (n + 1)..(j + 1) * n].fill(zero);
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_does_not_fit_with_both_numbers() {
        let memory = Memory { factor: 3_000_000_000, work: 1_000_000_000, index: 0 };
        assert_eq!(memory.check(8, Some(4_000_000_000)), Ok(()));
        assert_eq!(memory.check(8, None), Ok(()));
        let error = memory.check(16, Some(4_000_000_000)).unwrap_err();
        assert_eq!(error, LinalgError::Memory { bytes: 8_000_000_000, free: Some(4_000_000_000) });
        let text = error.to_string();
        assert!(text.contains("8.00 GB") && text.contains("4.00 GB are free"), "{text}");
    }

    #[test]
    fn a_limit_of_address_space_counts_less_what_is_mapped() {
        let limits = |soft: &str| {
            format!("Limit  Soft Limit  Hard Limit  Units\nMax address space  {soft}  unlimited  bytes\n")
        };
        let status = "Name:\tpython\nVmPeak:\t  900000 kB\nVmSize:\t  500000 kB\n";
        assert_eq!(address_space(&limits("2000000000"), status), Some(2_000_000_000 - 512_000_000));
        assert_eq!(address_space(&limits("100"), status), Some(0));
        assert_eq!(address_space(&limits("unlimited"), status), None);
        assert_eq!(address_space("", ""), None);
    }

    #[test]
    fn no_allocation_aborts() {
        assert!(matches!(zeros(0.0f64, usize::MAX / 16), Err(LinalgError::Memory { .. })));
    }
}
