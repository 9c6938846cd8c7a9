//! Gear formulas: backlash, then a spring.

use axisight_scalar::Scalar;

/// Share of the half-width over which the edge of the gap is rounded on each side. Without rounding
/// the damping jumps at contact, which no integrator follows with a bounded error.
const EDGE: f64 = 0.05;

/// Deflection beyond a gap of half-width `b`, and its slope over `delta`.
#[inline(always)]
pub fn dead_zone<S: Scalar>(delta: S, b: S) -> (S, S) {
    let (zero, one) = (S::zero(), S::one());
    let edge = b * EDGE;
    let over = delta.abs() - b;
    let into = over + edge;
    let rounded = (edge - over).if_positive(into * into / (edge * 4.0), over);
    let slope = (edge - over).if_positive(into / (edge * 2.0), one);
    // Strictly inside the gap. A gap of zero width has no inside.
    let size = (-into).if_positive(zero, rounded);
    let slope = (-into).if_positive(zero, slope);
    (delta.if_positive(size, -size), slope)
}

/// The deflection whose [`dead_zone`] is `loaded`. Without load it is zero, the middle of the gap.
#[inline(always)]
pub fn dead_zone_inverse<S: Scalar>(loaded: S, b: S) -> S {
    let edge = b * EDGE;
    let size = loaded.abs();
    let on_edge = (size * edge).sqrt() * 2.0 - edge;
    let over = (edge - size).if_positive(on_edge, size) + b;
    // An unloaded gear rests in the middle of its gap. Without a gap it follows the load.
    loaded.if_positive(over, (-loaded).if_positive(-over, loaded))
}

/// `k_1 delta + k_3 delta^3`, the torque of a spring.
#[inline(always)]
pub fn spring_torque<S: Scalar>(linear: S, cubic: S, deflection: S) -> S {
    cubic.fma(deflection.square(), linear) * deflection
}
