//! Forward-mode differentiation: a law is written once over [`Scalar`], its derivatives are exact by construction.

#![allow(clippy::suspicious_arithmetic_impl)] // product and quotient rules mix operators

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number a law can be evaluated in: `f64`, or `f64` carrying `N` derivatives.
pub trait Scalar:
    Copy
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// Number of derivatives it carries.
    const CARRIES: usize;
    /// A constant: all derivatives zero.
    fn constant(value: f64) -> Self;
    /// The value without derivatives.
    fn value(self) -> f64;
    /// exp(x).
    fn exp(self) -> Self;
    /// Natural logarithm of a positive number.
    fn ln(self) -> Self;
    /// A function of x given by its value and its slope there.
    fn apply(self, value: f64, slope: f64) -> Self;

    /// |x|; the derivative at 0 is taken from the positive side.
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// |x|^n for n > 0, with 0^n = 0 and vanishing derivatives there (right for n > 1, a one-sided choice for n = 1).
    fn abs_pow(self, n: Self) -> Self {
        if self.value() == 0.0 { Self::constant(0.0) } else { (n * self.abs().ln()).exp() }
    }
}

impl Scalar for f64 {
    const CARRIES: usize = 0;
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    #[inline(always)]
    fn apply(self, value: f64, _slope: f64) -> Self {
        value
    }
}

/// A value and its derivatives with respect to `N` seeded variables.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// Derivatives with respect to the seeds.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A variable: derivative one with respect to seed `index`.
    #[inline(always)]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut eps = [0.0; N];
        eps[index] = 1.0;
        Self { re: value, eps }
    }

    #[inline(always)]
    fn chain(self, re: f64, slope: f64) -> Self {
        Self { re, eps: self.eps.map(|e| e * slope) }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const CARRIES: usize = N;
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { re: value, eps: [0.0; N] }
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self.re
    }
    fn exp(self) -> Self {
        let re = self.re.exp();
        self.chain(re, re)
    }
    fn ln(self) -> Self {
        self.chain(self.re.ln(), 1.0 / self.re)
    }
    #[inline(always)]
    fn apply(self, value: f64, slope: f64) -> Self {
        self.chain(value, slope)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.re, -1.0)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, eps: std::array::from_fn(|i| self.eps[i] + other.eps[i]) }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, eps: std::array::from_fn(|i| self.eps[i] - other.eps[i]) }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            re: self.re * other.re,
            eps: std::array::from_fn(|i| self.eps[i] * other.re + self.re * other.eps[i]),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let re = self.re / other.re;
        Self { re, eps: std::array::from_fn(|i| (self.eps[i] - re * other.eps[i]) / other.re) }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { re: self.re + other, eps: self.eps }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self { re: self.re - other, eps: self.eps }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.re * other, other)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        self.chain(self.re / other, 1.0 / other)
    }
}
