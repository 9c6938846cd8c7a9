//! Zero-phase weighting of a series over frequency, with decimation.
//!
//! The series is extended by reflection, so that its ends make no step. It is then transformed,
//! multiplied by a real weight, and transformed back at a lower rate. White input of variance `s^2`
//! with weight `1/s` has an output of variance one, whatever the decimation. The cost is two
//! transforms, `O(n log n)`.

use crate::plan::plan;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::sync::Arc;

/// A weight over frequency for one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Weighting {
    /// Frequencies of the table [Hz], increasing.
    pub frequency_hz: Vec<f64>,
    /// Weights at those frequencies; linear in between, constant outside.
    pub weight: Vec<f64>,
    /// Keep one output sample of this many. Nothing above the new Nyquist frequency passes.
    pub decimation: usize,
}

/// Error: a weighting has an invalid field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("weighting: {field}: expected {expected}, got {got}")]
pub struct WeightingError {
    /// Name of the field.
    pub field: &'static str,
    /// Expected value.
    pub expected: &'static str,
    /// Actual value.
    pub got: String,
}

/// A weighting with its transforms, for one series length.
pub struct Weighter {
    kept: usize,
    decimation: usize,
    gain: Vec<f64>,
    forward: Arc<dyn Fft<f64>>,
    backward: Arc<dyn Fft<f64>>,
}

impl Weighting {
    /// No weighting and no decimation.
    pub fn flat() -> Self {
        Self {
            frequency_hz: vec![0.0],
            weight: vec![1.0],
            decimation: 1,
        }
    }

    /// Check frequencies, weights and decimation.
    ///
    /// # Errors
    /// [`WeightingError`] that names the invalid field.
    pub fn validate(&self) -> Result<(), WeightingError> {
        let fail = |field, expected, got: String| {
            Err(WeightingError {
                field,
                expected,
                got,
            })
        };
        if self.frequency_hz.is_empty() || self.frequency_hz.len() != self.weight.len() {
            let got = format!("{} and {}", self.frequency_hz.len(), self.weight.len());
            return fail(
                "weight",
                "as many weights as frequencies, at least one",
                got,
            );
        }
        if !self.frequency_hz.windows(2).all(|w| w[0] < w[1]) {
            return fail(
                "frequency_hz",
                "increasing frequencies",
                format!("{:?}", self.frequency_hz),
            );
        }
        if !self.weight.iter().all(|w| w.is_finite() && *w >= 0.0) {
            return fail(
                "weight",
                "finite weights not below zero",
                format!("{:?}", self.weight),
            );
        }
        if self.decimation == 0 {
            return fail("decimation", "at least 1", "0".to_owned());
        }
        Ok(())
    }

    fn at(&self, frequency_hz: f64) -> f64 {
        let next = self.frequency_hz.partition_point(|f| *f <= frequency_hz);
        let (Some(after), Some(before)) = (self.weight.get(next), next.checked_sub(1)) else {
            let edge = if next == 0 {
                self.weight.first()
            } else {
                self.weight.last()
            };
            return edge.copied().unwrap_or(0.0);
        };
        let (f0, f1) = (self.frequency_hz[before], self.frequency_hz[next]);
        let share = (frequency_hz - f0) / (f1 - f0);
        self.weight[before] + share * (after - self.weight[before])
    }

    /// Number of output samples for a series of `n_samples`.
    pub fn output_len(&self, n_samples: usize) -> usize {
        n_samples / self.decimation
    }

    /// A plan for series of `n_samples`, sampled every `sample_time` seconds.
    pub fn plan(&self, n_samples: usize, sample_time: f64) -> Weighter {
        let kept = self.output_len(n_samples);
        let (long, short) = (2 * kept * self.decimation, 2 * kept);
        let scale = (self.decimation as f64).sqrt() / long.max(1) as f64;
        let resolution = 1.0 / (long.max(1) as f64 * sample_time);
        // The bin at the new Nyquist frequency is ambiguous, so decimation drops it.
        let gain = (0..=kept)
            .map(|k| {
                let dropped = k == kept && self.decimation > 1;
                if dropped {
                    0.0
                } else {
                    self.at(k as f64 * resolution) * scale
                }
            })
            .collect();
        Weighter {
            kept,
            decimation: self.decimation,
            gain,
            forward: plan(long, FftDirection::Forward),
            backward: plan(short, FftDirection::Inverse),
        }
    }
}

