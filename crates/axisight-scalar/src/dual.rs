//! Forward-mode automatic differentiation: a value and its partial derivatives along given seeds.

use super::{Partials, Scalar};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A dual number `value + sum_i partials[i] eps_i` with `eps_i eps_j = 0`; `P` stores the partials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DualNumber<R, P> {
    /// Primal value.
    pub value: R,
    /// First derivatives along the seeds.
    pub partials: P,
}

/// A dual number with `N` partials in an array.
pub type Dual<R, const N: usize> = DualNumber<R, [R; N]>;

impl<R: Scalar, P: Partials<R>> DualNumber<R, P> {
    /// `f(self)` given the value and the slope of `f` at `self.value`.
    #[inline(always)]
    fn chain(self, value: R, slope: R) -> Self {
        Self {
            value,
            partials: self.partials.times(slope),
        }
    }
}

impl<R: Scalar, P: Partials<R>> Add for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            partials: self.partials.plus(other.partials),
        }
    }
}
impl<R: Scalar, P: Partials<R>> Sub for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            partials: self.partials.minus(other.partials),
        }
    }
}
impl<R: Scalar, P: Partials<R>> Mul for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            partials: self
                .partials
                .times_plus(other.value, other.partials.times(self.value)),
        }
    }
}
impl<R: Scalar, P: Partials<R>> Div for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule with the reciprocal
    fn div(self, other: Self) -> Self {
        self * other.recip()
    }
}
impl<R: Scalar, P: Partials<R>> Neg for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            partials: self.partials.negated(),
        }
    }
}
impl<R: Scalar, P: Partials<R>> AddAssign for DualNumber<R, P> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<R: Scalar, P: Partials<R>> SubAssign for DualNumber<R, P> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
impl<R: Scalar, P: Partials<R>> Add<f64> for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self {
            value: self.value + other,
            partials: self.partials,
        }
    }
}
impl<R: Scalar, P: Partials<R>> Sub<f64> for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        self + (-other)
    }
}
impl<R: Scalar, P: Partials<R>> Mul<f64> for DualNumber<R, P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        self.chain(self.value * other, R::constant(other))
    }
}

impl<R: Scalar, P: Partials<R>> Scalar for DualNumber<R, P> {
    type Real = R;
    const LANES: usize = R::LANES;
    const PARTIALS: usize = P::COUNT;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self {
            value: R::constant(x),
            partials: P::zero(),
        }
    }
    #[inline(always)]
    fn from_lanes(value_of: impl FnMut(usize) -> f64) -> Self {
        Self {
            value: R::from_lanes(value_of),
            partials: P::zero(),
        }
    }
    #[inline(always)]
    fn from_real(value: R) -> Self {
        Self {
            value,
            partials: P::zero(),
        }
    }
    #[inline(always)]
    fn real(self) -> R {
        self.value
    }
    #[inline(always)]
    fn fma_real(self, a: R, c: Self) -> Self {
        Self {
            value: self.value.fma(a, c.value),
            partials: self.partials.times_plus(a, c.partials),
        }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f64 {
        self.value.lane(lane)
    }
    #[inline(always)]
    fn partial(&self, partial: usize, lane: usize) -> f64 {
        self.partials.along(partial).map_or(0.0, |p| p.lane(lane))
    }
    #[inline(always)]
    fn seeded(mut self, partial: usize) -> Self {
        self.partials = self.partials.seeded(partial);
        self
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self {
            value: self.value.fma(b.value, c.value),
            partials: self
                .partials
                .times_plus(b.value, b.partials.times_plus(self.value, c.partials)),
        }
    }
    #[inline(always)]
    fn axpy(self, a: f64, y: Self) -> Self {
        Self {
            value: self.value.axpy(a, y.value),
            partials: self.partials.times_plus(R::constant(a), y.partials),
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
            partials: P::if_positive(self.value, a.partials, b.partials),
        }
    }
}
