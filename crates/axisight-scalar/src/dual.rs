//! Forward-mode derivatives: a value and its partials along `N` seeds.

use super::Scalar;
use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `value + sum_i partials[i] eps_i` with `eps_i eps_j = 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<R, const N: usize> {
    /// Primal value.
    pub value: R,
    /// First derivatives along the seeds.
    pub partials: [R; N],
}

impl<R: Scalar, const N: usize> Dual<R, N> {
    /// `f(self)` given the value and the slope of `f` at `self.value`.
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Self {
            value,
            partials: from_fn(|i| self.partials[i] * slope),
        }
    }
}

impl<R: Scalar, const N: usize> Add for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            partials: from_fn(|i| self.partials[i] + other.partials[i]),
        }
    }
}
impl<R: Scalar, const N: usize> Sub for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            partials: from_fn(|i| self.partials[i] - other.partials[i]),
        }
    }
}
impl<R: Scalar, const N: usize> Mul for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            partials: from_fn(|i| {
                self.partials[i].fma(other.value, self.value * other.partials[i])
            }),
        }
    }
}
impl<R: Scalar, const N: usize> Div for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule with the reciprocal
    fn div(self, other: Self) -> Self {
        self * other.recip()
    }
}
impl<R: Scalar, const N: usize> Neg for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            partials: from_fn(|i| -self.partials[i]),
        }
    }
}
impl<R: Scalar, const N: usize> AddAssign for Dual<R, N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<R: Scalar, const N: usize> SubAssign for Dual<R, N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl<R: Scalar, const N: usize> Add<f64> for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self {
            value: self.value + other,
            partials: self.partials,
        }
    }
}
impl<R: Scalar, const N: usize> Sub<f64> for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        self + (-other)
    }
}
impl<R: Scalar, const N: usize> Mul<f64> for Dual<R, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self {
            value: self.value * other,
            partials: from_fn(|i| self.partials[i] * other),
        }
    }
}

impl<R: Scalar, const N: usize> Scalar for Dual<R, N> {
    const LANES: usize = R::LANES;
    const PARTIALS: usize = N;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self {
            value: R::constant(x),
            partials: [R::zero(); N],
        }
    }
    #[inline(always)]
    fn from_lanes(value_of: impl FnMut(usize) -> f64) -> Self {
        Self {
            value: R::from_lanes(value_of),
            partials: [R::zero(); N],
        }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.value.lane(lane)
    }
    #[inline(always)]
    fn partial(&self, partial: usize, lane: usize) -> f64 {
        self.partials.get(partial).map_or(0.0, |p| p.lane(lane))
    }
    #[inline(always)]
    fn seeded(mut self, partial: usize) -> Self {
        if let Some(p) = self.partials.get_mut(partial) {
            *p = R::one();
        }
        self
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self {
            value: self.value.fma(b.value, c.value),
            partials: from_fn(|i| {
                self.partials[i].fma(b.value, self.value.fma(b.partials[i], c.partials[i]))
            }),
        }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let value = self.value.recip();
        self.chain(value, -(value * value))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.chain(value, value.recip() * 0.5)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let value = self.value.tanh();
        self.chain(value, R::one() - value * value)
    }
    #[inline(always)]
    fn if_positive(self, a: Self, b: Self) -> Self {
        Self {
            value: self.value.if_positive(a.value, b.value),
            partials: from_fn(|i| self.value.if_positive(a.partials[i], b.partials[i])),
        }
    }
}
