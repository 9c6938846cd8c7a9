//! Streaming means and second moments of complex responses.
//!
//! The statistics of an element are:
//!
//! * the arithmetic mean and the covariance of (re, im),
//! * the mean and the variance of the log magnitude,
//! * the mean direction,
//! * the mean of the element of the inverse matrix.
//!
//! Single values follow Welford (1962), merged accumulators Chan, Golub, `LeVeque` (1983). Merging
//! is associative up to rounding. For identical bits, merge in a fixed order.

use super::MergeError;
use nalgebra::Complex;

/// Names of the statistics, in the order of [`Moments::values`].
pub const STATISTICS: [&str; 11] = [
    "mean_real",
    "mean_imag",
    "sum_squares_real",
    "sum_squares_imag",
    "sum_products",
    "mean_log_magnitude",
    "sum_squares_log_magnitude",
    "direction_real",
    "direction_imag",
    "inverse_real",
    "inverse_imag",
];
const N: usize = STATISTICS.len();

/// Accumulated moments of `size` elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    /// Number of responses of each element.
    pub count: Vec<u64>,
    /// Number of inverse responses of each element. Singular responses have no inverse.
    pub inverse_count: Vec<u64>,
    /// `(statistic, element)`, row-major.
    pub values: Vec<f64>,
}

impl Moments {
    /// Empty accumulators for `size` elements.
    pub fn new(size: usize) -> Self {
        Self {
            count: vec![0; size],
            inverse_count: vec![0; size],
            values: vec![0.0; N * size],
        }
    }

    /// Number of elements.
    pub fn size(&self) -> usize {
        self.count.len()
    }

    fn at(&mut self, statistic: usize, element: usize) -> &mut f64 {
        let size = self.count.len();
        &mut self.values[statistic * size + element]
    }

    /// Add one finite response at `element`.
    pub fn push(&mut self, element: usize, g: Complex<f64>) {
        self.count[element] += 1;
        let n = self.count[element] as f64;
        let (dx, dy) = (g.re - *self.at(0, element), g.im - *self.at(1, element));
        *self.at(0, element) += dx / n;
        *self.at(1, element) += dy / n;
        let (rx, ry) = (g.re - *self.at(0, element), g.im - *self.at(1, element));
        *self.at(2, element) += dx * rx;
        *self.at(3, element) += dy * ry;
        *self.at(4, element) += dx * ry;
        // A response of exactly zero has the log of the smallest normal number, not -inf.
        let magnitude = g.norm().max(f64::MIN_POSITIVE);
        let log = magnitude.ln();
        let dl = log - *self.at(5, element);
        *self.at(5, element) += dl / n;
        let rl = log - *self.at(5, element);
        *self.at(6, element) += dl * rl;
        // The mean of unit vectors does not depend on where the phase wraps.
        let direction = g / magnitude;
        let (du, dv) = (
            direction.re - *self.at(7, element),
            direction.im - *self.at(8, element),
        );
        *self.at(7, element) += du / n;
        *self.at(8, element) += dv / n;
    }

    /// Add one finite element of an inverse response.
    pub fn push_inverse(&mut self, element: usize, h: Complex<f64>) {
        self.inverse_count[element] += 1;
        let n = self.inverse_count[element] as f64;
        let (dx, dy) = (h.re - *self.at(9, element), h.im - *self.at(10, element));
        *self.at(9, element) += dx / n;
        *self.at(10, element) += dy / n;
    }

    /// Add the values of `other`.
    ///
    /// # Errors
    /// [`MergeError`] if the sizes differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        let size = self.size();
        let fits = other.inverse_count.len() == size && other.values.len() == N * size;
        if other.size() != size || !fits {
            return Err(MergeError {
                field: "moments",
                expected: format!("{size} elements"),
                got: format!("{} elements", other.size()),
            });
        }
        for e in 0..size {
            let (n, m) = (self.count[e] as f64, other.count[e] as f64);
            if m > 0.0 {
                self.merge_element(e, other, n, m);
                self.count[e] += other.count[e];
            }
            let (n, m) = (self.inverse_count[e] as f64, other.inverse_count[e] as f64);
            if m > 0.0 {
                for s in 9..11 {
                    let step = other.values[s * size + e] - *self.at(s, e);
                    *self.at(s, e) += step * (m / (n + m));
                }
                self.inverse_count[e] += other.inverse_count[e];
            }
        }
        Ok(())
    }

    fn merge_element(&mut self, e: usize, other: &Self, n: f64, m: f64) {
        let size = self.size();
        let theirs = |s: usize| other.values[s * size + e];
        let mut step = [0.0; 9];
        for s in [0, 1, 5, 7, 8] {
            step[s] = theirs(s) - *self.at(s, e);
            *self.at(s, e) += step[s] * (m / (n + m));
        }
        let between = n * m / (n + m);
        *self.at(2, e) += theirs(2) + step[0] * step[0] * between;
        *self.at(3, e) += theirs(3) + step[1] * step[1] * between;
        *self.at(4, e) += theirs(4) + step[0] * step[1] * between;
        *self.at(6, e) += theirs(6) + step[5] * step[5] * between;
    }
}
