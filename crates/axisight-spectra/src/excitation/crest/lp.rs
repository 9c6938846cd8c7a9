//! Refinement of the phases in the L2p norm with growing p.
//!
//! The method is that of Guillaume, Schoukens, Pintelon and Kollar (1991), "Crest-factor
//! minimization using nonlinear Chebyshev approximation methods".
//!
//! A line `Re(d exp(i theta_n))` changes by `Re(b exp(i theta_n))` per unit of a parameter.
//! `b = i d` is its phase; `b = 1` and `b = i` are the two parts of a snow line. The normal matrix
//! of the Gauss-Newton method for the residuals `x_n^p` then needs only the transform of the
//! weights `w_n = x_n^(2p-2)`,
//!
//! `sum_n w_n Re(b_j e^(i theta_j)) Re(b_k e^(i theta_k))
//!    = 1/2 Re(b_j b_k W(j+k) + b_j conj(b_k) W(j-k))`,  `W(m) = sum_n w_n e^(2 pi i m n/N)`.
//!
//! One transform replaces a product of matrices as long as the grid.
//!
//! The loop is `axisight_numerics::descent::search`, as for all fits, with a special
//! descent: phases turn, and every step is followed by a correction of the amplitudes. The matrix
//! has some thousand rows and is damped by the mean of its diagonal.

use super::{CrestProblem, check_oversampling};
use crate::excitation::ExcitationError;
use axisight_numerics::descent::{Damping, Descent, Progress, Rules, Step, search};
use axisight_numerics::{LineGrid, LineTransform, solve_positive};
use nalgebra::{Complex, DMatrix};

/// Settings of the refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LpRefinement {
    /// First exponent 2p.
    pub first_exponent: u32,
    /// Last exponent 2p. The exponent doubles from the first to the last.
    pub last_exponent: u32,
    /// Largest number of steps tried at each exponent.
    pub iterations: usize,
    /// Samples of the grid, in multiples of the Nyquist count of the highest line, rounded up to a
    /// power of two.
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
        /// At higher powers all samples but the peak itself vanish.
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

/// One parameter: a part of the line at this position.
#[derive(Clone, Copy)]
enum Part {
    Phase(usize),
    Real(usize),
    Imaginary(usize),
}

/// The method, prepared for one problem and shared between threads.
pub(super) struct Refiner<'a> {
    problem: &'a CrestProblem,
    settings: LpRefinement,
    parts: Vec<Part>,
    signal: LineTransform<f64>,
    /// Transform of the lines 0 to twice the highest line.
    weights: LineTransform<f64>,
}

/// The search at one exponent after the other. `coefficient` and `grid` hold the present point,
/// `next` and `spare` the trial.
struct Level<'a, 'b, F> {
    refiner: &'a Refiner<'b>,
    stop: F,
    coefficient: &'a mut [Complex<f64>],
    next: Vec<Complex<f64>>,
    grid: LineGrid<f64>,
    spare: LineGrid<f64>,
    gradient: Vec<Complex<f64>>,
    weight: Vec<Complex<f64>>,
    /// Normal matrix at the present point, computed on demand.
    matrix: Option<DMatrix<f64>>,
    p: u32,
    /// Norm at the present point.
    norm: f64,
    /// Norm at the trial, if it is finite.
    trial: Option<f64>,
    /// Steps tried at this exponent.
    tried: usize,
    /// Damping of the last step.
    damping: f64,
}

/// The reason to end the search: no more steps at this exponent, or at all.
struct Enough;

