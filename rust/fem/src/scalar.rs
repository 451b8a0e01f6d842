//! Real numbers with or without a derivative: elements are written once and give K, M, C and their exact
//! derivatives with respect to a parameter (forward differentiation with dual numbers).

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// What an element's arithmetic needs of a number.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + Mul<f64, Output = Self>
    + 'static
{
    /// A constant.
    fn c(value: f64) -> Self;
    /// The value without its derivative.
    fn value(self) -> f64;
    /// Square root of a positive number.
    fn sqrt(self) -> Self;
    /// Is this exactly the constant zero (value and derivative)?
    fn is_zero(self) -> bool;
    /// Zero.
    fn zero() -> Self {
        Self::c(0.0)
    }
}

impl Scalar for f64 {
    fn c(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    fn is_zero(self) -> bool {
        self == 0.0
    }
}

/// A value `v` with its derivative `d` with respect to one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// Value.
    pub v: f64,
    /// Derivative.
    pub d: f64,
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, d: self.d + o.d }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self { v: self.v - o.v, d: self.d - o.d }
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { v: self.v * o.v, d: self.d * o.v + self.v * o.d }
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let v = self.v / o.v;
        Self { v, d: (self.d - v * o.d) / o.v }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self { v: -self.v, d: -self.d }
    }
}

impl AddAssign for Dual {
    fn add_assign(&mut self, o: Self) {
        self.v += o.v;
        self.d += o.d;
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, o: f64) -> Self {
        Self { v: self.v * o, d: self.d * o }
    }
}

impl Scalar for Dual {
    fn c(value: f64) -> Self {
        Self { v: value, d: 0.0 }
    }
    fn value(self) -> f64 {
        self.v
    }
    fn sqrt(self) -> Self {
        let v = self.v.sqrt();
        Self { v, d: 0.5 * self.d / v }
    }
    fn is_zero(self) -> bool {
        self.v == 0.0 && self.d == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotient_and_product_rule() {
        let x = Dual { v: 2.0, d: 1.0 };
        let y = (x * x * 3.0 + Dual::c(1.0)) / (x - Dual::c(5.0)); // (3x²+1)/(x-5)
        assert!((y.v + 13.0 / 3.0).abs() < 1e-15);
        let d = (6.0 * 2.0 * (2.0 - 5.0) - 13.0) / 9.0;
        assert!((y.d - d).abs() < 1e-15);
    }
}
