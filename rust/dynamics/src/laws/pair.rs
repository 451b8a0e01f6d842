//! Laws of two coordinates together: gyroscopic coupling.

use num_complex::Complex64;

/// Gyroscopic moments of a rotor with polar inertia `ip` (kg m^2) at `speed` (rad/s, right-handed about the axis) on the
/// two tilts (theta_x, theta_y) across its axis: f = G v with G = ip speed [[0, 1], [-1, 0]].
///
/// (Genta 2005, with moments resisting the motion positive.) Skew, so that v^T G v = 0: it does no work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyroscopic {
    /// Polar mass moment of inertia, kg m^2.
    pub ip: f64,
    /// Speed of rotation, rad/s.
    pub speed: f64,
}

impl Gyroscopic {
    /// Damping-like matrix G, N m s.
    pub fn matrix(&self) -> [[f64; 2]; 2] {
        let g = self.ip * self.speed;
        [[0.0, g], [-g, 0.0]]
    }

    /// Forces at velocities `v`.
    pub fn force(&self, v: [f64; 2]) -> [f64; 2] {
        let g = self.ip * self.speed;
        [g * v[1], -g * v[0]]
    }

    /// kappa(s) = s G and its derivative with respect to `ip`.
    pub fn dynamic_stiffness(&self, s: Complex64) -> ([[Complex64; 2]; 2], [[Complex64; 2]; 2]) {
        let over = self.speed * s;
        let unit = [[Complex64::default(), over], [-over, Complex64::default()]];
        (unit.map(|row| row.map(|x| x * self.ip)), unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gyroscopic_moments_do_no_work() {
        let law = Gyroscopic { ip: 0.04, speed: 310.0 };
        for v in [[0.3, -1.7], [2.0, 0.1]] {
            let f = law.force(v);
            assert!((f[0] * v[0] + f[1] * v[1]).abs() < 1e-15 * f[0].abs().max(f[1].abs()) * 2.0);
            let g = law.matrix();
            assert_eq!(f, [g[0][0] * v[0] + g[0][1] * v[1], g[1][0] * v[0] + g[1][1] * v[1]]);
        }
    }

    #[test]
    fn its_derivative_is_its_difference() {
        let (law, s, h) = (Gyroscopic { ip: 0.04, speed: 310.0 }, Complex64::new(-2.0, 90.0), 1e-6);
        let at = |ip: f64| Gyroscopic { ip, ..law }.dynamic_stiffness(s).0;
        let (_, slope) = law.dynamic_stiffness(s);
        for i in 0..2 {
            for j in 0..2 {
                let difference = (at(law.ip + h)[i][j] - at(law.ip - h)[i][j]) / (2.0 * h);
                assert!((difference - slope[i][j]).norm() <= 1e-8 * 310.0 * s.norm());
            }
        }
    }
}
