//! How much to damp, when to accept, when to stop.

use super::Status;

/// A damped step, as far as the search has to know it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Fall of the loss by the linear model before bounds cut the step: nothing at a minimum.
    pub worth: f64,
    /// Fall of the loss by the linear model at the point that is to be tried.
    pub promise: f64,
    /// Largest move of a parameter, a share of its size.
    pub moved: f64,
}

impl Step {
    /// A step of which nothing is known before it is tried.
    pub const UNKNOWN: Self = Self {
        worth: f64::INFINITY,
        promise: f64::INFINITY,
        moved: f64::INFINITY,
    };
}

/// A present point, the steps from it, and a trial point.
pub trait Descent {
    /// Why a search cannot go on.
    type Error;
    /// Loss at the present point.
    fn loss(&self) -> f64;
    /// Find the step with this damping; `None` where there is none.
    ///
    /// # Errors
    /// Ends the search.
    fn step(&mut self, damping: f64) -> Result<Option<Step>, Self::Error>;
    /// Take the last step on trial: the loss there, `None` where the model does not hold.
    ///
    /// # Errors
    /// Ends the search.
    fn attempt(&mut self) -> Result<Option<f64>, Self::Error>;
    /// The trial point becomes the present one.
    ///
    /// # Errors
    /// Ends the search.
    fn accept(&mut self) -> Result<(), Self::Error>;
    /// The trial point is given up.
    fn reject(&mut self) {}
}

/// How the damping follows success and failure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Damping {
    /// By how much of the promise was kept: Nielsen (1999), *Damping parameter in Marquardt's
    /// method*. Needs derivatives that belong to the present point.
    Kept,
    /// By constant factors, whatever was promised: where derivatives are taken over from
    /// another point, or left out where they say nothing, promises are not to be relied on.
    Constant {
        /// Damping of the first step.
        start: f64,
        /// Factor after a success.
        shrink: f64,
        /// Factor after a failure.
        grow: f64,
        /// Smallest.
        least: f64,
        /// Failures in a row before the search gives up.
        failures: usize,
    },
}

/// What tells that the loss cannot fall any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// What a step promises, before it is tried.
    Promised,
    /// What a step has gained, after it was accepted; not believed after failures, which make
    /// steps short, unless `always`. Nor is a step tried that promises less than it has to gain:
    /// none at all, or, with `always`, none after a failure.
    Gained {
        /// Believed after failures too.
        always: bool,
    },
}

/// When steps are accepted and when a search stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Most accepted steps.
    pub max_iterations: usize,
    /// Stop when the loss falls, or is promised to fall, by less than this share.
    pub loss_tolerance: f64,
    /// Which of the two.
    pub progress: Progress,
    /// Stop when no parameter moves by more than this share of its size.
    pub step_tolerance: f64,
    /// Loss at which residuals are rounding errors.
    pub rounding: f64,
    /// A search that no longer moves has settled where an undamped step promises to lower the
    /// loss by this share at most, and has stalled where it promises more.
    pub settled: f64,
    /// How steps are damped.
    pub damping: Damping,
}

/// How and after how much a search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How.
    pub status: Status,
    /// Accepted steps.
    pub iterations: usize,
    /// Damping that the next step would have had.
    pub damping: f64,
}

/// From here on damping shortens every step, and short steps say nothing of a minimum.
const STRONG: f64 = 1.0;

/// Share of the promise of a step that failed below which another step is another step.
const ANOTHER: f64 = 0.5;
/// Share of its error below which the error of another step has to be.
const SMOOTH: f64 = 0.75;
/// Most steps that are passed over at a time.
const PASSED_OVER: usize = 10;

/// A step that failed.
#[derive(Debug, Clone, Copy)]
struct Failure {
    promise: f64,
    /// Error of the linear model: how much more the loss is than promised.
    error: f64,
}

impl Failure {
    /// Whether a step is hardly another one: it would fail as well.
    fn is_nearly(&self, step: Step) -> bool {
        self.promise.is_finite() && step.promise > ANOTHER * self.promise
    }

    /// Whether a shorter step failed by about as much.
    ///
    /// The error of a linear model falls at least as steps do. Where it does not, the loss is rough, as
    /// that of a machine which chatters through its play: no shorter step is any better.
    fn as_much_as(&self, shorter: Self) -> bool {
        let another = shorter.promise <= ANOTHER * self.promise;
        another && shorter.error > SMOOTH * self.error
    }
}

/// Steps until one of the stopping rules holds.
///
/// Every step that is accepted lowers the loss. The damping is in units of the curvature, as
/// [`Descent::step`] understands it.
///
/// # Errors
/// Those of the descent.
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

/// What became of the trials from one point.
enum Advance {
    /// One was accepted.
    Moved,
    /// One was accepted, and gained next to nothing.
    Arrived,
    /// None is worth a try, or none succeeds.
    Ended(Status),
}

/// Trials, each damped more, until one lowers the loss.
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
        // It would not gain enough if it kept its promise.
        let little = step.is_some_and(|s| s.promise > 0.0 && s.promise < enough);
        let counts = match rules.progress {
            Progress::Promised => false,
            Progress::Gained { always } => failures > 0 || !always,
        };
        if little && counts {
            if failures > 0 {
                return Ok(Advance::Ended(at_end(descent, rules)?));
            }
            // Damping may be what leaves so little: along a flat valley it holds everything back.
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
        // A step that was cut may lead uphill: a shorter one is cut less.
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

/// How a search ended whose steps, however short, gain nothing.
fn at_end<D: Descent>(descent: &mut D, rules: &Rules) -> Result<Status, D::Error> {
    Ok(if settled(descent, rules)? {
        Status::LossConverged
    } else {
        Status::Stalled
    })
}

/// Whether the search ends before this step is tried.
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

/// Whether an undamped step promises next to nothing.
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
    /// Damping of the first step, where the rule does not say.
    const START: f64 = 1e-3;
    /// Below it, damping is lost in rounding.
    const LEAST: f64 = 1e-15;
    /// Factor after a failure, itself doubled by every further one.
    const GROWTH: f64 = 2.0;
    /// Failures in a row: the damping is then 2^78 times as large.
    const FAILURES: usize = 12;

    fn new(rule: Damping) -> Self {
        let value = match rule {
            Damping::Kept => Self::START,
            Damping::Constant { start, .. } => start,
        };
        Self {
            rule,
            value,
            growth: Self::GROWTH,
        }
    }

    fn failures(&self) -> usize {
        match self.rule {
            Damping::Kept => Self::FAILURES,
            Damping::Constant { failures, .. } => failures,
        }
    }

    /// After a step that kept the share `kept` of its promise.
    fn succeeded(&mut self, kept: f64) {
        self.growth = Self::GROWTH;
        self.value = match self.rule {
            Damping::Kept => {
                let cube = (2.0 * kept - 1.0).powi(3);
                (self.value * (1.0 - cube).clamp(0.1, 2.0)).max(Self::LEAST)
            }
            Damping::Constant { shrink, least, .. } => (self.value * shrink).max(least),
        };
    }

    /// Damp the next step less, if there is less.
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
            Damping::Kept => {
                self.value *= self.growth;
                self.growth *= 2.0;
            }
            Damping::Constant { grow, .. } => self.value *= grow,
        }
    }
}
