//! Choice of integrator, and what all of them share.

use super::torque_path::Line;
use super::{dormand_prince, runge_kutta4};
use crate::robot::{DynamicsScratch, Plant};
use crate::scalar::Scalar;

/// How the plant is integrated inside a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Classical Runge-Kutta of order 4 with a fixed number of sub-steps per sample.
    RungeKutta4 {
        /// Sub-steps per sample.
        substeps: usize,
    },
    /// Dormand-Prince 5(4); the sub-step is halved until the local error is below
    /// `tolerance` times the size of each state.
    DormandPrince {
        /// Relative local error per sub-step.
        tolerance: f64,
    },
}

impl Default for Method {
    fn default() -> Self {
        Self::DormandPrince { tolerance: 1e-7 }
    }
}

/// Integrator state of one run: scratch and effort counters.
pub struct Stepper<S> {
    pub(super) plant_scratch: DynamicsScratch<S>,
    pub(super) stages: Vec<Vec<S>>,
    pub(super) probe: Vec<S>,
    pub(super) applied: Vec<S>,
    /// Right-hand sides evaluated.
    pub evaluations: u64,
    /// Sub-steps taken.
    pub steps: u64,
    /// Sub-steps thrown away because their error was too large.
    pub rejections: u64,
}

/// Sub-step budget of one sample before a run is given up.
const MAX_SUBSTEPS: usize = 4096;

impl<S: Scalar> Stepper<S> {
    /// Scratch for `plant`.
    pub fn new(plant: &Plant<S>) -> Self {
        let n = plant.n_states();
        Self {
            plant_scratch: plant.scratch(),
            stages: vec![vec![S::zero(); n]; dormand_prince::STAGES],
            probe: vec![S::zero(); n],
            applied: vec![S::zero(); plant.axes.len()],
            evaluations: 0,
            steps: 0,
            rejections: 0,
        }
    }

    /// Right-hand side at fraction `at` of the sub-step with torque `lines`.
    #[inline]
    pub(super) fn stage(
        &mut self,
        plant: &Plant<S>,
        index: usize,
        at: f64,
        lines: &[Line<S>],
        command: &[S],
    ) {
        for (a, line) in self.applied.iter_mut().zip(lines) {
            *a = line.at(at);
        }
        self.evaluations += 1;
        plant.derivative(
            &self.probe,
            &self.applied,
            command,
            &mut self.plant_scratch,
            &mut self.stages[index],
        );
    }
}

/// One sample interval of one plant, integrated by a [`Method`].
pub(super) struct Interval<'a, S> {
    pub(super) plant: &'a Plant<S>,
    pub(super) command: &'a [S],
    pub(super) sample_time: f64,
}

impl<S: Scalar> Interval<'_, S> {
    /// Advance `x` over the sample. `lines(n)` gives, for `n` sub-steps, the torque
    /// lines of each sub-step over all axes. Returns false if the error bound
    /// cannot be met. `substeps` carries the count from sample to sample.
    pub(super) fn advance(
        &self,
        method: Method,
        x: &mut [S],
        substeps: &mut usize,
        stepper: &mut Stepper<S>,
        mut lines: impl FnMut(usize) -> Vec<Vec<Line<S>>>,
    ) -> bool {
        match method {
            Method::RungeKutta4 { substeps } => {
                let n = substeps.max(1);
                for line in lines(n) {
                    runge_kutta4::step(self, x, self.sample_time / n as f64, &line, stepper);
                }
                true
            }
            Method::DormandPrince { tolerance } => {
                let start = x.to_vec();
                loop {
                    match self.attempt(*substeps, tolerance, x, stepper, &mut lines) {
                        Some(error) => {
                            // Order 5: halving the count raises the error about 32 times.
                            if error < 1.0 / 64.0 && *substeps > 1 {
                                *substeps /= 2;
                            }
                            return true;
                        }
                        None if *substeps >= MAX_SUBSTEPS => return false,
                        None => {
                            *substeps *= 2;
                            x.copy_from_slice(&start);
                        }
                    }
                }
            }
        }
    }

    /// Largest error over the sample in units of the tolerance; `None` above one.
    fn attempt(
        &self,
        n: usize,
        tolerance: f64,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        lines: &mut impl FnMut(usize) -> Vec<Vec<Line<S>>>,
    ) -> Option<f64> {
        let mut worst: f64 = 0.0;
        for line in lines(n) {
            let h = self.sample_time / n as f64;
            let error = dormand_prince::step(self, x, h, &line, stepper) / tolerance;
            if error.is_nan() || error > 1.0 {
                stepper.rejections += 1;
                return None;
            }
            worst = worst.max(error);
        }
        Some(worst)
    }
}
