//! The clipping algorithm: Wernholt (2004), Algorithm 5.1, after Van der Ouderaa,
//! Schoukens and Renneboog (1988).

use super::{CrestProblem, check_oversampling};
use crate::excitation::ExcitationError;
use axisight_numerics::LineTransform;
use nalgebra::Complex;

/// Settings of the clipping algorithm.
///
/// In iteration `i` of `n` the signal is clipped at `level` times its peak, where `1 - level`
/// falls geometrically from `1 - first_level` to `1 - last_level`, transformed, and given
/// its amplitudes back. What is cut off is subtracted `relaxation` times: one is the
/// algorithm as published; over-relaxation gets as low in a fraction of the iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipping {
    /// Number of iterations.
    pub iterations: usize,
    /// Level at the beginning, relative to the peak.
    pub first_level: f64,
    /// Level at the end.
    pub last_level: f64,
    /// How many times the clipped part is subtracted.
    pub relaxation: f64,
    /// Grid, in multiples of the Nyquist count of the highest line; rounded up to a power
    /// of two. Below 8 peaks hide between samples.
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
        // Past 100 the steps are noise.
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

/// The algorithm made ready for one problem; shared between threads.
pub(super) struct Clipper<'a> {
    problem: &'a CrestProblem,
    settings: Clipping,
    // Phases need four digits while peaks are traded against each other; single precision
    // has seven and moves half the memory.
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

    /// Improve `coefficient` until the iterations are done or `stop` says so; returns how
    /// many were done.
    pub fn run(&self, coefficient: &mut [Complex<f64>], stop: impl Fn() -> bool) -> usize {
        /// Iterations between looks at the clock.
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
