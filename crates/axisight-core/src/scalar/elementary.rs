//! Elementary functions without branches, so that a loop over lanes becomes
//! vector instructions and a run gives the same bits in any lane width.
//!
//! Argument reduction after Cody and Waite (1980), *Software Manual for the
//! Elementary Functions*; the polynomials are the Taylor ones on the reduced
//! interval, carried to where their remainder is below one rounding.

// pi/2 in three parts; the first two have trailing zeros so that products with
// the quadrant number are exact for |x| < 1e6.
const HALF_PI_1: f64 = 1.570_796_326_734_125_6;
const HALF_PI_2: f64 = 6.077_100_506_303_966e-11;
const HALF_PI_3: f64 = 2.022_266_248_795_950_6e-21;

/// Sine and cosine of `x` [rad].
#[inline(always)]
#[allow(clippy::float_cmp)] // quadrant numbers are whole
pub(super) fn sin_cos(x: f64) -> (f64, f64) {
    let quadrant = (x * std::f64::consts::FRAC_2_PI).round_ties_even();
    let r = quadrant.mul_add(
        -HALF_PI_3,
        quadrant.mul_add(-HALF_PI_2, quadrant.mul_add(-HALF_PI_1, x)),
    );
    let z = r * r;
    let s = sine_polynomial(r, z);
    let c = cosine_polynomial(z);
    // quadrant modulo 4 as a number in 0..4
    let q = (quadrant * 0.25).floor().mul_add(-4.0, quadrant);
    let odd = q == 1.0 || q == 3.0;
    let (sin, cos) = if odd { (c, s) } else { (s, c) };
    let sin = if q >= 2.0 { -sin } else { sin };
    let cos = if q == 1.0 || q == 2.0 { -cos } else { cos };
    (sin, cos)
}

#[inline(always)]
fn sine_polynomial(r: f64, z: f64) -> f64 {
    let p = (1.0_f64 / 355_687_428_096_000.0)
        .mul_add(z, -1.0 / 1_307_674_368_000.0)
        .mul_add(z, 1.0 / 6_227_020_800.0)
        .mul_add(z, -1.0 / 39_916_800.0)
        .mul_add(z, 1.0 / 362_880.0)
        .mul_add(z, -1.0 / 5_040.0)
        .mul_add(z, 1.0 / 120.0)
        .mul_add(z, -1.0 / 6.0);
    (p * z).mul_add(r, r)
}

#[inline(always)]
fn cosine_polynomial(z: f64) -> f64 {
    let p = (1.0_f64 / 20_922_789_888_000.0)
        .mul_add(z, -1.0 / 87_178_291_200.0)
        .mul_add(z, 1.0 / 479_001_600.0)
        .mul_add(z, -1.0 / 3_628_800.0)
        .mul_add(z, 1.0 / 40_320.0)
        .mul_add(z, -1.0 / 720.0)
        .mul_add(z, 1.0 / 24.0)
        .mul_add(z, -0.5);
    p.mul_add(z, 1.0)
}

const LN2_HIGH: f64 = 6.931_471_803_691_238_2e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Exponential of `x`, zero below -708, saturated above 708.
#[inline(always)]
pub(super) fn exp(x: f64) -> f64 {
    let clamped = x.clamp(-708.0, 708.0);
    let n = (clamped * std::f64::consts::LOG2_E).round_ties_even();
    let r = n.mul_add(-LN2_LOW, n.mul_add(-LN2_HIGH, clamped));
    let p = (1.0_f64 / 6_227_020_800.0)
        .mul_add(r, 1.0 / 479_001_600.0)
        .mul_add(r, 1.0 / 39_916_800.0)
        .mul_add(r, 1.0 / 3_628_800.0)
        .mul_add(r, 1.0 / 362_880.0)
        .mul_add(r, 1.0 / 40_320.0)
        .mul_add(r, 1.0 / 5_040.0)
        .mul_add(r, 1.0 / 720.0)
        .mul_add(r, 1.0 / 120.0)
        .mul_add(r, 1.0 / 24.0)
        .mul_add(r, 1.0 / 6.0)
        .mul_add(r, 0.5)
        .mul_add(r, 1.0)
        .mul_add(r, 1.0);
    // Adding 2^52 + 2^51 leaves the integer n in the low bits of the sum.
    let magic = 6_755_399_441_055_744.0_f64;
    let bits = ((n + magic).to_bits() << 52).wrapping_add(1.0_f64.to_bits());
    let y = p * f64::from_bits(bits);
    if x < -708.0 { 0.0 } else { y }
}

/// Hyperbolic tangent of `x`.
#[inline(always)]
pub(super) fn tanh(x: f64) -> f64 {
    let e = exp(-2.0 * x.abs());
    ((1.0 - e) / (1.0 + e)).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(limit: f64) -> impl Iterator<Item = f64> {
        (0..200_001).map(move |i| (f64::from(i) / 100_000.0 - 1.0) * limit)
    }

    #[test]
    fn sine_and_cosine_match_the_standard_library() {
        for limit in [1.0, 30.0, 1e4, 1e6] {
            for x in sweep(limit) {
                let (s, c) = sin_cos(x);
                assert!((s - x.sin()).abs() < 3e-16, "sin({x}): {s}");
                assert!((c - x.cos()).abs() < 3e-16, "cos({x}): {c}");
            }
        }
    }

    #[test]
    fn exponential_matches_the_standard_library() {
        for limit in [1e-3, 1.0, 30.0, 700.0] {
            for x in sweep(limit) {
                let relative = exp(x) / x.exp() - 1.0;
                assert!(relative.abs() < 5e-16, "exp({x}): {relative}");
            }
        }
        assert!(exp(-1e9) <= 0.0);
    }

    #[test]
    fn hyperbolic_tangent_matches_the_standard_library() {
        for limit in [1e-6, 1.0, 30.0, 1e5] {
            for x in sweep(limit) {
                assert!((tanh(x) - x.tanh()).abs() < 5e-16, "tanh({x})");
            }
        }
    }
}
