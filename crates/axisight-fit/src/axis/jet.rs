//! A value and its eight derivatives, the derivatives in vector registers.

use super::problem::LANES;
use axisight_scalar::{Lanes, Scalar};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Eight doubles in registers.
pub(super) trait Partials:
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
    /// The same number in every lane.
    fn splat(x: f64) -> Self;
    /// `self * b + c` with one rounding.
    #[must_use]
    fn fma(self, b: Self, c: Self) -> Self;
    /// From an array.
    fn load(from: &[f64; LANES]) -> Self;
    /// As an array.
    fn store(self) -> [f64; LANES];
}

impl Partials for Lanes<LANES> {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Lanes([x; LANES])
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Scalar::fma(self, b, c)
    }
    #[inline(always)]
    fn load(from: &[f64; LANES]) -> Self {
        Lanes(*from)
    }
    #[inline(always)]
    fn store(self) -> [f64; LANES] {
        self.0
    }
}

/// A scalar that steps of an integrator are cheap with.
pub(super) trait Number: Scalar {
    /// The same in registers that every processor has.
    type Plain: Number;
    /// As such.
    fn plain(self) -> Self::Plain;
    /// Back again.
    fn from_plain(x: Self::Plain) -> Self;
    /// `self * h + onto`.
    #[must_use]
    fn times_plus(self, h: f64, onto: Self) -> Self;
}

impl Number for f64 {
    type Plain = f64;
    #[inline(always)]
    fn plain(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_plain(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn times_plus(self, h: f64, onto: Self) -> Self {
        self.mul_add(h, onto)
    }
}

impl<P: Partials> Number for Jet<P> {
    type Plain = Jet<Lanes<LANES>>;
    #[inline(always)]
    fn plain(self) -> Self::Plain {
        Jet {
            value: self.value,
            partials: Lanes(self.partials.store()),
        }
    }
    #[inline(always)]
    fn from_plain(x: Self::Plain) -> Self {
        Self {
            value: x.value,
            partials: P::load(&x.partials.0),
        }
    }
    #[inline(always)]
    fn times_plus(self, h: f64, onto: Self) -> Self {
        Self {
            value: self.value.mul_add(h, onto.value),
            partials: self.partials.fma(P::splat(h), onto.partials),
        }
    }
}

/// `value + sum_i partials[i] eps_i` with `eps_i eps_j = 0`: a dual number of the core whose
/// partials are lanes, which the compiler keeps in registers through a whole step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet<P> {
    pub value: f64,
    pub partials: P,
}

impl<P: Partials> Jet<P> {
    /// `f(self)` given value and slope of `f`.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            partials: self.partials * P::splat(slope),
        }
    }
}

impl<P: Partials> Add for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self {
            value: self.value + b.value,
            partials: self.partials + b.partials,
        }
    }
}
impl<P: Partials> Sub for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self {
            value: self.value - b.value,
            partials: self.partials - b.partials,
        }
    }
}
impl<P: Partials> Mul for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self {
            value: self.value * b.value,
            partials: self
                .partials
                .fma(P::splat(b.value), b.partials * P::splat(self.value)),
        }
    }
}
impl<P: Partials> Div for Jet<P> {
    type Output = Self;
    #[inline(always)]
    #[allow(clippy::suspicious_arithmetic_impl)] // the product rule with the reciprocal
    fn div(self, b: Self) -> Self {
        self * b.recip()
    }
}
impl<P: Partials> Neg for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            partials: -self.partials,
        }
    }
}
impl<P: Partials> AddAssign for Jet<P> {
    #[inline(always)]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}
impl<P: Partials> SubAssign for Jet<P> {
    #[inline(always)]
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}
impl<P: Partials> Add<f64> for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: f64) -> Self {
        Self {
            value: self.value + b,
            ..self
        }
    }
}
impl<P: Partials> Sub<f64> for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: f64) -> Self {
        self + (-b)
    }
}
impl<P: Partials> Mul<f64> for Jet<P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: f64) -> Self {
        self.chain(self.value * b, b)
    }
}

impl<P: Partials> Scalar for Jet<P> {
    const LANES: usize = 1;
    const PARTIALS: usize = LANES;

    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self {
            value: x,
            partials: P::splat(0.0),
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
        self.partials.store().get(partial).copied().unwrap_or(0.0)
    }
    #[inline(always)]
    fn seeded(mut self, partial: usize) -> Self {
        let mut partials = self.partials.store();
        if let Some(p) = partials.get_mut(partial) {
            *p = 1.0;
        }
        self.partials = P::load(&partials);
        self
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        let inner = b.partials.fma(P::splat(self.value), c.partials);
        Self {
            value: self.value.mul_add(b.value, c.value),
            partials: self.partials.fma(P::splat(b.value), inner),
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
