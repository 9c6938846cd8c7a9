//! Runs of a model over all logs, for the simulation of similar models.
//!
//! A similar model stays close to these runs, so its arm may be linearised along them. This leaves
//! a sixth of the work. Motors, gears and effects stay nonlinear. The error is of second order. The
//! part of it that the runs themselves show is known and is corrected.

use super::packing::LANES;
use super::problem::ProblemError;
use super::simulation_error::{Arm, SharedCourse, SimulationErrorProblem, Traces};
use axisight_core::robot::{Chain, Course};
use axisight_scalar::Lanes;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Runs of a model over the logs of a problem.
#[derive(Debug, Clone)]
pub struct Courses {
    batches: Vec<Batch>,
}

/// Runs of a model over all logs, batch by batch, as [`OwnRun`].
pub type Runs = Vec<Arc<OwnRun>>;

/// A run of a model over logs in lock-step, along which derivatives can be computed.
///
/// The arm is linearised on demand, because most trial points need no derivatives.
#[derive(Debug)]
pub struct OwnRun {
    /// Output of the model, `[lane * axes + axis][sample]`.
    pub(super) output: Vec<Vec<f64>>,
    chain: Chain<Lanes<LANES>>,
    sample_time: f64,
    /// Angles and rates of the joints, for each sample.
    states: Vec<Lanes<LANES>>,
    course: OnceLock<SharedCourse>,
}

impl OwnRun {
    pub(super) fn new(
        output: Vec<Vec<f64>>,
        chain: Chain<Lanes<LANES>>,
        sample_time: f64,
        states: Vec<Lanes<LANES>>,
    ) -> Self {
        Self {
            output,
            chain,
            sample_time,
            states,
            course: OnceLock::new(),
        }
    }

    pub(super) fn course(&self) -> &SharedCourse {
        let linearise = || Arc::new(Course::new(&self.chain, self.sample_time, &self.states));
        self.course.get_or_init(linearise)
    }
}

/// The run of one batch of logs in lock-step.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    pub(super) course: SharedCourse,
    /// Output of the model minus its output with the linearised arm,
    /// `[lane * axes + axis][sample]`.
    pub(super) excess: Vec<Vec<f64>>,
}

impl Courses {
    /// Runs of `problem` at `theta`; `None` if its arm cannot be linearised along them.
    ///
    /// # Errors
    /// [`ProblemError::Diverged`] if the model has no valid run at `theta`.
    pub fn new(
        problem: &SimulationErrorProblem,
        theta: &[f64],
    ) -> Result<Option<Self>, ProblemError> {
        if !problem.follows_courses(theta)? {
            return Ok(None);
        }
        let batches = problem.batches();
        let batch = |records: &Vec<usize>| {
            let run = problem.own_run(records, theta)?;
            let course = Arc::clone(run.course());
            let near = problem.pass(records, theta, &[], &Arm::Along(&course))?;
            let mut excess = run.output;
            for (exact, near) in excess.iter_mut().zip(near.into_iter().flatten()) {
                exact.iter_mut().zip(near).for_each(|(e, n)| *e -= n);
            }
            Ok(Batch { course, excess })
        };
        let batches = batches
            .par_iter()
            .map(batch)
            .collect::<Result<_, ProblemError>>()?;
        Ok(Some(Self { batches }))
    }

    pub(super) fn batch(&self, number: usize) -> Option<&Batch> {
        self.batches.get(number)
    }

    /// Whether the runs have `joints` joints and `batches` batches.
    pub(super) fn fit(&self, joints: usize, batches: usize) -> bool {
        self.batches.len() == batches && self.batches.iter().all(|b| b.course.joints() == joints)
    }
}

impl Batch {
    /// Add the excess to an output with the linearised arm.
    pub(super) fn correct(&self, traces: &mut Traces) {
        if let Some(output) = traces.first_mut() {
            for (output, excess) in output.iter_mut().zip(&self.excess) {
                output.iter_mut().zip(excess).for_each(|(o, e)| *o += e);
            }
        }
    }
}
