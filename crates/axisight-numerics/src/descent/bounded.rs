//! Damped Gauss-Newton steps within bounds.

use super::{Descent, Normal, Step};
use nalgebra::{DMatrix, DVector};

/// A sum of squares and its derivatives at the present point.
///
/// All vectors hold the free parameters, in the order of [`Limits`].
pub trait LeastSquares {
    /// Data of an evaluation that [`LeastSquares::accept`] needs.
    type Trial;
    /// The reason why a search cannot go on.
    type Error;
    /// Normal equations at the present point.
    fn normal(&self) -> &Normal;
    /// Move `to`, the end of a step `from` the present point by the linear model, to a better end.
    fn land(&self, from: &[f64], to: &mut [f64]) {
        let _ = (from, to);
    }
    /// Loss at `theta`, or `None` where the model is not valid. Derivatives may be computed later,
    /// in [`LeastSquares::accept`].
    ///
    /// # Errors
    /// Any error ends the search.
    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Self::Trial)>, Self::Error>;
    /// Make `theta` the present point.
    ///
    /// # Errors
    /// Any error ends the search.
    fn accept(&mut self, theta: &[f64], trial: Self::Trial) -> Result<(), Self::Error>;
    /// Give up a trial, so that its memory can be reused.
    fn reject(&mut self, trial: Self::Trial) {
        drop(trial);
    }
}

/// Bounds and scales of the parameters, and the longest step.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Typical changes of the parameters, which serve as their units.
    pub scale: Vec<f64>,
    /// Limit of one step.
    pub reach: Reach,
    /// Whether the logarithm of a parameter is searched: the linear model then holds in the
    /// logarithm, and a step changes the parameter by at most [`Limits::LARGEST_FACTOR`]. Such a
    /// parameter is positive.
    pub logarithmic: Vec<bool>,
}

/// Limit of one step, because the linear model fails far from the minimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// A step may go to the bounds.
    Bounds,
    /// A step may have this many scales. A longer step is shortened as a whole.
    Scales(f64),
    /// A non-negative parameter changes by at most this factor in one step. A parameter near zero
    /// may go to zero. Moves are relative to the parameter, not to its scale.
    Factor(f64),
}

/// A parameter is near zero below this share of its scale.
const NEAR_ZERO: f64 = 1e-3;
/// A parameter counts as on a bound within this share of its scale.
const ON_BOUND: f64 = 1e-9;
/// Slopes below this share of the largest slope are neglected.
const SLIGHT: f64 = 1e-6;

impl Limits {
    /// Largest factor by which one step changes a parameter whose logarithm is searched.
    ///
    /// Resonances move with the root of a stiffness. Beyond a factor of two, a resonance passes the
    /// measured one by half an octave, and the linear model says nothing about what follows.
    pub const LARGEST_FACTOR: f64 = 2.0;

    /// End of a step of parameter `i`, before bounds are applied.
    fn reached(&self, i: usize, from: f64, step: f64) -> f64 {
        if self.logarithmic[i] {
            let most = Self::LARGEST_FACTOR.ln();
            return from * (step / from).clamp(-most, most).exp();
        }
        let to = from + step;
        match self.reach {
            Reach::Factor(f) if self.lower[i] >= 0.0 && from > NEAR_ZERO * self.scale[i] => {
                to.clamp(from / f, from * f)
            }
            _ => to,
        }
    }

    /// Factor that shortens the whole step.
    fn shortening(&self, step: &DVector<f64>) -> f64 {
        let Reach::Scales(longest) = self.reach else {
            return 1.0;
        };
        let lengths = step.iter().zip(&self.scale).map(|(x, s)| x.abs() / s);
        let length = lengths.fold(0.0, f64::max);
        if length > longest {
            longest / length
        } else {
            1.0
        }
    }

