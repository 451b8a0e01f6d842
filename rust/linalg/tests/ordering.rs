//! Orderings: permutations on every graph, few operations on grids.

use femend_linalg::{Ordering, Pattern, Permutation, order};
use proptest::prelude::*;

const KINDS: [Ordering; 4] = [Ordering::Auto, Ordering::Amd, Ordering::NestedDissection, Ordering::Natural];

fn is_permutation(found: &Permutation, n: usize) -> bool {
    let mut sorted = found.forward.clone();
    sorted.sort_unstable();
    sorted.len() == n
        && sorted.iter().enumerate().all(|(i, &v)| i == v as usize)
        && found.forward.iter().enumerate().all(|(i, &v)| found.inverse[v as usize] == i as u32)
}

fn check(name: &str, n: usize, entries: impl IntoIterator<Item = (usize, usize)>) {
    let pattern = Pattern::from_entries(n, entries).unwrap();
    for kind in KINDS {
        let found = order(&pattern, kind).unwrap();
        assert!(is_permutation(&found, n), "{name} {kind:?}");
        assert!(found.nnz >= n as f64 && found.flops >= found.nnz, "{name} {kind:?}");
    }
}

/// Grid of single DOFs, coupled to all within the box around them (`box_`) or through faces only.
fn grid(sides: [usize; 3], box_: bool) -> Pattern {
    let [a, b, c] = sides;
    let at = |x: usize, y: usize, z: usize| (x * b + y) * c + z;
    let mut entries = Vec::new();
    for (x, y, z) in (0..a * b * c).map(|k| (k / (b * c), k / c % b, k % c)) {
        for (u, v, w) in (0..8).map(|k| (x + k / 4, y + k / 2 % 2, z + k % 2)) {
            if u < a && v < b && w < c {
                entries.push((at(x, y, z), at(u, v, w)));
                if box_ {
                    // the other diagonals of the box between the two
                    entries.extend([
                        (at(u, y, z), at(x, v, w)),
                        (at(x, v, z), at(u, y, w)),
                        (at(x, y, w), at(u, v, z)),
                    ]);
                }
            }
        }
    }
    if !box_ {
        entries.retain(|&(i, j)| j == i + 1 || j == i + c || j == i + b * c);
    }
    Pattern::from_entries(a * b * c, entries).unwrap()
}

#[test]
fn degenerate_graphs_are_ordered() {
    let n = 2000;
    check("empty", 0, []);
    check("single", 1, []);
    check("diagonal", n, []);
    check("path", n, (1..n).map(|i| (i - 1, i)));
    check("star", n, (1..n).map(|i| (0, i)));
    check("complete", 300, (0..300).flat_map(|i| (0..i).map(move |j| (i, j))));
    check("complete bipartite", 900, (0..450).flat_map(|i| (450..900).map(move |j| (i, j))));
    check("duplicates", n, (0..5 * n).map(|k| (k % n, (k % n + 1) % n)));
    check("tree", n, (1..n).map(|i| (i, (i - 1) / 3)));
    check("stars on a path", n, (1..n).map(|i| (i, if i < 20 { i - 1 } else { i % 20 })));
    check("paths", n, (1..n).filter(|i| i % 70 != 0).map(|i| (i - 1, i)));
    check("cliques", n, (0..n).flat_map(|i| (i / 100 * 100..i).map(move |j| (i, j))));
    check(
        "cliques on a ring",
        n,
        (0..n).flat_map(|i| (i / 100 * 100..i).map(move |j| (i, j))).chain([(0, n - 1)]),
    );
}

