//! Choice of integrator, and what all of them share.

use super::implicit::Implicit;
use super::torque_path::{Line, SampleTorque};
use super::{dormand_prince, nystrom4, runge_kutta4};
use crate::plant::Plant;
use crate::robot::{Along, Course, DynamicsScratch};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// How the plant is integrated inside a sample.
///
/// Every method ends its last step on the sample instant, where the controller acts and
/// the command jumps: outputs are exact at the samples and no step crosses a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Classical Runge-Kutta of order 4 with a fixed number of sub-steps per sample and no
    /// error control: the reference.
    RungeKutta4 {
        /// Sub-steps per sample.
        substeps: usize,
    },
    /// Nyström's method of order 4 for second-order equations, with a fixed number of
    /// sub-steps per sample and no error control: the fastest where steps are short anyway.
    Nystrom4 {
        /// Sub-steps per sample.
        substeps: usize,
    },
    /// Dormand-Prince 5(4), explicit; the sub-step is halved until the local error is below
    /// `tolerance` times the size of each state.
    DormandPrince {
        /// Relative local error per sub-step.
        tolerance: f64,
    },
    /// Radau IIA of order 5, L-stable, for stiff plants.
    RadauIia {
        /// Relative local error per step.
        tolerance: f64,
    },
    /// Rosenbrock method RODAS of order 4(3), L-stable, for stiff plants at loose tolerances.
    Rosenbrock {
        /// Relative local error per step.
        tolerance: f64,
    },
    /// Dormand-Prince until the plant proves stiff, then Radau IIA.
    Automatic {
        /// Relative local error per step.
        tolerance: f64,
    },
}

impl Default for Method {
    fn default() -> Self {
        Self::DormandPrince { tolerance: 1e-7 }
    }
}

impl Method {
    /// Whether the steps are the same whatever the plant does.
    pub fn has_fixed_steps(self) -> bool {
        matches!(self, Self::RungeKutta4 { .. } | Self::Nystrom4 { .. })
    }

    /// Whether the method may need the exact Jacobian of [`Stepper::with_jacobian`].
    pub fn may_be_implicit(self) -> bool {
        matches!(
            self,
            Self::RadauIia { .. } | Self::Rosenbrock { .. } | Self::Automatic { .. }
        )
    }
}

/// What a run cost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Right-hand sides evaluated, those inside Jacobians not counted.
    pub evaluations: u64,
    /// Steps taken.
    pub steps: u64,
    /// Steps thrown away because their error was too large or the iteration did not converge.
    pub rejections: u64,
    /// Jacobians evaluated.
    pub jacobians: u64,
    /// Matrices factorized.
    pub factorizations: u64,
    /// Samples integrated by an implicit method.
    pub implicit_samples: u64,
}

/// Integrator state of one run: scratch and effort counters.
pub struct Stepper<S: Scalar> {
    pub(super) plant_scratch: DynamicsScratch<S>,
    pub(super) stages: Vec<Vec<S>>,
    pub(super) probe: Vec<S>,
    pub(super) applied: Vec<S>,
    /// Torques of the last Dormand-Prince stage, which is the first of the next step but for
    /// the torques; empty when there is none to reuse.
    pub(super) reusable: Vec<S>,
    pub(super) start: Vec<S>,
    /// First of the sample's equal parts that the step in hand covers, and their number.
    part: (usize, usize),
    pub(super) implicit: Option<Box<dyn Implicit<S>>>,
    /// Sub-steps per sample of the error-controlled explicit method.
    pub(super) substeps: usize,
    /// Samples whose explicit step was held down by stability, less those that were not.
    pub(super) stiff_score: u32,
    /// What the run cost so far.
    pub effort: Effort,
}

/// Sub-step budget of one sample before a run is given up.
const MAX_SUBSTEPS: usize = 4096;

/// A course of another arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("course: expected one of {expected} joints, got {got}")]
pub struct CourseOfAnother {
    /// Joints of the plant.
    pub expected: usize,
    /// Joints of the course.
    pub got: usize,
}

impl<S: Scalar> Stepper<S> {
    /// Scratch for `plant`; explicit methods only.
    pub fn new(plant: &Plant<S>) -> Self {
        let n = plant.n_states();
        let zeros = vec![S::zero(); n];
        Self {
            plant_scratch: plant.scratch(),
            stages: vec![zeros.clone(); dormand_prince::STAGES],
            probe: zeros.clone(),
            applied: vec![S::zero(); plant.axes.len()],
            reusable: Vec::new(),
            start: zeros,
            part: (0, 1),
            implicit: None,
            substeps: 1,
            stiff_score: 0,
            effort: Effort::default(),
        }
    }

    /// Scratch for `plant` with its arm linearised along `course`, see
    /// [`Plant::follows_courses`]; methods of fixed steps only.
    ///
    /// # Errors
    /// [`CourseOfAnother`] where `course` is of an arm of other joints.
    pub fn along(plant: &Plant<S>, course: &Arc<Course<S::Real>>) -> Result<Self, CourseOfAnother> {
        let (expected, got) = (plant.chain.len(), course.joints());
        if got != expected {
            return Err(CourseOfAnother { expected, got });
        }
        let mut stepper = Self::new(plant);
        stepper.plant_scratch.along = Some(Along::new(course, &plant.chain));
        Ok(stepper)
    }

    /// Number of samples of the course, where there is one.
    pub(super) fn course_samples(&self) -> Option<usize> {
        self.plant_scratch.along.as_ref().map(Along::samples)
    }

    /// Go to a sample.
    pub(super) fn enter(&mut self, sample: usize) {
        if let Some(along) = &mut self.plant_scratch.along {
            along.enter(sample);
        }
    }

