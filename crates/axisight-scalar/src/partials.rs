//! Storage of the partial derivatives of a dual number: an array of any scalar, or the lanes of one
//! vector register of doubles.

use super::{Register, Scalar};
use std::fmt::Debug;

/// Partial derivatives over `R` along a fixed number of seeds; arithmetic is elementwise.
pub trait Partials<R>: Copy + Debug + Send + Sync + 'static {
    /// Number of seeds.
    const COUNT: usize;

    /// No derivatives.
    fn zero() -> Self;
    /// `self + b`.
    #[must_use]
    fn plus(self, b: Self) -> Self;
    /// `self - b`.
    #[must_use]
    fn minus(self, b: Self) -> Self;
    /// `-self`.
    #[must_use]
    fn negated(self) -> Self;
    /// `factor * self`.
    #[must_use]
    fn times(self, factor: R) -> Self;
    /// `factor * self + onto` with one rounding.
    #[must_use]
    fn times_plus(self, factor: R, onto: Self) -> Self;
    /// `a` where `condition > 0`, `b` elsewhere.
    #[must_use]
    fn if_positive(condition: R, a: Self, b: Self) -> Self;
    /// The derivative along seed `i`, if there is such a seed.
    fn along(&self, i: usize) -> Option<R>;
    /// The same derivatives with one along seed `i`; unchanged if there is no such seed.
    #[must_use]
    fn seeded(self, i: usize) -> Self;
}

/// `[expression; N]` with an index, as a plain loop. `array::from_fn` takes longer to compile, and
/// some of its closures are not inlined.
macro_rules! each {
    ($i:ident, $expression:expr) => {{
        let mut out = [R::zero(); N];
        let mut $i = 0;
        while $i < N {
            out[$i] = $expression;
            $i += 1;
        }
        out
    }};
}

impl<R: Scalar, const N: usize> Partials<R> for [R; N] {
    const COUNT: usize = N;

    #[inline(always)]
    fn zero() -> Self {
        [R::zero(); N]
    }
    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        each!(i, self[i] + b[i])
    }
    #[inline(always)]
    fn minus(self, b: Self) -> Self {
        each!(i, self[i] - b[i])
    }
    #[inline(always)]
    fn negated(self) -> Self {
        each!(i, -self[i])
    }
    #[inline(always)]
    fn times(self, factor: R) -> Self {
        each!(i, self[i] * factor)
    }
    #[inline(always)]
    fn times_plus(self, factor: R, onto: Self) -> Self {
        each!(i, self[i].fma(factor, onto[i]))
    }
    #[inline(always)]
    fn if_positive(condition: R, a: Self, b: Self) -> Self {
        each!(i, condition.if_positive(a[i], b[i]))
    }
    #[inline(always)]
    fn along(&self, i: usize) -> Option<R> {
        self.get(i).copied()
    }
    #[inline(always)]
    fn seeded(mut self, i: usize) -> Self {
        if let Some(p) = self.get_mut(i) {
            *p = R::one();
        }
        self
    }
}

/// All partials in one register. The compiler keeps the register in place through a whole step of
/// an integrator, while it moves parts of an array through memory.
impl<V: Register> Partials<f64> for V {
    const COUNT: usize = V::LANES;

    #[inline(always)]
    fn zero() -> Self {
        V::splat(0.0)
    }
    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        self + b
    }
    #[inline(always)]
    fn minus(self, b: Self) -> Self {
        self - b
    }
    #[inline(always)]
    fn negated(self) -> Self {
        -self
    }
    #[inline(always)]
    fn times(self, factor: f64) -> Self {
        self * V::splat(factor)
    }
    #[inline(always)]
    fn times_plus(self, factor: f64, onto: Self) -> Self {
        self.fma(V::splat(factor), onto)
    }
    #[inline(always)]
    fn if_positive(condition: f64, a: Self, b: Self) -> Self {
        if condition > 0.0 { a } else { b }
    }
    #[inline(always)]
    fn along(&self, i: usize) -> Option<f64> {
        stored(*self).get(i).copied().filter(|_| i < V::LANES)
    }
    #[inline(always)]
    fn seeded(self, i: usize) -> Self {
        let mut partials = stored(self);
        if let Some(p) = partials.get_mut(i) {
            *p = 1.0;
        }
        V::load(&partials)
    }
}

#[inline(always)]
fn stored<V: Register>(register: V) -> [f64; super::MOST_LANES] {
    let mut out = [0.0; super::MOST_LANES];
    register.store(&mut out);
    out
}
