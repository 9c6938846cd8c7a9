//! One vector register of doubles behind one name, so that a kernel is compiled for several
//! widths and the widest that the processor has is chosen when it runs.

use super::{Lanes, Scalar};
use nalgebra::Complex;
use std::ops::{Add, Mul, Sub};

type C = Complex<f64>;

/// Most lanes of any register.
pub const MOST_LANES: usize = 8;

/// `LANES` doubles; arithmetic is elementwise, with the same bits at any width.
pub trait Register:
    Copy + Send + Sync + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Doubles held.
    const LANES: usize;
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// The first numbers of a slice.
    fn load(from: &[f64]) -> Self;
    /// Into the first places of a slice.
    fn store(self, to: &mut [f64]);
    /// `self * b + c` with one rounding.
    fn fma(self, b: Self, c: Self) -> Self;
    /// `c - self * b` with one rounding.
    fn fnma(self, b: Self, c: Self) -> Self;
    /// Reciprocal.
    fn recip(self) -> Self;
    /// The larger of `|self|` and `b`; `b` where either is NaN.
    fn magnitude_or(self, b: Self) -> Self;
    /// `a` where `self > 0`, `b` elsewhere, also where `self` is NaN.
    fn if_positive(self, a: Self, b: Self) -> Self;
    /// The power of two at or below a positive number, inverted; other numbers give zero,
    /// infinity or NaN.
    fn inverse_power_of_two(self) -> Self;
    /// Real and imaginary parts of the numbers `step` apart.
    fn split(from: &[C], step: usize) -> (Self, Self);
    /// The inverse of `split`.
    fn join(re: Self, im: Self, to: &mut [C], step: usize);
}

/// Bits of the exponent.
pub(super) const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

impl Register for Lanes<4> {
    const LANES: usize = 4;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; 4])
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self([from[0], from[1], from[2], from[3]])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..4].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Scalar::fma(self, b, c)
    }
    #[inline(always)]
    fn fnma(self, b: Self, c: Self) -> Self {
        Lanes::fnma(self, b, c)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Scalar::recip(self)
    }
    #[inline(always)]
    fn magnitude_or(self, b: Self) -> Self {
        Lanes::magnitude_or(self, b)
    }
    #[inline(always)]
    fn if_positive(self, a: Self, b: Self) -> Self {
        Scalar::if_positive(self, a, b)
    }
    #[inline(always)]
    fn inverse_power_of_two(self) -> Self {
        let power = |x: f64| f64::from_bits(x.to_bits() & EXPONENT);
        Register::recip(Self(self.0.map(power)))
    }
    #[inline(always)]
    fn split(from: &[C], step: usize) -> (Self, Self) {
        let [a, b, c, d] = [from[0], from[step], from[2 * step], from[3 * step]];
        (
            Self([a.re, b.re, c.re, d.re]),
            Self([a.im, b.im, c.im, d.im]),
        )
    }
    #[inline(always)]
    fn join(re: Self, im: Self, to: &mut [C], step: usize) {
        for l in 0..4 {
            to[l * step] = C::new(re.0[l], im.0[l]);
        }
    }
}