    /// Move of parameter `i` as the linear model counts it.
    fn counted(&self, i: usize, from: f64, to: f64) -> f64 {
        if self.logarithmic[i] {
            from * (to / from).ln()
        } else {
            to - from
        }
    }

    /// Move of parameter `i` relative to its size.
    fn share(&self, i: usize, from: f64, to: f64) -> f64 {
        if self.logarithmic[i] {
            return (to / from).ln().abs();
        }
        let size = match self.reach {
            Reach::Factor(_) => from.abs().max(NEAR_ZERO * self.scale[i]),
            Reach::Bounds | Reach::Scales(_) => self.scale[i],
        };
        (to - from).abs() / size
    }

    /// Indices of the parameters in `theta` that lie on a bound.
    pub fn at_bound(&self, theta: &[f64]) -> Vec<usize> {
        let near = |i: &usize| {
            let small = ON_BOUND * self.scale[*i];
            theta[*i] - self.lower[*i] <= small || self.upper[*i] - theta[*i] <= small
        };
        (0..theta.len()).filter(near).collect()
    }
}

/// Damped Gauss-Newton steps of a problem within its limits.
///
/// The damping follows Marquardt (1963), scaled by the diagonal, so that the units of the
/// parameters do not matter. A step ends at the minimum of the damped parabola within the bounds:
///
/// * A parameter that would leave its bounds is held on the bound, and the step of the other
///   parameters is computed again.
/// * If the new slope pulls a held parameter back from its bound, the parameter is released.
pub struct Bounded<'a, P: LeastSquares> {
    problem: &'a mut P,
    limits: &'a Limits,
    theta: Vec<f64>,
    next: Vec<f64>,
    change: Vec<f64>,
    /// Moves of the parameters that are held on a bound.
    held: Vec<Option<f64>>,
    /// Side of the bound: 1 for the upper bound, -1 for the lower bound.
    side: Vec<f64>,
    trial: Option<P::Trial>,
}

impl<'a, P: LeastSquares> Bounded<'a, P> {
    /// Start at the problem's present point `theta`, which must lie within the limits.
    pub fn new(problem: &'a mut P, limits: &'a Limits, theta: Vec<f64>) -> Self {
        let n = theta.len();
        Self {
            problem,
            limits,
            next: theta.clone(),
            theta,
            change: vec![0.0; n],
            held: vec![None; n],
            side: vec![0.0; n],
            trial: None,
        }
    }

    /// The present point.
    pub fn into_theta(self) -> Vec<f64> {
        self.theta
    }

    /// Cut `step` to the limits. Returns true if a parameter hit a bound on which it was not yet
    /// held.
    fn cut(&mut self, step: &DVector<f64>) -> bool {
        let limits = self.limits;
        let shortening = limits.shortening(step);
        let mut hit = false;
        for (i, from) in self.theta.iter().enumerate() {
            let (lower, upper) = (limits.lower[i], limits.upper[i]);
            let wanted = limits.reached(i, *from, shortening * step[i]);
            self.next[i] = wanted.clamp(lower, upper);
            self.change[i] = limits.counted(i, *from, self.next[i]);
            let beyond = wanted < lower || wanted > upper;
            if beyond && self.held[i].is_none() {
                self.held[i] = Some(self.change[i]);
                self.side[i] = if wanted > upper { 1.0 } else { -1.0 };
                hit = true;
            }
        }
        hit
    }

    /// Release the held parameter that the slope at the end of `step` pulls back from its bound
    /// most. Returns false if there is none.
    fn let_go(&mut self, step: &DVector<f64>, damping: f64) -> bool {
        let normal = self.problem.normal();
        let size = |i: usize| normal.matrix[(i, i)].sqrt();
        let slope = &normal.gradient + &normal.matrix * step;
        let largest = (0..step.len())
            .filter(|i| size(*i) > 0.0)
            .map(|i| (normal.gradient[i] / size(i)).abs())
            .fold(0.0, f64::max);
        let held = (0..step.len()).filter(|i| self.held[*i].is_some() && size(*i) > 0.0);
        let pull = |i: usize| {
            let damped = slope[i] + damping * normal.matrix[(i, i)] * step[i];
            self.side[i] * damped / size(i)
        };
        let most = held.max_by(|i, j| pull(*i).total_cmp(&pull(*j)));
        let Some(i) = most.filter(|i| pull(*i) > SLIGHT * largest) else {
            return false;
        };
        self.held[i] = None;
        true
    }
}