impl<'a> Refiner<'a> {
    pub fn new(problem: &'a CrestProblem, settings: LpRefinement) -> Self {
        // On this grid, the sum of two lines does not alias.
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

    /// Improve `coefficient` until all exponents are done or `stop` returns true; returns the
    /// number of steps tried.
    pub fn run(&self, coefficient: &mut [Complex<f64>], stop: impl Fn() -> bool) -> usize {
        /// A reduction below this share of the norm ends the level.
        const WORTHWHILE: f64 = 2e-5;
        let zero = Complex::default();
        let mut level = Level {
            refiner: self,
            stop,
            next: coefficient.to_vec(),
            coefficient,
            grid: self.signal.grid(),
            spare: self.signal.grid(),
            gradient: vec![zero; self.problem.lines.len()],
            weight: vec![zero; self.weights.lines().len()],
            matrix: None,
            p: 0,
            norm: 0.0,
            trial: None,
            tried: 0,
            damping: 1e-2,
        };
        let mut exponent = self.settings.first_exponent;
        let mut tried = 0;
        while exponent <= self.settings.last_exponent {
            level.begin(exponent / 2);
            let rules = Rules {
                max_iterations: self.settings.iterations,
                loss_tolerance: WORTHWHILE,
                progress: Progress::Gained { always: true },
                step_tolerance: 0.0,
                rounding: 0.0,
                settled: 0.0,
                damping: Damping::Constant {
                    start: level.damping,
                    shrink: 0.3,
                    grow: 6.0,
                    least: 1e-9,
                    failures: self.settings.iterations,
                },
            };
            if let Ok(outcome) = search(&mut level, &rules) {
                level.damping = outcome.damping;
            }
            tried += level.tried;
            exponent *= 2;
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
}
impl<F: Fn() -> bool> Level<'_, '_, F> {
    fn begin(&mut self, p: u32) {
        self.p = p;
        self.tried = 0;
        self.matrix = None;
        let signal = &self.refiner.signal;
        signal.synthesize(self.coefficient, &mut self.grid);
        self.norm = lp_norm(&self.grid, p);
    }

    /// Lower half of the normal matrix. Also leaves the transform for the gradient in `self`.
    fn normal_matrix(&mut self) -> DMatrix<f64> {
        let p = self.p;
        let scale = 1.0 / self.grid.peak();
        self.spare
            .map_from(&self.grid, |x| power(x * scale, p) * x * scale);
        let refiner = self.refiner;
        refiner.signal.analyze(&mut self.spare, &mut self.gradient);
        self.spare.map_from(&self.grid, |x| power(x * scale, p));
        refiner.weights.analyze(&mut self.spare, &mut self.weight);
        let lines = &refiner.problem.lines;
        let b = refiner.directions(self.coefficient);
        let mut matrix = DMatrix::zeros(b.len(), b.len());
        for (column, (at, second)) in b.iter().enumerate() {
            let k = lines[*at];
            for (row, (at, first)) in b.iter().enumerate().skip(column) {
                let j = lines[*at];
                // The transform of the weights is conj(W).
                let sum = self.weight[j + k].conj();
                let difference = if j >= k {
                    self.weight[j - k].conj()
                } else {
                    self.weight[k - j]
                };
                let value = first * (second * sum + second.conj() * difference);
                matrix[(row, column)] = 0.5 * value.re;
            }
        }
        matrix
    }

    /// Changes of all parameters by the damped Gauss-Newton step.
    fn change(&self, matrix: &DMatrix<f64>, damping: f64) -> Option<Vec<f64>> {
        let n = matrix.nrows();
        let mean = (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n as f64;
        let mut damped = matrix.clone();
        for i in 0..n {
            damped[(i, i)] += damping * mean;
        }
        let b = self.refiner.directions(self.coefficient);
        let scale = self.grid.peak() / f64::from(self.p);
        let pull = |(at, b): &(usize, Complex<f64>)| -scale * (b * self.gradient[*at].conj()).re;
        let right: Vec<f64> = b.iter().map(pull).collect();
        solve_positive(&damped, &right)
    }
}

impl<F: Fn() -> bool> Descent for Level<'_, '_, F> {
    type Error = Enough;

    fn loss(&self) -> f64 {
        self.norm
    }

    fn step(&mut self, damping: f64) -> Result<Option<Step>, Enough> {
        self.damping = damping;
        if self.tried == self.refiner.settings.iterations || (self.stop)() {
            return Err(Enough);
        }
        self.tried += 1;
        let matrix = match self.matrix.take() {
            Some(matrix) => matrix,
            None => self.normal_matrix(),
        };
        let change = self.change(&matrix, damping);
        self.matrix = Some(matrix);
        let Some(change) = change else {
            return Ok(None);
        };
        self.next.copy_from_slice(self.coefficient);
        for (part, delta) in self.refiner.parts.iter().zip(change) {
            match *part {
                Part::Phase(at) => self.next[at] *= Complex::from_polar(1.0, delta),
                Part::Real(at) => self.next[at].re += delta,
                Part::Imaginary(at) => self.next[at].im += delta,
            }
        }
        self.refiner.problem.project(&mut self.next);
        Ok(Some(Step::UNKNOWN))
    }

    fn attempt(&mut self) -> Result<Option<f64>, Enough> {
        let signal = &self.refiner.signal;
        signal.synthesize(&self.next, &mut self.spare);
        self.trial = Some(lp_norm(&self.spare, self.p)).filter(|norm| norm.is_finite());
        Ok(self.trial)
    }

    fn accept(&mut self) -> Result<(), Enough> {
        if let Some(norm) = self.trial.take() {
            self.norm = norm;
            self.coefficient.copy_from_slice(&self.next);
            std::mem::swap(&mut self.grid, &mut self.spare);
            self.matrix = None;
        }
        Ok(())
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
