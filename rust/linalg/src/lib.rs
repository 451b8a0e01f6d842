//! Sparse symmetric algebra: patterns, orderings, factorisations, solves and inertia.