impl<P: LeastSquares> Descent for Bounded<'_, P> {
    type Error = P::Error;

    fn loss(&self) -> f64 {
        self.problem.normal().loss
    }

    fn step(&mut self, damping: f64) -> Result<Option<Step>, P::Error> {
        self.held.fill(None);
        // Active sets (Lawson, Hanson, 1974).
        let mut rounds = 3 * self.theta.len();
        loop {
            let Some(step) = damped(self.problem.normal(), damping, &self.held) else {
                return Ok(None);
            };
            if self.cut(&step) {
                continue;
            }
            rounds = rounds.saturating_sub(1);
            if rounds > 0 && self.let_go(&step, damping) {
                continue;
            }
            self.problem.land(&self.theta, &mut self.next);
            let bounds = self.limits.lower.iter().zip(&self.limits.upper);
            for (to, (lower, upper)) in self.next.iter_mut().zip(bounds) {
                *to = to.clamp(*lower, *upper);
            }
            let normal = self.problem.normal();
            let moves = self.theta.iter().zip(&self.next).enumerate();
            let shares = moves.map(|(i, (from, to))| self.limits.share(i, *from, *to));
            return Ok(Some(Step {
                worth: normal.promise(step.as_slice()),
                promise: normal.promise(&self.change),
                moved: shares.fold(0.0, f64::max),
            }));
        }
    }

    fn attempt(&mut self) -> Result<Option<f64>, P::Error> {
        let found = self.problem.attempt(&self.next)?;
        Ok(found.map(|(loss, trial)| {
            self.trial = Some(trial);
            loss
        }))
    }

    fn accept(&mut self) -> Result<(), P::Error> {
        if let Some(trial) = self.trial.take() {
            self.problem.accept(&self.next, trial)?;
            self.theta.copy_from_slice(&self.next);
        }
        Ok(())
    }

    fn reject(&mut self) {
        if let Some(trial) = self.trial.take() {
            self.problem.reject(trial);
        }
    }
}

/// `-(A + damping diag A)^-1 g` for given moves of the held parameters.
///
/// Parameters without influence on the residuals do not move. Returns `None` if the system has no
/// solution.
fn damped(normal: &Normal, damping: f64, held: &[Option<f64>]) -> Option<DVector<f64>> {
    let n = held.len();
    // Scaling to a unit diagonal avoids the loss of digits through the units.
    let size = |i: usize| {
        let own = normal.matrix[(i, i)].sqrt();
        if own > 0.0 { own } else { 1.0 }
    };
    let sizes = DVector::from_fn(n, |i, _| size(i));
    let mut a = DMatrix::from_fn(n, n, |i, j| normal.matrix[(i, j)] / (sizes[i] * sizes[j]));
    let moves = DVector::from_fn(n, |i, _| held[i].unwrap_or(0.0) * sizes[i]);
    let mut g = normal.gradient.component_div(&sizes) + &a * &moves;
    for i in 0..n {
        if held[i].is_some() || normal.matrix[(i, i)] <= 0.0 {
            a.row_mut(i).fill(0.0);
            a.column_mut(i).fill(0.0);
            g[i] = 0.0;
            a[(i, i)] = 1.0;
        }
        a[(i, i)] += damping;
    }
    let mut step = a.cholesky()?.solve(&g);
    step.neg_mut();
    step += moves;
    step.component_div_assign(&sizes);
    step.iter().all(|x| x.is_finite()).then_some(step)
}
