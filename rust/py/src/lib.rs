//! `_core`: read-only arrays in, interpreter lock released, one call, arrays out. No algorithms here.

use pyo3::prelude::*;

mod arrays;
mod complex;
mod deck;
mod diagnose;
mod free_force;
mod frf;
mod harmonic;
mod laws;
mod model;
mod modes;
mod moved;
mod own_law;
mod pair_costs;
mod sensitivity;
mod simulate;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    deck::register(module)?;
    model::register(module)?;
    moved::register(module)?;
    modes::register(module)?;
    complex::register(module)?;
    frf::register(module)?;
    free_force::register(module)?;
    pair_costs::register(module)?;
    sensitivity::register(module)?;
    laws::register(module)?;
    simulate::register(module)?;
    harmonic::register(module)?;
    own_law::register(module)?;
    diagnose::register(module)
}