    /// Fraction `at` of the step in hand.
    #[inline(always)]
    fn go_to(&mut self, at: f64) {
        if let Some(along) = &mut self.plant_scratch.along {
            let (first, parts) = self.part;
            along.go_to((first as f64 + at) / parts as f64);
        }
    }

    /// Forget the last run.
    pub(super) fn begin(&mut self) {
        self.reusable.clear();
        self.substeps = 1;
        self.stiff_score = 0;
    }

    /// Whether implicit methods can be used.
    pub fn has_jacobian(&self) -> bool {
        self.implicit.is_some()
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
        self.effort.evaluations += 1;
        self.go_to(at);
        plant.derivative(
            &self.probe,
            &self.applied,
            command,
            &mut self.plant_scratch,
            &mut self.stages[index],
        );
    }

    /// [`Stepper::stage`] at the angles of the last one.
    #[inline]
    pub(super) fn stage_in_place(
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
        self.effort.evaluations += 1;
        self.go_to(at);
        plant.derivative_in_place(
            &self.probe,
            &self.applied,
            command,
            &mut self.plant_scratch,
            &mut self.stages[index],
        );
    }
}

/// One step of a fixed-step method.
type Step<S> =
    fn(&Interval<'_, S>, x: &mut [S], h: f64, lines: &[Line<S>], stepper: &mut Stepper<S>);

/// One sample interval of one plant, integrated by a [`Method`].
pub(super) struct Interval<'a, S> {
    pub(super) plant: &'a Plant<S>,
    pub(super) command: &'a [S],
    pub(super) sample_time: f64,
}

impl<S: Scalar> Interval<'_, S> {
    /// Advance `x` over the sample; false if the error bound cannot be met.
    pub(super) fn advance(
        &self,
        method: Method,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        torque: &mut SampleTorque<'_, S>,
    ) -> bool {
        match method {
            Method::RungeKutta4 { substeps } => {
                self.advance_evenly(substeps, runge_kutta4::step, x, stepper, torque)
            }
            Method::Nystrom4 { substeps } => {
                self.advance_evenly(substeps, nystrom4::step, x, stepper, torque)
            }
            Method::DormandPrince { tolerance } => {
                self.advance_explicitly(tolerance, x, stepper, torque)
            }
            Method::RadauIia { .. } | Method::Rosenbrock { .. } => {
                self.advance_implicitly(method, x, stepper, torque)
            }
            Method::Automatic { tolerance } => {
                if dormand_prince::is_stiff(stepper) {
                    let radau = Method::RadauIia { tolerance };
                    return self.advance_implicitly(radau, x, stepper, torque);
                }
                if self.advance_explicitly(tolerance, x, stepper, torque) {
                    let h = self.sample_time / stepper.substeps as f64;
                    dormand_prince::watch_stiffness(stepper, h);
                    return true;
                }
                // Explicit steps cannot meet the bound: stiff beyond doubt.
                torque.rewind();
                dormand_prince::declare_stiff(stepper);
                self.advance_implicitly(Method::RadauIia { tolerance }, x, stepper, torque)
            }
        }
    }

    fn advance_evenly(
        &self,
        substeps: usize,
        step: Step<S>,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        torque: &mut SampleTorque<'_, S>,
    ) -> bool {
        let n = substeps.max(1);
        let h = self.sample_time / n as f64;
        for i in 0..n {
            stepper.part = (i, n);
            step(self, x, h, torque.part(i, n), stepper);
            torque.accept();
        }
        true
    }

    fn advance_implicitly(
        &self,
        method: Method,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        torque: &mut SampleTorque<'_, S>,
    ) -> bool {
        stepper.effort.implicit_samples += 1;
        let Stepper {
            implicit, effort, ..
        } = stepper;
        implicit
            .as_mut()
            .is_some_and(|solver| solver.advance(method, self, x, torque, effort))
    }

    /// Dormand-Prince with equal sub-steps, as many as the bound asks for; where it cannot be
    /// met, `x` is what it was.
    fn advance_explicitly(
        &self,
        tolerance: f64,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        torque: &mut SampleTorque<'_, S>,
    ) -> bool {
        stepper.start.copy_from_slice(x);
        loop {
            match self.attempt(tolerance, x, stepper, torque) {
                Some(error) => {
                    // Order 5: halving the count raises the error about 32 times.
                    if error < 1.0 / 64.0 && stepper.substeps > 1 {
                        stepper.substeps /= 2;
                    }
                    return true;
                }
                None if stepper.substeps >= MAX_SUBSTEPS => {
                    x.copy_from_slice(&stepper.start);
                    return false;
                }
                None => {
                    stepper.reusable.clear();
                    stepper.substeps *= 2;
                    x.copy_from_slice(&stepper.start);
                    torque.rewind();
                }
            }
        }
    }

    /// Largest error over the sample in units of the tolerance; `None` above one.
    fn attempt(
        &self,
        tolerance: f64,
        x: &mut [S],
        stepper: &mut Stepper<S>,
        torque: &mut SampleTorque<'_, S>,
    ) -> Option<f64> {
        let n = stepper.substeps;
        let h = self.sample_time / n as f64;
        let mut worst: f64 = 0.0;
        for i in 0..n {
            let lines = torque.part(i, n);
            let error = dormand_prince::step(self, x, h, lines, stepper) / tolerance;
            if error.is_nan() || error > 1.0 {
                stepper.effort.rejections += 1;
                return None;
            }
            torque.accept();
            worst = worst.max(error);
        }
        Some(worst)
    }
}
