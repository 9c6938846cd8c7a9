//! The search loop: damping, acceptance of steps, stopping rules.

use super::Status;

/// The properties of a damped step that the search uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Reduction of the loss by the linear model, before bounds cut the step. It is zero at a
    /// minimum.
    pub worth: f64,
    /// Reduction of the loss by the linear model at the trial point, after bounds have cut the
    /// step.
    pub promise: f64,
    /// Largest move of a parameter, relative to its size.
    pub moved: f64,
}

impl Step {
    /// A step whose properties are unknown before it is tried.
    pub const UNKNOWN: Self = Self {
        worth: f64::INFINITY,
        promise: f64::INFINITY,
        moved: f64::INFINITY,
    };
}

/// A present point, the steps from it, and a trial point.
pub trait Descent {
    /// The reason why a search cannot go on.
    type Error;
    /// Loss at the present point.
    fn loss(&self) -> f64;
    /// Compute the step with this damping, or return `None` if there is none.
    ///
    /// # Errors
    /// Any error ends the search.
    fn step(&mut self, damping: f64) -> Result<Option<Step>, Self::Error>;
    /// Evaluate the loss at the end of the last step, or return `None` where the model is not
    /// valid.
    ///
    /// # Errors
    /// Any error ends the search.
    fn attempt(&mut self) -> Result<Option<f64>, Self::Error>;
    /// Make the trial point the present point.
    ///
    /// # Errors
    /// Any error ends the search.
    fn accept(&mut self) -> Result<(), Self::Error>;
    /// Give up the trial point.
    fn reject(&mut self) {}
}

/// How the damping changes after success and failure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Damping {
    /// The damping follows the ratio of actual to predicted reduction: Nielsen (1999), *Damping
    /// parameter in Marquardt's method*. The derivatives must belong to the present point.
    Kept {
        /// Damping of the first step.
        start: f64,
    },
    /// The damping changes by constant factors. Use this rule if predictions are unreliable,
    /// because derivatives are reused from another point or partly left out.
    Constant {
        /// Damping of the first step.
        start: f64,
        /// Factor after a success.
        shrink: f64,
        /// Factor after a failure.
        grow: f64,
        /// Smallest damping.
        least: f64,
        /// Failures in a row after which the search gives up.
        failures: usize,
    },
}

impl Damping {
    /// The rule of Nielsen, for a start near the minimum.
    pub const KEPT: Self = Self::Kept { start: 1e-3 };
}

/// The test by which a search decides that the loss no longer falls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Test the predicted reduction of a step, before it is tried.
    Promised,
    /// Test the actual reduction of an accepted step. Without `always`, the test is skipped after
    /// failures, because failures make steps short.
    ///
    /// A step is not tried at all if its predicted reduction is below the tolerance. With `always`,
    /// this holds only for a step after a failure.
    Gained {
        /// Also test the reduction after failures.
        always: bool,
    },
}

/// When steps are accepted and when a search stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Largest number of accepted steps.
    pub max_iterations: usize,
    /// Stop if the actual or predicted reduction of the loss is below this share of the loss.
    pub loss_tolerance: f64,
    /// Whether the actual or the predicted reduction is tested.
    pub progress: Progress,
    /// Stop if no parameter moves by more than this share of its size.
    pub step_tolerance: f64,
    /// Loss below which the residuals are rounding errors.
    pub rounding: f64,
    /// Limit between a converged and a stalled search, once steps no longer move. The search has
    /// converged if an undamped step predicts a reduction of at most this share of the loss.
    pub settled: f64,
    /// How steps are damped.
    pub damping: Damping,
}

/// Result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Why the search ended.
    pub status: Status,
    /// Accepted steps.
    pub iterations: usize,
    /// Damping of the step that would have come next.
    pub damping: f64,
}

/// From this damping on, every step is short, so that short steps do not indicate a minimum.
const STRONG: f64 = 1.0;

