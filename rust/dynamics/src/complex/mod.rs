//! Complex modes λ² M ψ + λ (C + W G) ψ + (K + W N + W² S + i D) ψ = 0 of large sparse models.
//!
//! The problem is projected on a real space V: the second-order Krylov space of K_σ⁻¹ from random vectors, for a free model its
//! real modes. V grows until the residuals D(λ) ψ of the full problem are small, by the Krylov process and then by
//! corrections K_σ⁻¹ D(λ) ψ, right ones and left ones; K_σ = K - σM is the one matrix that is factorised, and the space
//! serves any number of speeds W. The columns of V are orthonormal in K_σ, so that the projected problem is near the unit
//! matrix at s₀ = √-σ, about which it is linearised; massless DOFs are then eigenvalues 1/(λ - s₀) = 0. The space has to hold
//! as many undamped modes at rest, up to the highest pole, as inertia counts.

mod begin;
mod coinciding;
mod correction;
mod found;
mod krylov;
mod options;
mod probe;
mod projected;
mod response;
mod select;
mod side;
mod solve;
mod space;
mod terms;
#[cfg(test)]
mod tests;

pub use found::ComplexModes;
pub use options::ComplexOptions;
pub use select::PoleKind;
pub use solve::ComplexProblem;
pub use terms::{Power, Term};
