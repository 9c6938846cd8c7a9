//! The scalar types over which a model is evaluated.
//!
//! Equations of motion and effects are written once over [`Scalar`]. They then run with:
//!
//! * `f64` for one run,
//! * [`Lanes`] for several runs in lock-step,
//! * [`Dual`] for exact derivatives,
//! * `Dual<Lanes<L>, N>` for several runs with derivatives.
//!
//! The derivatives of a [`DualNumber`] are stored in an array ([`Dual`]) or in one vector register,
//! see [`Partials`].

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

mod dual;
mod elementary;
mod lanes;
mod partials;
mod register;
mod registers;
#[cfg(target_arch = "x86_64")]
pub mod wide;

pub use dual::{Dual, DualNumber};
pub use lanes::Lanes;
pub use partials::Partials;
pub use register::{MOST_LANES, Register};

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A number with which the models can be evaluated.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// The same number without its derivatives.
    type Real: Scalar;
    /// Number of runs in lock-step.
    const LANES: usize;
    /// Number of partial derivatives of each value.
    const PARTIALS: usize;

    /// The same constant in every lane, with zero derivatives.
    fn constant(x: f64) -> Self;
    /// One value per lane, with zero derivatives.
    fn from_lanes(value_of: impl FnMut(usize) -> f64) -> Self;
    /// A value with zero derivatives.
    fn from_real(value: Self::Real) -> Self;
    /// The value.
    fn real(self) -> Self::Real;
    /// The value in one lane.
    fn lane(&self, lane: usize) -> f64;
    /// The derivative with respect to seed `partial` in one lane; zero if the number has no such
    /// derivative.
    fn partial(&self, partial: usize, lane: usize) -> f64;
    /// The same number, with derivative one with respect to seed `partial`.
    #[must_use]
    fn seeded(self, partial: usize) -> Self;

    /// `self * b + c` with one rounding per operation of the hardware.
    #[must_use]
    fn fma(self, b: Self, c: Self) -> Self;
    /// `a * self + y` as [`Scalar::fma`]; cheaper because `a` has no derivatives.
    #[must_use]
    #[inline(always)]
    fn axpy(self, a: f64, y: Self) -> Self {
        self.fma(Self::constant(a), y)
    }
    /// `self * a + c` as [`Scalar::fma`]; cheaper because `a` has no derivatives.
    #[must_use]
    fn fma_real(self, a: Self::Real, c: Self) -> Self;
    /// Reciprocal.
    #[must_use]
    fn recip(self) -> Self;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Sine and cosine; absolute error below 3e-16 for |x| < 1e6.
    fn sin_cos(self) -> (Self, Self);
    /// Sine and cosine of every entry.
    #[inline(always)]
    fn sin_cos_each(x: &[Self], out: &mut [(Self, Self)]) {
        for (x, out) in x.iter().zip(out) {
            *out = x.sin_cos();
        }
    }
    /// Exponential; relative error below 3e-16, zero below -708.
    #[must_use]
    fn exp(self) -> Self;
    /// Hyperbolic tangent; absolute error below 5e-16.
    #[must_use]
    fn tanh(self) -> Self;
    /// `a` in the lanes where `self > 0`, `b` in all others, also where `self` is NaN.
    #[must_use]
    fn if_positive(self, a: Self, b: Self) -> Self;

    /// Zero.
    fn zero() -> Self {
        Self::constant(0.0)
    }
    /// One.
    fn one() -> Self {
        Self::constant(1.0)
    }
    /// Absolute value.
    #[must_use]
    fn abs(self) -> Self {
        self.if_positive(self, -self)
    }
    /// Square.
    #[must_use]
    fn square(self) -> Self {
        self * self
    }
}

impl Scalar for f64 {
    type Real = Self;
    const LANES: usize = 1;
    const PARTIALS: usize = 0;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn from_lanes(mut value_of: impl FnMut(usize) -> f64) -> Self {
        value_of(0)
    }
    #[inline(always)]
    fn from_real(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> Self {
        self
    }
    #[inline(always)]
    fn fma_real(self, a: Self, c: Self) -> Self {
        self.fma(a, c)
    }
    #[inline(always)]
    fn lane(&self, _lane: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn partial(&self, _partial: usize, _lane: usize) -> f64 {
        0.0
    }
    #[inline(always)]
    fn seeded(self, _partial: usize) -> Self {
        self
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
    }
    #[inline(always)]
    fn sin_cos_each(x: &[Self], out: &mut [(Self, Self)]) {
        // Four sines cost as much as one and have the same bits.
        for (x, out) in x.chunks(4).zip(out.chunks_mut(4)) {
            let (s, c) = Lanes::<4>::from_lanes(|i| x.get(i).copied().unwrap_or(0.0)).sin_cos();
            for (i, out) in out.iter_mut().enumerate().take(4) {
                *out = (s.0[i], c.0[i]);
            }
        }
    }
    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        elementary::tanh(self)
    }
    #[inline(always)]
    fn if_positive(self, a: Self, b: Self) -> Self {
        if self > 0.0 { a } else { b }
    }
}
