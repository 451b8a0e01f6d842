//! Sparse symmetric algebra: patterns, orderings, factorisations, solves and inertia.
//!
//! The only crate of the workspace that names the linear-algebra library underneath. Every kernel of that library is
//! called sequentially; the parallelism (blocks of right-hand sides, row chunks) is in this crate, with fixed chunk sizes,
//! so that results do not depend on the number of threads. Each factor is probed by a known solution.

mod complex;
mod dense;
mod dissect;
mod error;
mod factor;
mod front;
mod general;
mod join;
mod lanes;
mod memory;
mod nodes;
mod numbering;
mod numeric;
mod order;
mod pattern;
mod pivot;
mod rows;
mod scalar;
mod skinny;
mod solve;
mod spare;
mod sparse;
mod symbolic;
mod tree;

pub use complex::ComplexFactor;
pub use dense::{Dense, SymmetricEigen, gemm, gemm_tn, gram, solve_complex_dense};
pub use error::LinalgError;
pub use factor::{Factor, Inertia, Kind, PIVOT_TOLERANCE, PROBE_TOLERANCE, ZeroPivot};
pub use general::{GeneralEigen, general_eigen, general_eigen_complex};
pub use lanes::Eight;
pub use memory::{Memory, free as free_memory};
pub use order::{Ordering, Permutation, order};
pub use pattern::Pattern;
pub use rows::SparseRows;
pub use spare::Spare;
pub use sparse::SymmetricCsc;
pub use symbolic::Symbolic;
