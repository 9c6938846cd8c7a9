//! Complex numbers in the lanes of two registers.

use axisight_scalar::Register;
use nalgebra::Complex;

/// Real and imaginary parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<R> {
    pub(super) re: R,
    pub(super) im: R,
}

impl<R: Register> Pair<R> {
    #[inline(always)]
    pub(super) fn zero() -> Self {
        let zero = R::splat(0.0);
        Self { re: zero, im: zero }
    }

    /// The same number in every lane.
    #[inline(always)]
    pub(super) fn splat(x: Complex<f64>) -> Self {
        Self {
            re: R::splat(x.re),
            im: R::splat(x.im),
        }
    }

    /// The `LANES` numbers that lie `step` apart in `from`.
    #[inline(always)]
    pub(super) fn split(from: &[Complex<f64>], step: usize) -> Self {
        let (re, im) = R::split(from, step);
        Self { re, im }
    }

    /// The inverse of `split`.
    #[inline(always)]
    pub(super) fn join(self, to: &mut [Complex<f64>], step: usize) {
        R::join(self.re, self.im, to, step);
    }

    #[inline(always)]
    pub(super) fn plus(self, b: Self) -> Self {
        Self {
            re: self.re + b.re,
            im: self.im + b.im,
        }
    }

    #[inline(always)]
    pub(super) fn minus(self, b: Self) -> Self {
        Self {
            re: self.re - b.re,
            im: self.im - b.im,
        }
    }

    #[inline(always)]
    pub(super) fn times(self, b: Self) -> Self {
        Self {
            re: self.im.fnma(b.im, self.re * b.re),
            im: self.re.fma(b.im, self.im * b.re),
        }
    }

    /// `self + a b`.
    #[inline(always)]
    pub(super) fn plus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.fnma(b.im, a.re.fma(b.re, self.re)),
            im: a.im.fma(b.re, a.re.fma(b.im, self.im)),
        }
    }

    /// `self + a conj(b)`.
    #[inline(always)]
    pub(super) fn plus_conjugate_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.fma(b.im, a.re.fma(b.re, self.re)),
            im: a.re.fnma(b.im, a.im.fma(b.re, self.im)),
        }
    }

    /// `self - a b`.
    #[inline(always)]
    pub(super) fn minus_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.fma(b.im, a.re.fnma(b.re, self.re)),
            im: a.im.fnma(b.re, a.re.fnma(b.im, self.im)),
        }
    }

    /// `self + factor a`.
    #[inline(always)]
    pub(super) fn plus_scaled(self, factor: R, a: Self) -> Self {
        Self {
            re: factor.fma(a.re, self.re),
            im: factor.fma(a.im, self.im),
        }
    }

    /// `self - i a`.
    #[inline(always)]
    pub(super) fn minus_turned(self, a: Self) -> Self {
        Self {
            re: self.re + a.im,
            im: self.im - a.re,
        }
    }

    /// `self + i a`.
    #[inline(always)]
    pub(super) fn plus_turned(self, a: Self) -> Self {
        Self {
            re: self.re - a.im,
            im: self.im + a.re,
        }
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: R) -> Self {
        Self {
            re: self.re * factor,
            im: self.im * factor,
        }
    }

    /// Squared modulus.
    #[inline(always)]
    pub(super) fn square(self) -> R {
        self.re.fma(self.re, self.im * self.im)
    }

    /// `sum` and the squared modulus.
    #[inline(always)]
    pub(super) fn add_square(self, sum: R) -> R {
        self.re.fma(self.re, self.im.fma(self.im, sum))
    }

    #[inline(always)]
    pub(super) fn recip(self) -> Self {
        let factor = self.square().recip();
        Self {
            re: self.re * factor,
            im: self.im * (factor * R::splat(-1.0)),
        }
    }
}