/// A step counts as different from a failed one if it predicts at most this share of its reduction.
const ANOTHER: f64 = 0.5;
/// On a smooth loss, the error of a shorter step is at most this share of the error of the longer.
const SMOOTH: f64 = 0.75;
/// Largest number of steps that are skipped in a row.
const PASSED_OVER: usize = 10;

/// A step that failed.
#[derive(Debug, Clone, Copy)]
struct Failure {
    promise: f64,
    /// Error of the linear model: actual minus predicted loss.
    error: f64,
}

impl Failure {
    /// Whether `step` is so similar to the failed one that it would fail as well.
    fn is_nearly(&self, step: Step) -> bool {
        self.promise.is_finite() && step.promise > ANOTHER * self.promise
    }

    /// Whether a shorter step failed with nearly the same error.
    ///
    /// On a smooth loss, the error of the linear model falls at least in proportion to the step. If
    /// it does not, the loss is rough, for example because the machine chatters in its backlash.
    /// Shorter steps then do not help.
    fn as_much_as(&self, shorter: Self) -> bool {
        let another = shorter.promise <= ANOTHER * self.promise;
        another && shorter.error > SMOOTH * self.error
    }
}

/// Take steps until one of the stopping rules holds.
///
/// Every accepted step lowers the loss. The damping has the units that [`Descent::step`] expects.
///
/// # Errors
/// Returns the first error of the descent.
pub fn search<D: Descent>(descent: &mut D, rules: &Rules) -> Result<Outcome, D::Error> {
    let mut damper = Damper::new(rules.damping);
    let mut iterations = 0;
    let status = loop {
        if descent.loss() <= rules.rounding {
            break Status::Exact;
        }
        if iterations == rules.max_iterations {
            break Status::MaxIterations;
        }
        match advance(descent, rules, &mut damper)? {
            Advance::Moved => iterations += 1,
            Advance::Arrived => {
                iterations += 1;
                break Status::LossConverged;
            }
            Advance::Ended(status) => break status,
        }
    };
    Ok(Outcome {
        status,
        iterations,
        damping: damper.value,
    })
}

/// Result of the trials from one point.
enum Advance {
    /// A step was accepted.
    Moved,
    /// A step was accepted, but its reduction was below the tolerance.
    Arrived,
    /// The search ends: no step is worth a trial, or none lowers the loss.
    Ended(Status),
}

/// Try steps with growing damping until one lowers the loss.
fn advance<D: Descent>(
    descent: &mut D,
    rules: &Rules,
    damper: &mut Damper,
) -> Result<Advance, D::Error> {
    let loss = descent.loss();
    let enough = rules.loss_tolerance * loss;
    let mut failures = 0;
    let mut failed: Option<Failure> = None;
    let mut passed_over = 0;
    loop {
        let step = descent.step(damper.value)?;
        // Even the full predicted reduction would be below the tolerance.
        let little = step.is_some_and(|s| s.promise > 0.0 && s.promise < enough);
        let counts = match rules.progress {
            Progress::Promised => false,
            Progress::Gained { always } => failures > 0 || !always,
        };
        if little && counts {
            if failures > 0 {
                return Ok(Advance::Ended(at_end(descent, rules)?));
            }
            // The damping may be the reason for the small reduction: in a flat valley it limits
            // every step.
            let undamped = descent.step(0.0)?;
            if undamped.is_some_and(|s| s.promise > enough) && damper.relaxed() {
                continue;
            }
            return Ok(Advance::Ended(Status::LossConverged));
        }
        if let Some(step) = step
            && let Some(status) = end(descent, rules, step, damper.value)?
        {
            return Ok(Advance::Ended(status));
        }
        let again = failed.zip(step).is_some_and(|(f, s)| f.is_nearly(s));
        if again && passed_over < PASSED_OVER {
            damper.failed();
            passed_over += 1;
            continue;
        }
        passed_over = 0;
        // A step that bounds have cut may lead uphill. A shorter step is cut less.
        if let Some(step) = step.filter(|s| s.promise > 0.0)
            && let Some(new) = descent.attempt()?
        {
            if new < loss {
                descent.accept()?;
                damper.succeeded((loss - new) / step.promise);
                let tells = match rules.progress {
                    Progress::Promised => false,
                    Progress::Gained { always } => failures == 0 || always,
                };
                let arrived = tells && loss - new < enough;
                return Ok(if arrived {
                    Advance::Arrived
                } else {
                    Advance::Moved
                });
            }
            descent.reject();
            let now = Failure {
                promise: step.promise,
                error: new - loss + step.promise,
            };
            if failed.is_some_and(|before| before.as_much_as(now)) {
                return Ok(Advance::Ended(at_end(descent, rules)?));
            }
            failed = Some(now);
        }
        damper.failed();
        failures += 1;
        if failures > damper.failures() {
            return Ok(Advance::Ended(at_end(descent, rules)?));
        }
    }
}

