//! Runs of a model over all logs, for models close to it.
//!
//! A model that differs a little stays close to these runs: its arm may be linearised along
//! them, which leaves a sixth of the work; motors, gears and effects stay as they are. The error
//! of that is of second order, and what the runs themselves show of it is known and taken off.

use super::problem::ProblemError;
use super::simulation_error::{Arm, SharedCourse, SimulationErrorProblem, Traces};
use rayon::prelude::*;

/// Runs of a model over the logs of a problem.
#[derive(Debug, Clone)]
pub struct Courses {
    batches: Vec<Batch>,
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
    /// [`ProblemError::Failed`] where the model does not hold.
    pub fn new(
        problem: &SimulationErrorProblem,
        theta: &[f64],
    ) -> Result<Option<Self>, ProblemError> {
        if !problem.follows_courses(theta)? {
            return Ok(None);
        }
        let batches = problem.batches();
        let batch = |records: &Vec<usize>| {
            let (mut excess, course) = problem.exact_run(records, theta)?;
            let near = problem.pass(records, theta, &[], &Arm::Along(&course))?;
            for (exact, near) in excess.iter_mut().zip(near.into_iter().flatten()) {
                exact.iter_mut().zip(near).for_each(|(e, n)| *e -= n);
            }
            Ok(Batch { course, excess })
        };
        let batches = batches.par_iter().map(batch).collect::<Result<_, _>>()?;
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
