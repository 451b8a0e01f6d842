//! Modes, FRFs, sensitivities, local laws and the response of a model with a law attached.

pub mod laws;
pub mod oscillator;
pub mod simulate;
