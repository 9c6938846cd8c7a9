//! A value and its eight derivatives, the derivatives in vector registers.

use super::problem::LANES;
use axisight_core::scalar::{Lanes, Scalar};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

type Partials = Lanes<LANES>;

/// A scalar that steps of an integrator are cheap with.
pub(super) trait Number: Scalar {
    /// `self * h + onto`.
    #[must_use]
    fn times_plus(self, h: f64, onto: Self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn times_plus(self, h: f64, onto: Self) -> Self {
        self.mul_add(h, onto)
    }
}

impl Number for Jet {
    #[inline(always)]
    fn times_plus(self, h: f64, onto: Self) -> Self {
        Self {
            value: self.value.mul_add(h, onto.value),
            partials: self.partials.fma(splat(h), onto.partials),
        }
    }
}

/// `value + sum_i partials[i] eps_i` with `eps_i eps_j = 0`: a dual number of the core whose
/// partials are lanes, which the compiler keeps in registers through a whole step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jet {
    pub value: f64,
    pub partials: Partials,
}

impl Jet {
    /// `f(self)` given value and slope of `f`.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            partials: self.partials * slope,
        }
    }
}

#[inline(always)]
fn splat(x: f64) -> Partials {
    Lanes([x; LANES])
}

impl Add for Jet {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self {
            value: self.value + b.value,
            partials: self.partials + b.partials,
        }
    }
}
impl Sub for Jet {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self {
            value: self.value - b.value,
            partials: self.partials - b.partials,
        }
    }
}
impl Mul for Jet {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            partials: self.partials.fma(splat(b.value), b.partials * self.value),
        }
    }
}
impl Div for Jet {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule with the reciprocal
    fn div(self, b: Self) -> Self {
        self * b.recip()
    }
}
impl Neg for Jet {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            partials: -self.partials,
        }
    }
}
impl AddAssign for Jet {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}
impl SubAssign for Jet {
    #[inline(always)]
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}
impl Add<f64> for Jet {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: f64) -> Self {
        Self {
            value: self.value + b,
            ..self
        }
    }
}
impl Sub<f64> for Jet {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: f64) -> Self {
        self + (-b)
    }
}
impl Mul<f64> for Jet {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: f64) -> Self {
        self.chain(self.value * b, b)
    }
}

impl Scalar for Jet {
    const LANES: usize = 1;
    const PARTIALS: usize = LANES;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self {
            value: x,
            partials: splat(0.0),
        }
    }
    #[inline(always)]
    fn from_lanes(mut value_of: impl FnMut(usize) -> f64) -> Self {
        Self::constant(value_of(0))
    }
    #[inline(always)]
    fn lane(&self, _lane: usize) -> f64 {
        self.value
    }
    #[inline(always)]
    fn partial(&self, partial: usize, _lane: usize) -> f64 {
        self.partials.0.get(partial).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn seeded(mut self, partial: usize) -> Self {
        if let Some(p) = self.partials.0.get_mut(partial) {
            *p = 1.0;
        }
        self
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        let inner = b.partials.fma(splat(self.value), c.partials);
        Self {
            value: self.value.mul_add(b.value, c.value),
            partials: self.partials.fma(splat(b.value), inner),
        }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let value = 1.0 / self.value;
        self.chain(value, -(value * value))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.chain(value, 0.5 / value)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.value);
        (self.chain(s, c), self.chain(c, -s))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = Scalar::exp(self.value);
        self.chain(value, value)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        let value = Scalar::tanh(self.value);
        self.chain(value, 1.0 - value * value)
    }
    #[inline(always)]
    fn if_positive(self, a: Self, b: Self) -> Self {
        if self.value > 0.0 { a } else { b }
    }
}
