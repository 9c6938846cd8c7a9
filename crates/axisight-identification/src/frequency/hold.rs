//! Contribution of a pole to a frequency response, continuous or sampled.

use nalgebra::Complex;

type C = Complex<f64>;

/// The course of the torque between samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// Continuous, for `G(i w)`.
    Continuous,
    /// Held over each sample of length `T` [s], for `G(e^{i w T})`.
    ZeroOrder(f64),
}

/// A pole, in the form of the responses.
///
/// A partial fraction `1 / (s - lambda)` becomes `g = phi / (z - e)` under a hold, with
/// `phi = (e - 1) / lambda` and `e = exp(lambda T)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pole {
    pub(super) value: C,
    /// `e - 1`.
    shift: C,
    /// `phi`, followed by its slope over `lambda`.
    phi: C,
    phi_slope: C,
    /// Slope of `e` over `lambda`.
    shift_slope: C,
}

/// Below this size, power series replace quotients that cancel.
const SERIES_BELOW: f64 = 0.5;

impl Pole {
    pub(super) fn new(value: C, hold: Hold) -> Self {
        let Hold::ZeroOrder(step) = hold else {
            let (zero, one) = (C::new(0.0, 0.0), C::new(1.0, 0.0));
            let (shift, shift_slope) = (value, one);
            return Self {
                value,
                shift,
                phi: one,
                phi_slope: zero,
                shift_slope,
            };
        };
        let x = value * step;
        let (first, second) = if x.norm() < SERIES_BELOW {
            // The sums x^k / (k + 1)! and x^k / (k! (k + 2)).
            let (mut term, mut first, mut second) = (C::new(1.0, 0.0), C::default(), C::default());
            for k in 0..20 {
                let k = f64::from(k);
                first += term / (k + 1.0);
                second += term / (k + 2.0);
                term = term * x / (k + 1.0);
            }
            (first, second)
        } else {
            let e = x.exp();
            ((e - 1.0) / x, (x * e - e + 1.0) / (x * x))
        };
        Self {
            value,
            shift: first * x,
            phi: first * step,
            phi_slope: second * (step * step),
            shift_slope: (first * x + 1.0) * step,
        }
    }

    /// The complex conjugate of the pole.
    pub(super) fn conjugate(&self) -> Self {
        Self {
            value: self.value.conj(),
            shift: self.shift.conj(),
            phi: self.phi.conj(),
            phi_slope: self.phi_slope.conj(),
            shift_slope: self.shift_slope.conj(),
        }
    }

    /// `g` and its slope over `lambda` at a [`point`].
    #[inline]
    pub(super) fn evaluate(&self, point: C) -> (C, C) {
        let d = point - self.shift;
        let inverse = d.conj() / d.norm_sqr();
        let g = self.phi * inverse;
        (g, self.phi_slope * inverse + g * self.shift_slope * inverse)
    }

    /// `(g_a - g_b) / (lambda_a - lambda_b)` for two poles close together.
    pub(super) fn divided_difference(&self, other: &Self, point: C, hold: Hold) -> C {
        let (a, b) = (1.0 / (point - self.shift), 1.0 / (point - other.shift));
        let Hold::ZeroOrder(step) = hold else {
            return a * b;
        };
        // The mean slope of phi has an error of second order in the difference, which is small.
        let phi = (self.phi_slope + other.phi_slope) * 0.5;
        let half = (self.value - other.value) * (0.5 * step);
        let e = ((self.value + other.value) * (0.5 * step)).exp() * (1.0 + half * half / 6.0);
        phi * a + other.phi * (e * step) * a * b
    }
}

/// `s` of a frequency, or `z - 1` under a hold.
pub(super) fn point(frequency_hz: f64, hold: Hold) -> C {
    let w = std::f64::consts::TAU * frequency_hz;
    match hold {
        Hold::Continuous => C::new(0.0, w),
        Hold::ZeroOrder(step) => {
            // z - 1 without cancellation: 2 i sin(x/2) e^{ix/2}.
            let (sin, cos) = (0.5 * w * step).sin_cos();
            C::new(-2.0 * sin * sin, 2.0 * sin * cos)
        }
    }
}
