//! Refinement in the L2p norm with growing p; Guillaume, Schoukens, Pintelon and Kollar
//! (1991), "Crest-factor minimization using nonlinear Chebyshev approximation methods".
//!
//! A line `Re(d exp(i theta_n))` changes by `Re(b exp(i theta_n))` per unit of a parameter:
//! `b = i d` for its phase, `b = 1` and `b = i` for the two parts of a line of snow. The
//! normal matrix of the Gauss-Newton method on the residuals `x_n^p` then needs the
//! transform of the weights `w_n = x_n^(2p-2)` only,
//!
//! `sum_n w_n Re(b_j e^(i theta_j)) Re(b_k e^(i theta_k))
//!    = 1/2 Re(b_j b_k W(j+k) + b_j conj(b_k) W(j-k))`,  `W(m) = sum_n w_n e^(2 pi i m n/N)`,
//!
//! one transform instead of a product of matrices as long as the grid.

use super::{CrestProblem, check_oversampling};
use crate::excitation::ExcitationError;
use axisight_numerics::solve_positive;
use axisight_numerics::{LineGrid, LineTransform};
use nalgebra::{Complex, DMatrix};

/// Settings of the refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LpRefinement {
    /// First exponent 2p.
    pub first_exponent: u32,
    /// Last exponent 2p; it doubles in between.
    pub last_exponent: u32,
    /// Steps tried at each exponent, at most.
    pub iterations: usize,
    /// Grid, in multiples of the Nyquist count of the highest line; rounded up to a power
    /// of two.
    pub oversampling: usize,
}

impl Default for LpRefinement {
    fn default() -> Self {
        Self {
            first_exponent: 8,
            last_exponent: 2048,
            iterations: 100,
            oversampling: 16,
        }
    }
}

impl LpRefinement {
    pub(super) fn check(&self) -> Result<(), ExcitationError> {
        /// Powers this high are zero but at the peak itself.
        const HIGHEST: u32 = 1 << 16;
        let (first, last) = (self.first_exponent, self.last_exponent);
        if first < 4 || first % 2 == 1 || last < first || last > HIGHEST {
            let expected = format!("an even 4 <= first <= last <= {HIGHEST}");
            let got = format!("{first} to {last}");
            return Err(ExcitationError::new("refinement.exponent", expected, got));
        }
        check_oversampling("refinement.oversampling", self.oversampling)
    }
}

/// One parameter: the position of its line, and which part of it.
#[derive(Clone, Copy)]
enum Part {
    Phase(usize),
    Real(usize),
    Imaginary(usize),
}

/// The method made ready for one problem; shared between threads.
pub(super) struct Refiner<'a> {
    problem: &'a CrestProblem,
    settings: LpRefinement,
    parts: Vec<Part>,
    signal: LineTransform<f64>,
    /// Lines 0 to twice the highest.
    weights: LineTransform<f64>,
}

struct Work {
    coefficient: Vec<Complex<f64>>,
    grid: LineGrid<f64>,
    spare: LineGrid<f64>,
    gradient: Vec<Complex<f64>>,
    weight: Vec<Complex<f64>>,
}

impl<'a> Refiner<'a> {
    pub fn new(problem: &'a CrestProblem, settings: LpRefinement) -> Self {
        // Sums of two lines do not wrap around on this grid.
        let half = problem.half_grid(settings.oversampling);
        let high = problem.lines.iter().copied().max().unwrap_or(0);
        let mut parts: Vec<Part> = (0..problem.wanted()).map(Part::Phase).collect();
        for i in problem.wanted()..problem.lines.len() {
            parts.extend([Part::Real(i), Part::Imaginary(i)]);
        }
        Self {
            signal: LineTransform::new(half, &problem.lines),
            weights: LineTransform::new(half, &(0..=2 * high).collect::<Vec<_>>()),
            parts,
            problem,
            settings,
        }
    }

    /// Improve `coefficient`; returns the number of steps tried.
    pub fn run(&self, coefficient: &mut [Complex<f64>], stop: impl Fn() -> bool) -> usize {
        let zero = Complex::default();
        let mut work = Work {
            coefficient: coefficient.to_vec(),
            grid: self.signal.grid(),
            spare: self.signal.grid(),
            gradient: vec![zero; self.problem.lines.len()],
            weight: vec![zero; self.weights.lines().len()],
        };
        let mut exponent = self.settings.first_exponent;
        let (mut tried, mut damping) = (0, 1e-2);
        while exponent <= self.settings.last_exponent {
            tried += self.level(coefficient, exponent / 2, &mut damping, &mut work, &stop);
            exponent *= 2;
        }
        tried
    }

