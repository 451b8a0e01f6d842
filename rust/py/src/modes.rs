use pyo3::prelude::*;

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(_module: &Bound<'_, PyModule>) -> PyResult<()> {
    Ok(())
}
