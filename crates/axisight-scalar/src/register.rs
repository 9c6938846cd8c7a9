//! One trait for vector registers of doubles, so that a kernel is compiled for several widths. The
//! widest width that the processor has is chosen at run time.

use super::{Lanes, Scalar};
use nalgebra::Complex;
use std::array::from_fn;
use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

type C = Complex<f64>;

/// The largest number of lanes of any register.
pub const MOST_LANES: usize = 8;

/// `LANES` doubles with elementwise arithmetic; results have the same bits at any width.
pub trait Register:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    /// Number of doubles in the register.
    const LANES: usize;
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// Load the first `LANES` numbers of a slice.
    fn load(from: &[f64]) -> Self;
    /// Store to the first `LANES` places of a slice.
    fn store(self, to: &mut [f64]);
    /// `self * b + c` with one rounding.
    #[must_use]
    fn fma(self, b: Self, c: Self) -> Self;
    /// `c - self * b` with one rounding.
    #[must_use]
    fn fnma(self, b: Self, c: Self) -> Self;
    /// Reciprocal.
    #[must_use]
    fn recip(self) -> Self;
    /// The larger of `|self|` and `b`; `b` where either is NaN.
    #[must_use]
    fn magnitude_or(self, b: Self) -> Self;
    /// `a` where `self > 0`, `b` elsewhere, also where `self` is NaN.
    #[must_use]
    fn if_positive(self, a: Self, b: Self) -> Self;
    /// Inverse of the largest power of two not above a positive number. Other numbers give zero,
    /// infinity or NaN.
    #[must_use]
    fn inverse_power_of_two(self) -> Self;
    /// Real and imaginary parts of `LANES` numbers that lie `step` apart in `from`.
    fn split(from: &[C], step: usize) -> (Self, Self);
    /// The inverse of `split`.
    fn join(re: Self, im: Self, to: &mut [C], step: usize);
}

/// Bit mask of the exponent.
pub(super) const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

/// `L` lanes, at most [`MOST_LANES`], in registers of 256 bits.
impl<const L: usize> Register for Lanes<L> {
    const LANES: usize = L;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; L])
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        Self(from.as_chunks::<L>().0[0])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..L].copy_from_slice(&self.0);
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
        let from = &from[..=(L - 1) * step];
        (
            Self(from_fn(|l| from[l * step].re)),
            Self(from_fn(|l| from[l * step].im)),
        )
    }
    #[inline(always)]
    fn join(re: Self, im: Self, to: &mut [C], step: usize) {
        for l in 0..L {
            to[l * step] = C::new(re.0[l], im.0[l]);
        }
    }
}
