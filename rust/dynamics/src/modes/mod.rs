//! Real normal modes K φ = λ M φ: the lowest, or all of a band, with a proof that none is missing.
//!
//! K symmetric positive semi-definite (free structures allowed), M symmetric positive semi-definite (massless DOFs
//! allowed). The method is block Lanczos on (K - σM)⁻¹ M in the M inner product (Grimes, Lewis, Simon 1994) with full
//! reorthogonalisation; the count of modes below the upper end comes from the inertia of K - σM (Sylvester's law).

mod basis;
mod finish;
mod goal;
mod lanczos;
mod mass;
mod need;
mod options;
mod product;
mod rounding;
mod shift;
mod small;
mod solve;
mod upper;

pub use need::ModesMemory;
pub use options::ModeOptions;
pub use solve::{Modes, ModesInfo, modes};

pub(crate) use basis::{Basis, norms};
pub(crate) use product::Compact;
pub(crate) use shift::{Shifted, static_shift};
pub(crate) use solve::modes_and_factor;
pub(crate) use upper::count_below;
