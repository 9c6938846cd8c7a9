//! Phases of a multisine that make its crest factor small.
//!
//! The crest factor is the peak divided by the *effective* rms, the rms of the wanted lines only
//! (Wernholt 2004, section 5.4). Power in extra lines ("snow") does not count.
//!
//! The peak is taken on a grid of at least [`FINE_GRID`] times the Nyquist count of the highest
//! line. There the error of a peak between two samples is at most `1 - cos(pi / 64)` = 0.12 %. A
//! parabola through three samples leaves less than 1e-5 of this error.

mod clipping;
mod lp;
mod search;

pub use clipping::Clipping;
pub use lp::LpRefinement;
pub use search::{Budget, Found, Start, search};

use super::ExcitationError;
use axisight_numerics::{LineGrid, LineTransform};
use clipping::Clipper;
use nalgebra::Complex;

/// Samples of the grid for peaks, in multiples of twice the highest line.
pub const FINE_GRID: usize = 32;

/// Phases after `iterations` of the clipping algorithm from the given phases [rad], for lines of
/// equal amplitude: Wernholt (2004), Algorithm 5.1.
///
/// `lines` are distinct and above zero, with one phase each.
#[must_use]
pub fn clipped_phases(lines: &[usize], phases: &[f64], iterations: usize) -> Vec<f64> {
    let problem = CrestProblem {
        lines: lines.to_vec(),
        amplitude: vec![1.0; lines.len()],
        snow_limit: 0.0,
    };
    let settings = Clipping {
        iterations,
        ..Clipping::default()
    };
    let mut found = problem.start(phases);
    Clipper::new(&problem, settings).run(&mut found, || false);
    found.into_iter().map(|d| polar(d).1).collect()
}

/// The wanted lines with their amplitudes, and the lines that may be added.
#[derive(Debug, Clone)]
pub struct CrestProblem {
    /// Wanted lines, then snow lines.
    lines: Vec<usize>,
    /// Amplitudes of the wanted lines, scaled so that the largest is about one.
    amplitude: Vec<f64>,
    /// Largest amplitude of a snow line.
    snow_limit: f64,
}

impl CrestProblem {
    /// A problem with wanted `lines` (multiples of one over the period), their amplitudes, and snow
    /// lines.
    ///
    /// The amplitude of a snow line is at most `snow_limit` times the root mean square of the
    /// wanted amplitudes.
    ///
    /// # Errors
    /// [`ExcitationError`] if there are no lines, a line is zero or comes twice, an amplitude is
    /// not positive, or the limit is negative.
    pub fn new(
        lines: &[usize],
        amplitude: &[f64],
        snow: &[usize],
        snow_limit: f64,
    ) -> Result<Self, ExcitationError> {
        /// A grid of 2^31 samples would take too long.
        const MOST: usize = 1 << 24;
        if lines.is_empty() || lines.len() != amplitude.len() {
            let expected = format!("{} numbers, one per line, at least one", lines.len());
            return Err(ExcitationError::new("amplitude", expected, amplitude.len()));
        }
        let mut all = lines.to_vec();
        all.extend(snow);
        let mut sorted = all.clone();
        sorted.sort_unstable();
        if sorted.first() == Some(&0) || sorted.windows(2).any(|w| w[0] == w[1]) {
            let expected = "lines from 1, each once, snow apart from the others";
            return Err(ExcitationError::new(
                "lines",
                expected,
                "a zero or a repetition",
            ));
        }
        if let Some(high) = sorted.last().filter(|k| **k > MOST) {
            return Err(ExcitationError::new(
                "lines",
                format!("at most {MOST}"),
                high,
            ));
        }
        if let Some(bad) = amplitude.iter().find(|a| !(a.is_finite() && **a > 0.0)) {
            return Err(ExcitationError::new("amplitude", "positive numbers", bad));
        }
        if !(snow_limit.is_finite() && snow_limit >= 0.0) {
            let expected = "a number not below zero";
            return Err(ExcitationError::new("snow_limit", expected, snow_limit));
        }
        let mean_square = amplitude.iter().map(|a| a * a).sum::<f64>() / amplitude.len() as f64;
        let scale = 1.0 / mean_square.sqrt();
        Ok(Self {
            lines: all,
            amplitude: amplitude.iter().map(|a| a * scale).collect(),
            snow_limit,
        })
    }

