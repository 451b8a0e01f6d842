//! Derivatives of eigenvalues, shapes and FRFs with respect to parameters, from dK and dM on the model's pattern.

mod eigen;
mod frf;
mod shapes;

pub use eigen::{EigenSensitivities, ParameterDerivatives, clusters, eigen_sensitivities, project};
pub use frf::{DirectDerivative, ModalDerivatives, frf_direct_sensitivities};
pub use shapes::shape_sensitivities;

pub(crate) use eigen::check_parameters;
