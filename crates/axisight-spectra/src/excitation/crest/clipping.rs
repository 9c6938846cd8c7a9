//! The clipping algorithm: Wernholt (2004), Algorithm 5.1, after Van der Ouderaa,
//! Schoukens and Renneboog (1988).

use super::{CrestProblem, check_oversampling};
use crate::excitation::ExcitationError;
use axisight_numerics::LineTransform;
use nalgebra::Complex;

/// Settings of the clipping algorithm.
///
/// Iteration `i` of `n` clips the signal at `level` times its peak, transforms it, and restores its
/// amplitudes. `1 - level` falls geometrically from `1 - first_level` to `1 - last_level`.
///
/// The clipped part is subtracted `relaxation` times. The published algorithm has a factor of one;
/// a larger factor reaches the same crest factor in fewer iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipping {
    /// Number of iterations.
    pub iterations: usize,
    /// Level at the beginning, relative to the peak.
    pub first_level: f64,
    /// Level at the end, relative to the peak.
    pub last_level: f64,
    /// Factor by which the clipped part is subtracted.
    pub relaxation: f64,
    /// Samples of the grid, in multiples of the Nyquist count of the highest line, rounded up to a
    /// power of two. Below 8, the grid misses peaks between samples.
    pub oversampling: usize,
}

impl Default for Clipping {
    fn default() -> Self {
        Self {
            iterations: 300,
            first_level: 0.7,
            last_level: 0.999,
            relaxation: 4.0,
            oversampling: 8,
        }
    }
}

impl Clipping {
    pub(super) fn check(&self) -> Result<(), ExcitationError> {
        let fraction = |x: f64| x > 0.0 && x < 1.0;
        let levels = [
            ("clipping.first_level", self.first_level),
            ("clipping.last_level", self.last_level),
        ];
        if let Some((field, level)) = levels.into_iter().find(|(_, level)| !fraction(*level)) {
            return Err(ExcitationError::new(field, "between 0 and 1", level));
        }
        // Steps with a factor above 100 are noise.
        if !(self.relaxation > 0.0 && self.relaxation <= 100.0) {
            let expected = "above 0, up to 100";
            return Err(ExcitationError::new(
                "clipping.relaxation",
                expected,
                self.relaxation,
            ));
        }
        check_oversampling("clipping.oversampling", self.oversampling)
    }
}

/// The algorithm, prepared for one problem and shared between threads.
pub(super) struct Clipper<'a> {
    problem: &'a CrestProblem,
    settings: Clipping,
    // Phases need four digits while peaks are traded against each other. Single precision has seven
    // digits and halves the memory traffic.
    transform: LineTransform<f32>,
    amplitude: Vec<f32>,
}

impl<'a> Clipper<'a> {
    pub fn new(problem: &'a CrestProblem, settings: Clipping) -> Self {
        let half = problem.half_grid(settings.oversampling);
        Self {
            transform: LineTransform::new(half, &problem.lines),
            amplitude: problem.amplitude.iter().map(|a| single(*a)).collect(),
            problem,
            settings,
        }
    }

    /// Improve `coefficient` until all iterations are done or `stop` returns true; returns the
    /// number of iterations.
    pub fn run(&self, coefficient: &mut [Complex<f64>], stop: impl Fn() -> bool) -> usize {
        /// Number of iterations between two calls of `stop`.
        const WATCH: usize = 64;
        let Clipping {
            iterations,
            first_level,
            last_level,
            relaxation,
            ..
        } = self.settings;
        let mut d: Vec<Complex<f32>> = coefficient
            .iter()
            .map(|c| Complex::new(single(c.re), single(c.im)))
            .collect();
        let mut grid = self.transform.grid();
        let limit = single(self.problem.snow_limit);
        let fall = (1.0 - last_level) / (1.0 - first_level);
        let mut done = 0;
        while done < iterations && !(done % WATCH == 0 && stop()) {
            let progress = done as f64 / (iterations.max(2) - 1) as f64;
            let level = 1.0 - (1.0 - first_level) * fall.powf(progress);
            self.transform.synthesize(&d, &mut grid);
            let bound = single(level) * grid.peak();
            let over = single(relaxation);
            for v in &mut grid.pairs {
                v.re += over * (v.re.clamp(-bound, bound) - v.re);
                v.im += over * (v.im.clamp(-bound, bound) - v.im);
            }
            self.transform.analyze(&mut grid, &mut d);
            let (wanted, snow) = d.split_at_mut(self.amplitude.len());
            for (d, a) in wanted.iter_mut().zip(&self.amplitude) {
                let size = d.norm_sqr();
                *d = if size > 0.0 {
                    *d * (a / size.sqrt())
                } else {
                    Complex::new(*a, 0.0)
                };
            }
            for d in snow {
                let size = d.norm();
                if size > limit {
                    *d *= limit / size;
                }
            }
            done += 1;
        }
        for (c, d) in coefficient.iter_mut().zip(&d) {
            *c = Complex::new(f64::from(d.re), f64::from(d.im));
        }
        self.problem.project(coefficient);
        done
    }
}

#[allow(clippy::cast_possible_truncation)] // rounding is the point
fn single(x: f64) -> f32 {
    x as f32
}