/// Status of a search whose steps gain nothing, however short they are.
fn at_end<D: Descent>(descent: &mut D, rules: &Rules) -> Result<Status, D::Error> {
    Ok(if settled(descent, rules)? {
        Status::LossConverged
    } else {
        Status::Stalled
    })
}

/// The status, if the search ends before this step is tried.
fn end<D: Descent>(
    descent: &mut D,
    rules: &Rules,
    step: Step,
    damping: f64,
) -> Result<Option<Status>, D::Error> {
    let strong = damping >= STRONG;
    let promised = rules.progress == Progress::Promised;
    if promised && !strong && step.worth <= rules.loss_tolerance * descent.loss() {
        return Ok(Some(Status::LossConverged));
    }
    if step.moved > rules.step_tolerance {
        return Ok(None);
    }
    let at_rest = !strong || settled(descent, rules)?;
    Ok(Some(if at_rest {
        Status::StepConverged
    } else {
        Status::Stalled
    }))
}

/// Whether an undamped step predicts a reduction below [`Rules::settled`].
fn settled<D: Descent>(descent: &mut D, rules: &Rules) -> Result<bool, D::Error> {
    let step = descent.step(0.0)?;
    Ok(step.is_some_and(|s| s.worth <= rules.settled * descent.loss()))
}

struct Damper {
    rule: Damping,
    value: f64,
    growth: f64,
}

impl Damper {
    /// A smaller damping is lost in rounding.
    const LEAST: f64 = 1e-15;
    /// Growth of the damping after the first failure. Every further failure doubles the growth.
    const GROWTH: f64 = 2.0;
    /// Allowed failures in a row. The damping has then grown by 2^78.
    const FAILURES: usize = 12;

    fn new(rule: Damping) -> Self {
        let value = match rule {
            Damping::Kept { start } | Damping::Constant { start, .. } => start,
        };
        Self {
            rule,
            value,
            growth: Self::GROWTH,
        }
    }

    fn failures(&self) -> usize {
        match self.rule {
            Damping::Kept { .. } => Self::FAILURES,
            Damping::Constant { failures, .. } => failures,
        }
    }

    /// Update the damping after a step with the ratio `kept` of actual to predicted reduction.
    fn succeeded(&mut self, kept: f64) {
        self.growth = Self::GROWTH;
        self.value = match self.rule {
            Damping::Kept { .. } => {
                let cube = (2.0 * kept - 1.0).powi(3);
                (self.value * (1.0 - cube).clamp(0.1, 2.0)).max(Self::LEAST)
            }
            Damping::Constant { shrink, least, .. } => (self.value * shrink).max(least),
        };
    }

    /// Lower the damping of the next step. Returns false if it is already at its lower limit.
    fn relaxed(&mut self) -> bool {
        match self.rule {
            Damping::Constant { shrink, least, .. } if self.value > least => {
                self.value = (self.value * shrink).max(least);
                true
            }
            _ => false,
        }
    }

    fn failed(&mut self) {
        match self.rule {
            Damping::Kept { .. } => {
                self.value *= self.growth;
                self.growth *= 2.0;
            }
            Damping::Constant { grow, .. } => self.value *= grow,
        }
    }
}
