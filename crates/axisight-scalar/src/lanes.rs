//! Several runs in lock-step, one in each lane.

use super::Scalar;
use super::elementary;
use super::registers as vector;
use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `L` independent values; arithmetic is elementwise.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes<const L: usize>(pub [f64; L]);

impl<const L: usize> Lanes<L> {
    /// `c - self * b` with one rounding.
    #[inline(always)]
    #[must_use]
    pub fn fnma(self, b: Self, c: Self) -> Self {
        Self(vector::fnma(self.0, b.0, c.0))
    }

    /// The larger of `|self|` and `b`; `b` where either is NaN.
    #[inline(always)]
    #[must_use]
    pub fn magnitude_or(self, b: Self) -> Self {
        Self(vector::larger(vector::magnitude(self.0), b.0))
    }
}

macro_rules! elementwise {
    ($trait:ident, $method:ident) => {
        impl<const L: usize> $trait for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(vector::$method(self.0, other.0))
            }
        }
        impl<const L: usize> $trait<f64> for Lanes<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                Self(vector::$method(self.0, [other; L]))
            }
        }
    };
}
elementwise!(Add, add);
elementwise!(Sub, sub);
elementwise!(Mul, mul);

impl<const L: usize> Div for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(vector::div(self.0, other.0))
    }
}
impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(vector::neg(self.0))
    }
}
impl<const L: usize> AddAssign for Lanes<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<const L: usize> SubAssign for Lanes<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Scalar for Lanes<L> {
    type Real = Self;
    const LANES: usize = L;
    const PARTIALS: usize = 0;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self([x; L])
    }
    #[inline(always)]
    fn from_lanes(value_of: impl FnMut(usize) -> f64) -> Self {
        Self(from_fn(value_of))
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
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane]
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
        Self(vector::fma(self.0, b.0, c.0))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self(vector::div([1.0; L], self.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(vector::sqrt(self.0))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        elementary::sin_cos(self)
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
        Self(vector::if_positive(self.0, a.0, b.0))
    }
}

impl<const L: usize> elementary::Real for Lanes<L> {
    #[inline(always)]
    fn round(self) -> Self {
        Self(vector::round(self.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(vector::floor(self.0))
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        Self(from_fn(|i| elementary::Real::two_to_the(self.0[i])))
    }
}
