//! Stress stiffness of beams and rods from their axial force.
//!
//! Beam: `P int (v'² + w'² + (I1 + I2) / A theta_x'²) dx` with the deflections of the neutral axis and the shape functions
//! of the mass matrix (Przemieniecki 1968, §15.2, eq. 15.30 without shear). End moments, torque and shear forces are
//! left out. Rod: `P / L` on the motion across it (§15.1).

use super::beam::{BeamElement, GAUSS4, congruence_full};
use super::rod::RodElement;
use crate::parameter::{Factors, Quantity};
use crate::small::{Mat, rigid};

impl BeamElement {
    /// Stress stiffness in basic axes of the axial force that nodal displacements `u` (basic axes) make.
    #[must_use]
    pub fn stress_stiffness(&self, f: &Factors<f64>, u: &[f64]) -> Option<Mat<f64>> {
        let (k, release) = self.released(self.stiffness(f))?;
        let q: Vec<f64> = (0..12).map(|i| (0..12).map(|j| self.map[(i, j)] * u[j]).sum()).collect();
        let force: f64 = (0..12).map(|j| k[(6, j)] * q[j]).sum();
        let l = self.length;
        let el = f.elastic(0, &self.material);
        let phi = self.shear_ratios(&self.station(f, 0.5), el.e, el.g);
        let mut out = Mat::zeros(12, 12);
        for (x, w) in GAUSS4 {
            let s = self.station(f, x);
            let v = slopes(x, l, phi[0], [1, 5, 7, 11], 1.0);
            let z = slopes(x, l, phi[1], [2, 4, 8, 10], -1.0);
            let mut twist = [0.0; 12];
            (twist[3], twist[9]) = (-1.0 / l, 1.0 / l);
            let wl = force * w * l;
            out.add_outer(wl, &v, &v);
            out.add_outer(wl, &z, &z);
            if s.a > 0.0 {
                out.add_outer(wl * (s.i1 + s.i2) / s.a, &twist, &twist);
            }
        }
        let mut arms = Mat::zeros(12, 12);
        for (end, section) in self.sections.iter().enumerate() {
            let part = rigid([0.0, section.neutral_axis[0], section.neutral_axis[1]]);
            for i in 0..6 {
                for j in 0..6 {
                    arms[(6 * end + i, 6 * end + j)] = part[(i, j)];
                }
            }
        }
        out = out.congruence(&arms);
        if let Some(t) = release {
            out = congruence_full(&out, &t);
        }
        Some(out.congruence(&self.map))
    }
}

/// Derivative of the deflection along the beam; arguments as of the shape functions.
fn slopes(x: f64, l: f64, phi: f64, rows: [usize; 4], sign: f64) -> [f64; 12] {
    let bow = 6.0 * (x * x - x);
    let n = [
        (bow - phi) / l,
        (1.0 - 4.0 * x + 3.0 * x * x + phi * (0.5 - x)) * sign,
        (phi - bow) / l,
        (3.0 * x * x - 2.0 * x - phi * (0.5 - x)) * sign,
    ];
    let mut out = [0.0; 12];
    for (row, value) in rows.into_iter().zip(n) {
        out[row] = value / (1.0 + phi);
    }
    out
}

impl RodElement {
    /// Stress stiffness in basic axes of the axial force that nodal displacements `u` (basic axes) make.
    #[must_use]
    pub fn stress_stiffness(&self, f: &Factors<f64>, u: &[f64]) -> Option<Mat<f64>> {
        let w = self.width;
        let area = f.of(Quantity::A) * self.section.a;
        let stretch: f64 = (0..3).map(|c| self.axis[c] * (u[w + c] - u[c])).sum();
        let tension = f.elastic(0, &self.material).e * area / self.length * stretch;
        let mut across = Mat::zeros(3, 2 * w);
        for i in 0..3 {
            for j in 0..3 {
                let value = f64::from(u8::from(i == j)) - self.axis[i] * self.axis[j];
                across[(i, j)] = -value;
                across[(i, w + j)] = value;
            }
        }
        let mut k = Mat::zeros(3, 3);
        for i in 0..3 {
            k[(i, i)] = tension / self.length;
        }
        Some(k.congruence(&across))
    }
}
