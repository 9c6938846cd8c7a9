//! Choice of the integrator, and the state that all integrators share.

use super::implicit::Implicit;
use super::torque_path::{Line, SampleTorque};
use super::{dormand_prince, nystrom4, runge_kutta4};
use crate::plant::Plant;
use crate::robot::{Along, Course, DynamicsScratch};
use axisight_scalar::Scalar;
use std::sync::Arc;

/// The integrator of the plant inside a sample.
///
/// Every method ends its last step at the sample time, when the controller acts and the command
/// jumps. Outputs are exact at the samples, and no step crosses a jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Classical Runge-Kutta of order 4 with fixed sub-steps and no error control: the reference.
    RungeKutta4 {
        /// Sub-steps per sample.
        substeps: usize,
    },
    /// Nyström's method of order 4 for second-order equations, with fixed sub-steps and no error
    /// control. It is the fastest if steps are short anyway.
    Nystrom4 {
        /// Sub-steps per sample.
        substeps: usize,
    },
    /// Dormand-Prince 5(4), explicit. The sub-step is halved until the local error is below
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
    /// Whether the steps are independent of the plant.
    pub fn has_fixed_steps(self) -> bool {
        matches!(self, Self::RungeKutta4 { .. } | Self::Nystrom4 { .. })
    }

    /// The same method with more fixed sub-steps if its own are unstable at `decay` [1/s]
    /// ([`stable_substeps`]); methods with error control shorten their steps themselves.
    #[must_use]
    pub fn stable_at(self, decay: f64, sample_time: f64) -> Self {
        let needed = stable_substeps(decay, sample_time);
        match self {
            Self::RungeKutta4 { substeps } => Self::RungeKutta4 {
                substeps: substeps.max(needed),
            },
            Self::Nystrom4 { substeps } => Self::Nystrom4 {
                substeps: substeps.max(needed),
            },
            other => other,
        }
    }

    /// Whether the method may need the Jacobian of [`Stepper::with_jacobian`].
    pub fn may_be_implicit(self) -> bool {
        matches!(
            self,
            Self::RadauIia { .. } | Self::Rosenbrock { .. } | Self::Automatic { .. }
        )
    }
}

/// Fixed sub-steps of a sample that are stable where a motor's speed decays at `decay` [1/s]
/// ([`crate::plant::fastest_decay`]), from 1 to 16.
///
/// An unstable speed near standstill stays bounded, since friction has a largest value. Its
/// derivatives grow without bound.
pub fn stable_substeps(decay: f64, sample_time: f64) -> usize {
    // The boundary on the real axis is 2.8 for Runge-Kutta of order 4.
    const LONGEST: f64 = 2.0;
    const MOST: f64 = 16.0;
    // A small positive number.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let needed = (decay * sample_time / LONGEST).ceil().clamp(1.0, MOST) as usize;
    needed.max(1)
}

/// Effort of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Number of evaluations of the right-hand side, without those inside Jacobians.
    pub evaluations: u64,
    /// Number of steps.
    pub steps: u64,
    /// Number of steps rejected because of their error or a failed iteration.
    pub rejections: u64,
    /// Number of Jacobians.
    pub jacobians: u64,
    /// Number of matrix factorizations.
    pub factorizations: u64,
    /// Number of samples that an implicit method integrated.
    pub implicit_samples: u64,
}

/// Integrator of one run: scratch memory, state and effort counters.
pub struct Stepper<S: Scalar> {
    pub(super) plant_scratch: DynamicsScratch<S>,
    pub(super) stages: Vec<Vec<S>>,
    pub(super) probe: Vec<S>,
    pub(super) applied: Vec<S>,
    /// Torques of the last Dormand-Prince stage. Apart from the torques, that stage is the first of
    /// the next step. Empty if there is no stage to reuse.
    pub(super) reusable: Vec<S>,
    pub(super) start: Vec<S>,
    /// The current step covers this part of the sample: index, and number of equal parts.
    part: (usize, usize),
    pub(super) implicit: Option<Box<dyn Implicit<S>>>,
    /// Sub-steps per sample of the error-controlled explicit method.
    pub(super) substeps: usize,
    /// Stiffness score: samples whose step was limited by stability, minus other samples.
    pub(super) stiff_score: u32,
    /// Effort of the run so far.
    pub effort: Effort,
}

/// Largest number of sub-steps in one sample.
const MAX_SUBSTEPS: usize = 4096;

/// Error: the course belongs to an arm with another number of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("course: expected one of {expected} joints, got {got}")]
pub struct CourseOfAnother {
    /// Number of joints of the plant.
    pub expected: usize,
    /// Number of joints of the course.
    pub got: usize,
}

impl<S: Scalar> Stepper<S> {
    /// A stepper for `plant`, for explicit methods only.
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

    /// A stepper for `plant` with its arm linearised along `course`, for methods with fixed steps
    /// only.
    ///
    /// The plant must satisfy [`Plant::follows_courses`].
    ///
    /// # Errors
    /// [`CourseOfAnother`] if `course` has another number of joints.
    pub fn along(plant: &Plant<S>, course: &Arc<Course<S::Real>>) -> Result<Self, CourseOfAnother> {
        let (expected, got) = (plant.chain.len(), course.joints());
        if got != expected {
            return Err(CourseOfAnother { expected, got });
        }
        let mut stepper = Self::new(plant);
        stepper.plant_scratch.along = Some(Along::new(course, &plant.chain));
        Ok(stepper)
    }

    /// Number of samples of the course, if there is one.
    pub(super) fn course_samples(&self) -> Option<usize> {
        self.plant_scratch.along.as_ref().map(Along::samples)
    }

    /// Move to a sample.
    pub(super) fn enter(&mut self, sample: usize) {
        if let Some(along) = &mut self.plant_scratch.along {
            along.enter(sample);
        }
    }

    /// Move to the fraction `at` of the current step.
    #[inline(always)]
    fn go_to(&mut self, at: f64) {
        if let Some(along) = &mut self.plant_scratch.along {
            let (first, parts) = self.part;
            along.go_to((first as f64 + at) / parts as f64);
        }
    }

    /// Reset the state of the last run.
    pub(super) fn begin(&mut self) {
        self.reusable.clear();
        self.substeps = 1;
        self.stiff_score = 0;
    }

    /// Whether implicit methods are available.
    pub fn has_jacobian(&self) -> bool {
        self.implicit.is_some()
    }

    /// Evaluate the right-hand side at the fraction `at` of the sub-step with the torques `lines`.
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

    /// [`Stepper::stage`] at the angles of the previous stage.
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
    /// Advance `x` over the sample. Returns false if the error bound cannot be met.
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
                // Explicit steps cannot meet the bound, so the plant is stiff.
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

    /// Advance by Dormand-Prince with equal sub-steps, as many as the error bound requires. If the
    /// bound cannot be met, returns false and leaves `x` unchanged.
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
                    // The method has order 5, so half the number of sub-steps raises the error
                    // about 32 times.
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

    /// Largest error over the sample in units of the tolerance; `None` if it is above one.
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
