//! Complex modes λ² M ψ + λ (C + W G) ψ + (K + W N + W² S + i D) ψ = 0 of large sparse models.
//!
//! The problem is projected on a real space V that holds the real modes of K and M (their number proved by inertia) and
//! grows by K_σ⁻¹ r, r = D(λ) ψ the residual of the full problem, right and left, K_σ = K - σM the one matrix that is
//! factorised (Davidson's method with Galerkin projection; Hochstenbach and van der Vorst 2003). The space serves any
//! number of speeds W. The columns of V are orthonormal in K_σ, so that the projected problem is near the unit matrix at
//! s₀ = √-σ, about which it is linearised; massless DOFs are then eigenvalues 1/(λ - s₀) = 0.

mod correction;
mod krylov;
mod probe;
mod projected;
mod response;
mod select;
mod solve;
mod space;
mod terms;
#[cfg(test)]
mod tests;

pub use solve::{ComplexModes, ComplexOptions, ComplexProblem, PoleKind};
pub use terms::{Power, Term};
