//! Runs of a model over all logs, for models close to it.
//!
//! A model that differs a little stays close to these runs: its arm may be linearised along
//! them, which leaves a sixth of the work; motors, gears and effects stay as they are. The error
//! of that is of second order, and what the runs themselves show of it is known and taken off.

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

/// A run of a model over logs in lock-step, along which its derivatives can be taken.
///
/// The arm is linearised when the first of them is asked for: most trial points need none.
#[derive(Debug)]
pub struct OwnRun {
    /// Output of the model, `[lane * axes + axis]`.
    pub(super) output: Vec<Vec<f64>>,
    chain: Chain<Lanes<LANES>>,
    sample_time: f64,
    /// Angles and rates of the joints, sample by sample.
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

/// Logs in lock-step.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    pub(super) course: SharedCourse,
    /// Output of the model less its output with the arm linearised, `[lane * axes + axis]`.
    pub(super) excess: Vec<Vec<f64>>,
}

impl Courses {
    /// Runs of `problem` at `theta`; `None` where its arm cannot be linearised along them.
    ///
    /// # Errors
    /// [`ProblemError::Diverged`] where the model does not hold.
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

    /// Whether these are runs of a chain of `joints` joints over `batches` batches.
    pub(super) fn fit(&self, joints: usize, batches: usize) -> bool {
        self.batches.len() == batches && self.batches.iter().all(|b| b.course.joints() == joints)
    }
}

impl Batch {
    /// Put the excess back on an output.
    pub(super) fn correct(&self, traces: &mut Traces) {
        if let Some(output) = traces.first_mut() {
            for (output, excess) in output.iter_mut().zip(&self.excess) {
                output.iter_mut().zip(excess).for_each(|(o, e)| *o += e);
            }
        }
    }
}
