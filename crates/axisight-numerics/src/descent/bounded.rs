//! Damped Gauss-Newton steps within bounds.

use super::{Descent, Normal, Step};
use nalgebra::{DMatrix, DVector};

/// A sum of squares with its derivatives at the present point.
///
/// Parameters are the free ones, in the order of [`Limits`].
pub trait LeastSquares {
    /// What an evaluation leaves for [`LeastSquares::accept`].
    type Trial;
    /// Why a search cannot go on.
    type Error;
    /// Normal equations at the present point.
    fn normal(&self) -> &Normal;
    /// Where a step `from` the present point that ends at `to` by the linear model had better end.
    fn land(&self, from: &[f64], to: &mut [f64]) {
        let _ = (from, to);
    }
    /// Loss at `theta`, `None` where the model does not hold. Derivatives may wait until the
    /// point is accepted.
    ///
    /// # Errors
    /// Ends the search.
    fn attempt(&mut self, theta: &[f64]) -> Result<Option<(f64, Self::Trial)>, Self::Error>;
    /// `theta` becomes the present point.
    ///
    /// # Errors
    /// Ends the search.
    fn accept(&mut self, theta: &[f64], trial: Self::Trial) -> Result<(), Self::Error>;
    /// A trial that is given up: its memory may serve again.
    fn reject(&mut self, trial: Self::Trial) {
        drop(trial);
    }
}

/// How far parameters may go.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Sizes of natural changes.
    pub scale: Vec<f64>,
    /// How far in one step.
    pub reach: Reach,
}

/// How far one step goes: far from the minimum it may promise nonsense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// To the bounds.
    Bounds,
    /// As many scales; a longer step is shortened as a whole.
    Scales(f64),
    /// A parameter that cannot be negative changes by this factor at most; what is left near
    /// zero may go there. Moves are shares of the parameter itself, not of its scale.
    Factor(f64),
}

/// Share of its scale below which a parameter is near zero.
const NEAR_ZERO: f64 = 1e-3;
/// Share of its scale by which a parameter on a bound may be off it.
const ON_BOUND: f64 = 1e-9;
/// Of the largest slope: one that leads nowhere.
const SLIGHT: f64 = 1e-6;

impl Limits {
    /// Where a step of parameter `i` ends, bounds apart.
    fn reached(&self, i: usize, from: f64, step: f64) -> f64 {
        let to = from + step;
        match self.reach {
            Reach::Factor(f) if self.lower[i] >= 0.0 && from > NEAR_ZERO * self.scale[i] => {
                to.clamp(from / f, from * f)
            }
            _ => to,
        }
    }

    /// Factor by which the whole step is shortened.
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

    /// Move of parameter `i` as a share of its size.
    fn share(&self, i: usize, from: f64, to: f64) -> f64 {
        let size = match self.reach {
            Reach::Factor(_) => from.abs().max(NEAR_ZERO * self.scale[i]),
            Reach::Bounds | Reach::Scales(_) => self.scale[i],
        };
        (to - from).abs() / size
    }

    /// Parameters of `theta` that lie on a bound.
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
/// Marquardt (1963) with his scaling by the diagonal, which makes the units of the parameters
/// irrelevant. A parameter that a step takes beyond a bound goes to the bound, and the step of the
/// others is found anew: what they were to make up for does not happen. Where that pulls it back
/// from the bound it is let go again, so that a step ends where the damped parabola is least within
/// the bounds.
pub struct Bounded<'a, P: LeastSquares> {
    problem: &'a mut P,
    limits: &'a Limits,
    theta: Vec<f64>,
    next: Vec<f64>,
    change: Vec<f64>,
    /// Moves of parameters that go to a bound, or stay on it.
    held: Vec<Option<f64>>,
    /// Which bound that is: one for the upper, minus one for the lower.
    side: Vec<f64>,
    trial: Option<P::Trial>,
}

impl<'a, P: LeastSquares> Bounded<'a, P> {
    /// From the problem's present point `theta`, which lies within the limits.
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

    /// Cut `step` to what the limits allow; whether a parameter is pushed over a bound that was not
    /// held before.
    fn cut(&mut self, step: &DVector<f64>) -> bool {
        let limits = self.limits;
        let shortening = limits.shortening(step);
        let mut hit = false;
        for (i, from) in self.theta.iter().enumerate() {
            let (lower, upper) = (limits.lower[i], limits.upper[i]);
            let wanted = limits.reached(i, *from, shortening * step[i]);
            self.next[i] = wanted.clamp(lower, upper);
            self.change[i] = self.next[i] - from;
            let beyond = wanted < lower || wanted > upper;
            if beyond && self.held[i].is_none() {
                self.held[i] = Some(self.change[i]);
                self.side[i] = if wanted > upper { 1.0 } else { -1.0 };
                hit = true;
            }
        }
        hit
    }

    /// Let go of the held parameter that the slope at the end of `step` pulls back from its bound
    /// most; whether there is one.
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
        // Active sets (Lawson, Hanson, 1974): what meets its bound is held there, and let go again.
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

/// `-(A + damping diag A)^-1 g`, given the moves of held parameters, nothing for those without
/// influence; `None` where that has no solution.
fn damped(normal: &Normal, damping: f64, held: &[Option<f64>]) -> Option<DVector<f64>> {
    let n = held.len();
    // Scaled to unit diagonal, the matrix loses no digits to units.
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
