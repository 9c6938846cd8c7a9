//! One harmonic of an angle.

use axisight_scalar::Scalar;

/// `c cos(x) + s sin(x)` of a phase `x`.
#[inline(always)]
pub fn harmonic<S: Scalar>(phase: S, cosine: S, sine: S) -> S {
    let (s, c) = phase.sin_cos();
    cosine.fma(c, sine * s)
}

/// [`harmonic`] and its slope over the phase.
#[inline(always)]
pub fn harmonic_slope<S: Scalar>(phase: S, cosine: S, sine: S) -> (S, S) {
    let (s, c) = phase.sin_cos();
    (cosine.fma(c, sine * s), sine.fma(c, -(cosine * s)))
}
