//! Frequency response functions by direct solution of the dynamic stiffness on each line.

use std::sync::Arc;

use femend_linalg::{ComplexFactor, Dense, Ordering, Symbolic, SymmetricCsc};
use num_complex::Complex64;
use rayon::prelude::*;

use super::FrfKind;
use crate::DynamicsError;

/// Matrices of the direct dynamic stiffness Z(s) = K + i H + s C + s² M on one pattern.
#[derive(Debug, Clone, Copy)]
pub struct DirectModel<'a> {
    /// Stiffness.
    pub k: &'a SymmetricCsc,
    /// Mass.
    pub m: &'a SymmetricCsc,
    /// Viscous damping.
    pub c: Option<&'a SymmetricCsc>,
    /// Structural damping (imaginary part of the stiffness for Im s > 0).
    pub h: Option<&'a SymmetricCsc>,
}

impl DirectModel<'_> {
    /// Values of Z(s).
    fn values(&self, s: Complex64) -> Vec<Complex64> {
        let mut z: Vec<Complex64> =
            self.k.values().iter().zip(self.m.values()).map(|(&k, &m)| k + s * s * m).collect();
        if let Some(c) = self.c {
            z.iter_mut().zip(c.values()).for_each(|(z, &c)| *z += s * c);
        }
        if let Some(h) = self.h {
            z.iter_mut().zip(h.values()).for_each(|(z, &h)| *z += Complex64::new(0.0, h));
        }
        z
    }

    /// X(s) = Z(s)⁻¹ B for each line: a list of (n, k) column-major blocks.
    ///
    /// # Errors
    /// [`DynamicsError::Linalg`] where Z(s) is singular, [`DynamicsError::Argument`] for unequal patterns.
    pub fn responses<T: Send>(
        &self,
        b: &Dense,
        s: &[Complex64],
        use_line: impl Fn(Complex64, &[Complex64]) -> T + Sync,
    ) -> Result<Vec<T>, DynamicsError> {
        let same = |a: &SymmetricCsc| a.pattern() == self.k.pattern();
        if !(same(self.m) && self.c.is_none_or(same) && self.h.is_none_or(same)) {
            return Err(DynamicsError::Argument("K, M, C and H do not share one pattern".into()));
        }
        let symbolic = Arc::new(Symbolic::new(self.k.pattern().clone(), Ordering::Auto)?);
        let rhs: Vec<Complex64> = b.data().iter().map(|&v| Complex64::from(v)).collect();
        s.par_iter()
            .map_init(
                || None,
                |kept: &mut Option<ComplexFactor>, &s| {
                    let factor = match kept.take() {
                        Some(mut factor) => factor.refresh(&self.values(s)).map(|()| factor),
                        None => ComplexFactor::new(symbolic.clone(), &self.values(s)),
                    };
                    let mut x = rhs.clone();
                    kept.insert(factor?).solve_in_place(&mut x);
                    Ok(use_line(s, &x))
                },
            )
            .collect()
    }

    /// FRFs B_outᵀ Z(s)⁻¹ B_in, (n_lines, n_out, n_in) with the last axis fastest; `b_out` (n, n_out), `b_in` (n, n_in).
    ///
    /// # Errors
    /// As [`DirectModel::responses`].
    pub fn frf(
        &self,
        b_out: &Dense,
        b_in: &Dense,
        s: &[Complex64],
        kind: FrfKind,
    ) -> Result<Vec<Complex64>, DynamicsError> {
        let n = self.k.n();
        let lines = self.responses(b_in, s, |s, x| {
            let factor = kind.factor(s);
            let mut line = Vec::with_capacity(b_out.ncols() * b_in.ncols());
            for o in 0..b_out.ncols() {
                for x in x.chunks_exact(n) {
                    let sum: Complex64 = b_out.col(o).iter().zip(x).map(|(&b, &x)| b * x).sum();
                    line.push(factor * sum);
                }
            }
            line
        })?;
        Ok(lines.concat())
    }
}
