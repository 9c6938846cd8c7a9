//! Elementary functions without branches.
//!
//! Without branches, a loop over lanes becomes vector instructions, and a run gives the same bits
//! at any lane width.
//!
//! Argument reduction follows Cody and Waite (1980), *Software Manual for the Elementary
//! Functions*. The polynomials are Taylor polynomials on the reduced interval. Their order makes
//! the remainder smaller than one rounding error.

use super::Scalar;

// pi/2 in three parts; the first two have trailing zeros so that products with
// the quadrant number are exact for |x| < 1e6.
const HALF_PI_1: f64 = 1.570_796_326_734_125_6;
const HALF_PI_2: f64 = 6.077_100_506_303_966e-11;
const HALF_PI_3: f64 = 2.022_266_248_795_950_6e-21;

/// Operations that the functions need beyond [`Scalar`], for numbers without derivatives.
pub(super) trait Real: Scalar {
    /// The nearest whole number, ties to even.
    fn round(self) -> Self;
    /// The largest whole number that is not above `self`.
    fn floor(self) -> Self;
    /// `2^self` for a whole number from -1022 to 1023.
    fn two_to_the(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn round(self) -> Self {
        self.round_ties_even()
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
    #[inline(always)]
    fn two_to_the(self) -> Self {
        // Adding 2^52 + 2^51 leaves the integer in the low bits of the sum.
        let magic = 6_755_399_441_055_744.0_f64;
        f64::from_bits(((self + magic).to_bits() << 52).wrapping_add(1.0_f64.to_bits()))
    }
}

/// Value of a polynomial with the given coefficients, highest power first.
#[inline(always)]
fn horner<R: Real>(z: R, coefficients: &[f64]) -> R {
    let mut sum = R::zero();
    for (i, c) in coefficients.iter().enumerate() {
        sum = if i == 0 {
            R::constant(*c)
        } else {
            sum.fma(z, R::constant(*c))
        };
    }
    sum
}

/// Sine and cosine of `x` [rad].
#[inline(always)]
pub(super) fn sin_cos<R: Real>(x: R) -> (R, R) {
    let quadrant = (x * std::f64::consts::FRAC_2_PI).round();
    let r = quadrant.fma(R::constant(-HALF_PI_1), x);
    let r = quadrant.fma(R::constant(-HALF_PI_2), r);
    let r = quadrant.fma(R::constant(-HALF_PI_3), r);
    let z = r * r;
    let s = (horner(z, &SINE) * z).fma(r, r);
    let c = horner(z, &COSINE).fma(z, R::one());
    // Quadrant modulo 4 is 0, 1, 2 or 3; halves fall between them.
    let q = (quadrant * 0.25).floor().fma(R::constant(-4.0), quadrant);
    let middle = (q - 1.5).abs() - 1.0;
    // `middle` is 0.5 for quadrants 0 and 3, -0.5 for 1 and 2. Odd quadrants swap sine and cosine.
    let odd = -((q - 2.0).abs() - 1.0).abs() + 0.5;
    let (sin, cos) = (odd.if_positive(c, s), odd.if_positive(s, c));
    let sin = (q - 1.5).if_positive(-sin, sin);
    (sin, middle.if_positive(cos, -cos))
}

const SINE: [f64; 8] = [
    1.0 / 355_687_428_096_000.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5_040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
];

const COSINE: [f64; 8] = [
    1.0 / 20_922_789_888_000.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -0.5,
];

const LN2_HIGH: f64 = 6.931_471_803_691_238_2e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

const EXPONENTIAL: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// Exponential of `x`, zero below -708, saturated above 708.
#[inline(always)]
pub(super) fn exp<R: Real>(x: R) -> R {
    let limit = R::constant(708.0);
    // A comparison with NaN is false, so NaN passes through all three choices.
    let below = (x - limit).if_positive(limit, x);
    let clamped = (-limit - below).if_positive(-limit, below);
    let n = (clamped * std::f64::consts::LOG2_E).round();
    let r = n.fma(
        R::constant(-LN2_LOW),
        n.fma(R::constant(-LN2_HIGH), clamped),
    );
    let y = horner(r, &EXPONENTIAL) * n.two_to_the();
    (-limit - x).if_positive(R::zero(), y)
}

/// Hyperbolic tangent of `x`.
#[inline(always)]
pub(super) fn tanh<R: Real>(x: R) -> R {
    let e = exp(x.abs() * -2.0);
    let size = (R::one() - e) / (R::one() + e);
    x.if_positive(size, -size)
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
        assert!(exp(f64::NAN).is_nan() && tanh(f64::NAN).is_nan());
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