impl Weighter {
    /// Weight two series at once, as the real and imaginary parts of one series. The weight is real
    /// and even, so the two do not mix.
    ///
    /// A power of two brings each series to the same size. Otherwise, with different units, the
    /// rounding of the larger series would drown the smaller one. A series of zeros stays zero.
    pub fn apply_pair(&self, a: &[f64], b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let half = self.kept * self.decimation;
        let ((down_a, up_a), (down_b, up_b)) = (to_one(&a[..half]), to_one(&b[..half]));
        let number = |i: usize| Complex::new(a[i] * down_a, b[i] * down_b);
        let mut long: Vec<Complex<f64>> = (0..half).map(number).collect();
        long.extend((0..half).rev().map(number));
        self.forward.process(&mut long);
        let (n_long, n_short) = (long.len(), 2 * self.kept);
        let mut short = vec![Complex::new(0.0, 0.0); n_short];
        for k in 0..=self.kept {
            if k < n_short {
                short[k] = long[k] * self.gain[k];
            }
            if k > 0 && k < self.kept {
                short[n_short - k] = long[n_long - k] * self.gain[k];
            }
        }
        self.backward.process(&mut short);
        let kept = short.iter().take(self.kept);
        kept.map(|c| (c.re * up_a, c.im * up_b)).unzip()
    }
}

/// The power of two that brings the largest magnitude of a series near one, and its inverse. Both
/// are zero for a series of zeros.
fn to_one(x: &[f64]) -> (f64, f64) {
    let largest = x.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if largest == 0.0 && !x.iter().any(|x| x.is_nan()) {
        return (0.0, 0.0);
    }
    if !largest.is_normal() {
        return (1.0, 1.0);
    }
    // The exponent of a finite number lies between -1022 and 1023. The narrower range keeps both
    // powers normal.
    #[allow(clippy::cast_possible_truncation)]
    let exponent = largest.log2().clamp(-1000.0, 1000.0) as i32;
    (2f64.powi(-exponent), 2f64.powi(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn flat_weight_returns_the_series() {
        let x: Vec<f64> = (0..50)
            .map(|i| (f64::from(i) * 0.37).sin() + 0.1 * f64::from(i))
            .collect();
        let y: Vec<f64> = x.iter().map(|v| 1.0 - v * v).collect();
        let (a, b) = Weighting::flat().plan(50, 0.01).apply_pair(&x, &y);
        for i in 0..50 {
            assert!((a[i] - x[i]).abs() < 1e-13 && (b[i] - y[i]).abs() < 1e-13);
        }
    }

    /// The two series differ as much as torque per backlash [Nm/rad] and per cubic stiffness
    /// [Nm/(Nm/rad^3)].
    #[test]
    fn a_series_does_not_drown_in_a_larger_one() {
        let x: Vec<f64> = (0..60)
            .map(|i| 1e-14 * (f64::from(i) * 0.37).sin())
            .collect();
        let y: Vec<f64> = (0..60).map(|i| 1e6 * (f64::from(i) * 0.11).cos()).collect();
        let plan = Weighting::flat().plan(60, 0.01);
        let ((a, _), (_, b)) = (plan.apply_pair(&x, &y), plan.apply_pair(&y, &x));
        for i in 0..60 {
            // The tolerance is a few rounding errors of the largest entry.
            assert!((a[i] - x[i]).abs() < 1e-28 && (b[i] - x[i]).abs() < 1e-28);
        }
        assert!(plan.apply_pair(&y, &[0.0; 60]).1.iter().all(|v| *v == 0.0));
        assert!(plan.apply_pair(&[0.0; 60], &y).0.iter().all(|v| *v == 0.0));
        // Values that are not finite stay visible in the output.
        let (a, _) = plan.apply_pair(&[f64::NAN; 60], &y);
        let (b, _) = plan.apply_pair(&[f64::INFINITY; 60], &y);
        assert!(a.iter().chain(&b).all(|v| !v.is_finite()));
    }

    #[test]
    fn decimated_low_frequency_keeps_its_shape() {
        let weighting = Weighting {
            decimation: 8,
            ..Weighting::flat()
        };
        let cosine = |i: usize| (std::f64::consts::PI * 3.0 * (i as f64 + 0.5) / 800.0).cos();
        let x: Vec<f64> = (0..800).map(cosine).collect();
        let (a, _) = weighting.plan(800, 1.0).apply_pair(&x, &x);
        for (j, value) in a.iter().enumerate() {
            // The variance per sample is kept, so the amplitude grows by sqrt(decimation).
            assert!((value / 8f64.sqrt() - cosine(8 * j)).abs() < 1e-12);
        }
    }

    #[test]
    fn white_noise_keeps_unit_variance() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let noise: Vec<f64> = (0..40_000)
            .map(|_| 2.0 * rng.sample::<f64, _>(rand_distr::StandardNormal))
            .collect();
        let weighting = Weighting {
            frequency_hz: vec![0.0],
            weight: vec![0.5],
            decimation: 5,
        };
        let (a, _) = weighting.plan(40_000, 1e-3).apply_pair(&noise, &noise);
        let variance = a.iter().map(|v| v * v).sum::<f64>() / a.len() as f64;
        // The tolerance is five standard deviations of the estimate: sqrt(2 / 8000) = 0.016.
        assert!((variance - 1.0).abs() < 0.08, "{variance}");
    }
}
