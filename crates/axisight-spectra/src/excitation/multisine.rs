//! Random-phase multisines, Wernholt (2004), (7.5).

use super::crest::clipped_phases;
use super::{ExcitationError, whole_samples};
use crate::ensemble::{Purpose, generator};
use axisight_numerics::Dft;
use rand::Rng;

/// The excited lines of the band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grid {
    /// All lines.
    All,
    /// Odd harmonics of the period only, which keeps even nonlinear distortion away from the lines.
    Odd,
}

/// A multisine with a flat amplitude spectrum, scaled to a given peak.
#[derive(Debug, Clone)]
pub struct Multisine {
    dft: Dft,
    lines: Vec<usize>,
    peak: f64,
    clipping: usize,
}

impl Multisine {
    /// A multisine with period `period_s` and the lines from `band_hz.0` to `band_hz.1`, both
    /// included. Its largest absolute sample is `peak` (in the unit of the signal).
    ///
    /// # Errors
    /// [`ExcitationError`] if the period is not a whole number of samples, the band contains no
    /// line or reaches the Nyquist frequency, or the peak is not a positive number.
    pub fn new(
        period_s: f64,
        band_hz: (f64, f64),
        grid: Grid,
        peak: f64,
        sample_time: f64,
    ) -> Result<Self, ExcitationError> {
        let n = whole_samples("multisine.period_s", period_s, sample_time)?;
        let (low, high) = band_hz;
        let nyquist = 0.5 / sample_time;
        if !(low > 0.0 && high >= low && high < nyquist) {
            let expected = format!("0 < low <= high < {nyquist} Hz (Nyquist)");
            let got = format!("{low} to {high}");
            return Err(ExcitationError::new("multisine.band_hz", expected, got));
        }
        if !(peak > 0.0 && peak.is_finite()) {
            let expected = "a positive number";
            return Err(ExcitationError::new("multisine.peak_rad_s", expected, peak));
        }
        // A line on the edge of the band belongs to the band, whatever the rounding.
        let near = 1e-9 * high * period_s;
        let inside = |k: &usize| {
            let x = *k as f64;
            x >= low * period_s - near && x <= high * period_s + near
        };
        let lines: Vec<usize> = (1..n.div_ceil(2))
            .filter(inside)
            .filter(|k| grid == Grid::All || k % 2 == 1)
            .collect();
        if lines.is_empty() {
            let expected = format!("a band that holds a multiple of 1/{period_s} Hz");
            let got = format!("{low} to {high}");
            return Err(ExcitationError::new("multisine.band_hz", expected, got));
        }
        Ok(Self {
            dft: Dft::new(n),
            lines,
            peak,
            clipping: 0,
        })
    }

    /// The same with this number of clipping iterations from the random phases of every
    /// realization, which lower the crest factor. Zero keeps the random phases.
    #[must_use]
    pub fn with_clipping(self, iterations: usize) -> Self {
        Self {
            clipping: iterations,
            ..self
        }
    }

    /// Excited lines, as multiples of one over the period.
    pub fn lines(&self) -> &[usize] {
        &self.lines
    }

    /// Transform of one period.
    pub fn dft(&self) -> &Dft {
        &self.dft
    }

    /// Phases of realization `run` [rad]: uniform over the circle, then clipped if wanted.
    pub fn phases(&self, seed: u64, run: u64) -> Vec<f64> {
        let random = random_phases(self.lines.len(), seed, run);
        match self.clipping {
            0 => random,
            iterations => clipped_phases(&self.lines, &random, iterations),
        }
    }

    /// One period with the given phases, scaled to the peak.
    ///
    /// The peak is the largest absolute sample. Between samples the signal may be higher by at most
    /// `1 - cos(pi f_max T)` to leading order, which is 0.2 % at 50 samples per period.
    pub fn period(&self, phases: &[f64]) -> Vec<f64> {
        let flat = vec![1.0; self.lines.len()];
        let mut x = self.dft.sum_of_sines(&self.lines, &flat, phases);
        let largest = x.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let scale = self.peak / largest;
        for v in &mut x {
            *v *= scale;
        }
        x
    }
}

/// `n` phases of realization `run` [rad], uniform over the circle.
pub fn random_phases(n: usize, seed: u64, run: u64) -> Vec<f64> {
    let mut rng = generator(seed, Purpose::Phases, run);
    let turn = std::f64::consts::TAU;
    (0..n).map(|_| rng.random::<f64>() * turn).collect()
}
