//! Smoothed square wave, which keeps motors away from standstill; Wernholt (2004), (7.3).

use super::{ExcitationError, whole_samples};

/// A smoothed square wave, high in the first half of its period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    /// Amplitude, in the unit of the signal.
    pub amplitude: f64,
    /// Samples per period, even.
    samples: usize,
    /// Half length `l` of the triangular window, in samples.
    smoothing: usize,
}

impl Square {
    /// A square wave of period `period_s` and the given amplitude.
    ///
    /// It is smoothed by the triangular moving average `w_k = (l + 1 - |k|) / (l + 1)^2` with
    /// `l = smoothing` samples on each side.
    ///
    /// # Errors
    /// [`ExcitationError`] if the period is not an even whole number of samples, the window is
    /// longer than half a period, or the amplitude is not a number.
    pub fn new(
        amplitude: f64,
        period_s: f64,
        smoothing: usize,
        sample_time: f64,
    ) -> Result<Self, ExcitationError> {
        let samples = whole_samples("square.period_s", period_s, sample_time)?;
        if samples % 2 == 1 {
            let expected = "an even number of samples";
            return Err(ExcitationError::new("square.period_s", expected, samples));
        }
        if 2 * smoothing + 1 > samples / 2 {
            let expected = format!("fewer than {} samples", samples / 4);
            return Err(ExcitationError::new(
                "square.smoothing",
                expected,
                smoothing,
            ));
        }
        if !amplitude.is_finite() || amplitude < 0.0 {
            let expected = "a number not below zero";
            return Err(ExcitationError::new(
                "square.amplitude_rad_s",
                expected,
                amplitude,
            ));
        }
        Ok(Self {
            amplitude,
            samples,
            smoothing,
        })
    }

    /// Samples per period.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// One period.
    pub fn period(&self) -> Vec<f64> {
        let n = self.samples;
        let reach = self.smoothing + 1;
        let weight = |k: usize| (reach - k) as f64 / (reach * reach) as f64;
        let level = |i: usize| {
            if i % n < n / 2 {
                self.amplitude
            } else {
                -self.amplitude
            }
        };
        (0..n)
            .map(|i| {
                let sides = (1..reach).map(|k| weight(k) * (level(i + k) + level(i + n - k)));
                weight(0) * level(i) + sides.sum::<f64>()
            })
            .collect()
    }
}