    /// Damped Gauss-Newton steps at one exponent 2p.
    fn level(
        &self,
        coefficient: &mut [Complex<f64>],
        p: u32,
        damping: &mut f64,
        work: &mut Work,
        stop: impl Fn() -> bool,
    ) -> usize {
        /// A step that gains less than this share of the norm ends the level.
        const WORTHWHILE: f64 = 2e-5;
        self.signal.synthesize(coefficient, &mut work.grid);
        let mut norm = lp_norm(&work.grid, p);
        let mut tried = 0;
        let mut fresh = true;
        let mut matrix = DMatrix::zeros(0, 0);
        while tried < self.settings.iterations && !stop() {
            if fresh {
                matrix = self.normal_matrix(coefficient, p, work);
            }
            tried += 1;
            let stepped = self.step(coefficient, &matrix, p, *damping, work);
            let better = stepped.filter(|new| *new < norm);
            fresh = better.is_some();
            let Some(new) = better else {
                *damping *= 6.0;
                continue;
            };
            coefficient.copy_from_slice(&work.coefficient);
            std::mem::swap(&mut work.grid, &mut work.spare);
            *damping = (*damping * 0.3).max(1e-9);
            let gain = 1.0 - new / norm;
            norm = new;
            if gain < WORTHWHILE {
                break;
            }
        }
        tried
    }

    /// Directions `b` of the parameters, as (position of the line, b).
    fn directions(&self, coefficient: &[Complex<f64>]) -> Vec<(usize, Complex<f64>)> {
        let i = Complex::new(0.0, 1.0);
        self.parts
            .iter()
            .map(|part| match *part {
                Part::Phase(at) => (at, i * coefficient[at]),
                Part::Real(at) => (at, Complex::new(1.0, 0.0)),
                Part::Imaginary(at) => (at, i),
            })
            .collect()
    }

    /// Lower half of the normal matrix; leaves the gradient's transform in `work`.
    fn normal_matrix(&self, coefficient: &[Complex<f64>], p: u32, work: &mut Work) -> DMatrix<f64> {
        let scale = 1.0 / work.grid.peak();
        work.spare
            .map_from(&work.grid, |x| power(x * scale, p) * x * scale);
        self.signal.analyze(&mut work.spare, &mut work.gradient);
        work.spare.map_from(&work.grid, |x| power(x * scale, p));
        self.weights.analyze(&mut work.spare, &mut work.weight);
        let lines = &self.problem.lines;
        let b = self.directions(coefficient);
        let mut matrix = DMatrix::zeros(b.len(), b.len());
        for (column, (at, second)) in b.iter().enumerate() {
            let k = lines[*at];
            for (row, (at, first)) in b.iter().enumerate().skip(column) {
                let j = lines[*at];
                // The transform of the weights holds conj(W).
                let sum = work.weight[j + k].conj();
                let difference = if j >= k {
                    work.weight[j - k].conj()
                } else {
                    work.weight[k - j]
                };
                let value = first * (second * sum + second.conj() * difference);
                matrix[(row, column)] = 0.5 * value.re;
            }
        }
        matrix
    }

    /// Try a step into `work.coefficient` and `work.spare`; the norm there.
    fn step(
        &self,
        coefficient: &[Complex<f64>],
        matrix: &DMatrix<f64>,
        p: u32,
        damping: f64,
        work: &mut Work,
    ) -> Option<f64> {
        let n = self.parts.len();
        let mean = (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n as f64;
        let mut damped = matrix.clone();
        for i in 0..n {
            damped[(i, i)] += damping * mean;
        }
        let b = self.directions(coefficient);
        let scale = work.grid.peak() / f64::from(p);
        let pull = |(at, b): &(usize, Complex<f64>)| -scale * (b * work.gradient[*at].conj()).re;
        let right: Vec<f64> = b.iter().map(pull).collect();
        let change = solve_positive(&damped, &right)?;
        work.coefficient.copy_from_slice(coefficient);
        for (i, part) in self.parts.iter().enumerate() {
            let delta = change[i];
            match *part {
                Part::Phase(at) => work.coefficient[at] *= Complex::from_polar(1.0, delta),
                Part::Real(at) => work.coefficient[at].re += delta,
                Part::Imaginary(at) => work.coefficient[at].im += delta,
            }
        }
        self.problem.project(&mut work.coefficient);
        self.signal.synthesize(&work.coefficient, &mut work.spare);
        Some(lp_norm(&work.spare, p)).filter(|norm| norm.is_finite())
    }
}

/// `x^(2p-2)`.
fn power(x: f64, p: u32) -> f64 {
    #[allow(clippy::cast_possible_wrap)] // exponents are small
    let p = p as i32;
    (x * x).powi(p - 1)
}

/// Mean-power norm `(mean x^(2p))^(1/(2p))`.
fn lp_norm(grid: &LineGrid<f64>, p: u32) -> f64 {
    let peak = grid.peak();
    let scale = 1.0 / peak;
    let term = |x: f64| power(x * scale, p) * (x * scale) * (x * scale);
    let sum: f64 = grid.pairs.iter().map(|v| term(v.re) + term(v.im)).sum();
    let mean = sum / (2 * grid.pairs.len()) as f64;
    peak * (mean.ln() / f64::from(2 * p)).exp()
}
