//! Dry friction: level over speed, and smoothed sign.

use axisight_scalar::Scalar;
use std::ops::Mul;

/// `tanh(v / v_0)`, the sign of the speed, smoothed over the width `v_0`. Takes `1 / v_0`.
#[inline(always)]
pub fn smoothed_sign<S: Scalar + Mul<W, Output = S>, W>(speed: S, inverse_width: W) -> S {
    (speed * inverse_width).tanh()
}

/// `F_c + F_s exp(-(v / v_s)^2)`, the friction level at a speed. The excess `F_s` at standstill
/// falls over the Stribeck speed `v_s`. Takes `1 / v_s`.
#[inline(always)]
pub fn stribeck_level<S: Scalar>(coulomb: S, excess: S, inverse_speed: S, speed: S) -> S {
    let hump = (-(speed * inverse_speed).square()).exp();
    excess.fma(hump, coulomb)
}