    /// Number of wanted lines.
    pub fn wanted(&self) -> usize {
        self.amplitude.len()
    }

    /// Effective rms, in the units of the coefficients.
    fn rms(&self) -> f64 {
        (0.5 * self.wanted() as f64).sqrt()
    }

    /// Pairs of samples of a grid of `oversampling` times the Nyquist count, rounded up to a power
    /// of two.
    fn half_grid(&self, oversampling: usize) -> usize {
        let high = self.lines.iter().copied().max().unwrap_or(1);
        (oversampling * high).next_power_of_two()
    }

    /// Coefficients with the given phases of the wanted lines, without snow.
    fn start(&self, phases: &[f64]) -> Vec<Complex<f64>> {
        let wanted = self.amplitude.iter().zip(phases);
        let mut d: Vec<_> = wanted.map(|(a, p)| sine(*a, *p)).collect();
        d.resize(self.lines.len(), Complex::default());
        d
    }

    /// Restore the amplitudes and keep the phases.
    fn project(&self, coefficient: &mut [Complex<f64>]) {
        for (i, d) in coefficient.iter_mut().enumerate() {
            let size = d.norm();
            match self.amplitude.get(i) {
                Some(a) if size > 0.0 => *d = d.scale(a / size),
                Some(a) => *d = Complex::new(*a, 0.0),
                None if size > self.snow_limit => *d = d.scale(self.snow_limit / size),
                None => {}
            }
        }
    }
}

/// Evaluates crest factors on the fine grid.
pub struct FineGrid {
    transform: LineTransform<f64>,
    grid: LineGrid<f64>,
    rms: f64,
}

impl FineGrid {
    /// A grid for the coefficients of `problem`.
    pub fn new(problem: &CrestProblem) -> Self {
        let transform = LineTransform::new(problem.half_grid(FINE_GRID), &problem.lines);
        Self {
            grid: transform.grid(),
            rms: problem.rms(),
            transform,
        }
    }

    /// Crest factor of the signal with these coefficients.
    pub fn crest_factor(&mut self, coefficient: &[Complex<f64>]) -> f64 {
        self.transform.synthesize(coefficient, &mut self.grid);
        let highest = self.grid.peak();
        let pairs = &self.grid.pairs;
        let n = 2 * pairs.len();
        let sample = |i: usize| {
            let pair = pairs[(i % n) / 2];
            if i.is_multiple_of(2) {
                pair.re
            } else {
                pair.im
            }
        };
        let mut peak = highest;
        // Between samples, a lower sample cannot rise above the highest one.
        for i in (n..2 * n).filter(|i| sample(*i).abs() > 0.998 * highest) {
            let sign = sample(i).signum();
            let [before, here, after] = [i - 1, i, i + 1].map(|i| sign * sample(i));
            let bend = before - 2.0 * here + after;
            if here >= before && here >= after && bend < 0.0 {
                peak = peak.max(here - (before - after).powi(2) / (8.0 * bend));
            }
        }
        peak / self.rms
    }
}

/// Largest absolute value of `sum_k a_k sin(2 pi k t + phase_k)`.
///
/// # Errors
/// [`ExcitationError`] for lines and amplitudes that [`CrestProblem::new`] refuses.
pub fn peak(lines: &[usize], amplitude: &[f64], phase: &[f64]) -> Result<f64, ExcitationError> {
    let problem = CrestProblem::new(lines, amplitude, &[], 0.0)?;
    let scale = amplitude.iter().map(|a| a * a).sum::<f64>() * 0.5;
    let crest_factor = FineGrid::new(&problem).crest_factor(&problem.start(phase));
    Ok(crest_factor * scale.sqrt())
}

fn check_oversampling(field: &'static str, value: usize) -> Result<(), ExcitationError> {
    // From 4 on, the sum of two lines stays below the Nyquist line of the grid.
    if (4..=64).contains(&value) {
        return Ok(());
    }
    Err(ExcitationError::new(field, "4 to 64", value))
}

/// `a sin(x + phase)` as the real part of `d exp(i x)`; returns `d`.
fn sine(amplitude: f64, phase: f64) -> Complex<f64> {
    let (sin, cos) = phase.sin_cos();
    Complex::new(amplitude * sin, -amplitude * cos)
}

/// Amplitude and phase of a coefficient, the inverse of [`sine`].
fn polar(d: Complex<f64>) -> (f64, f64) {
    (d.norm(), d.re.atan2(-d.im))
}