#[test]
fn a_dense_node_costs_no_more_than_its_row() {
    let side = 50;
    let plain = grid([1, side, side], true);
    let n = plain.n();
    let entries = (0..n).flat_map(|j| plain.column(j).iter().map(move |&i| (i as usize, j)));
    let dense = Pattern::from_entries(n + 1, entries.chain((0..n).map(|i| (i, n)))).unwrap();
    for kind in [Ordering::Auto, Ordering::NestedDissection] {
        let (without, with) = (order(&plain, kind).unwrap(), order(&dense, kind).unwrap());
        assert!(is_permutation(&with, n + 1));
        assert!(with.nnz < 1.05 * (without.nnz + n as f64 + 1.0), "{kind:?}: {} {}", with.nnz, without.nnz);
    }
}

#[test]
fn orders_do_not_depend_on_threads() {
    let pattern = grid([14, 14, 14], true);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| order(&pattern, Ordering::NestedDissection).unwrap().forward)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn grids_take_about_as_many_operations_as_under_metis() {
    // the median of METIS 5.1 with seeds 0 to 4 on the same graphs, 10 % for the luck of one seed
    let cases = [
        ([20, 20, 20], true, 3.874e8),
        ([20, 20, 20], false, 1.99e8),
        ([1, 100, 100], true, 1.824e7),
        ([1, 100, 100], false, 9.997e6),
    ];
    for (sides, box_, metis) in cases {
        let found = order(&grid(sides, box_), Ordering::NestedDissection).unwrap();
        assert!(found.flops < 1.1 * metis, "{sides:?} {box_}: {:e} of {metis:e}", found.flops);
    }
}

#[test]
fn auto_is_the_cheapest() {
    for sides in [[12, 12, 12], [1, 40, 40], [3, 10, 60]] {
        let pattern = grid(sides, true);
        let flops = |kind| order(&pattern, kind).unwrap().flops;
        let auto = flops(Ordering::Auto);
        assert!(auto <= flops(Ordering::Amd) && auto <= flops(Ordering::NestedDissection));
    }
}

/// A plate of quadrilaterals with ribs on every tenth of its lines, `w` DOFs a node.
fn ribbed_plate(m: usize, w: usize) -> Pattern {
    const HIGH: usize = 6;
    let on_plate = |x: usize, y: usize| x * m + y;
    let in_rib = |x: usize, y: usize, z: usize| {
        if z == 0 { on_plate(x, y) } else { m * m + ((y / 10) * m + x) * HIGH + z - 1 }
    };
    let mut quads = Vec::new();
    for x in 0..m - 1 {
        for y in 0..m - 1 {
            quads.push([on_plate(x, y), on_plate(x + 1, y), on_plate(x, y + 1), on_plate(x + 1, y + 1)]);
        }
        for y in (0..m).step_by(10) {
            quads.extend((0..HIGH).map(|z| {
                [in_rib(x, y, z), in_rib(x + 1, y, z), in_rib(x, y, z + 1), in_rib(x + 1, y, z + 1)]
            }));
        }
    }
    let n = w * (m * m + m.div_ceil(10) * m * HIGH);
    let pairs = quads.iter().flat_map(|q| (0..16).map(|k| (q[k / 4], q[k % 4])));
    let entries = pairs.flat_map(|(i, j)| (0..w * w).map(move |k| (w * i + k / w, w * j + k % w)));
    Pattern::from_entries(n, entries).unwrap()
}

#[test]
fn further_numberings_make_minimum_degree_cheaper_on_shells() {
    let plate = ribbed_plate(90, 3);
    let flops = |kind| order(&plate, kind).unwrap().flops;
    let [once, dissection, auto] = [Ordering::Amd, Ordering::NestedDissection, Ordering::Auto].map(flops);
    assert!(auto < 0.97 * once.min(dissection), "{auto:e} beside {once:e} and {dissection:e}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn random_graphs_are_ordered(n in 1usize..900, pairs in prop::collection::vec((0usize..900, 0usize..900), 0..2500)) {
        let pattern = Pattern::from_entries(n, pairs.into_iter().map(|(i, j)| (i % n, j % n))).unwrap();
        for kind in KINDS {
            prop_assert!(is_permutation(&order(&pattern, kind).unwrap(), n));
        }
    }
}
