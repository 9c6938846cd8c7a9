//! The sampled loop: measure, command, integrate to the next sample.

use super::controller::{ControlLoop, OwnLaw};
use super::late_reading::LateReading;
use super::method::{Interval, Method, Stepper};
use super::torque_path::{SampleTorque, TorqueBuffers, TorquePath};
use crate::effect::EffectError;
use crate::plant::{Axis, EquilibriumError, Lead, Plant, PlantError, equilibrium};
use crate::robot::Controller;
use axisight_scalar::Scalar;
use std::sync::atomic::{AtomicBool, Ordering};

/// What drives a run; arrays are row-major `(n_samples, n_axes)`, one per lane.
#[derive(Debug, Clone, Copy)]
pub enum Drive<'a> {
    /// Motor-side velocity references through the controller [rad/s].
    Reference(&'a [&'a [f64]]),
    /// Commanded torques, no controller [Nm].
    Torque(&'a [&'a [f64]]),
    /// A logged run: its commanded torques [Nm], plus what the controller's feedback adds
    /// to keep the simulation on the logged positions [rad]. In a linear loop the added
    /// torque is what a run driven by references would be off by; in a nonlinear one the
    /// simulation also stays in phase with the log (lost motion, stiction).
    Tracking {
        /// Logged torque commands.
        torque: &'a [&'a [f64]],
        /// Logged motor positions.
        position: &'a [&'a [f64]],
    },
}

/// A run to simulate.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Controller of the robot.
    pub controller: &'a Controller,
    /// Sample time [s].
    pub sample_time: f64,
    /// Driven joint angles at the start [rad]: one set for all lanes, or one per lane.
    pub start: &'a [&'a [f64]],
    /// References or torques; a lane shorter than the longest is held at zero.
    pub drive: Drive<'a>,
    /// Position measurement noise per lane, shaped like the drive; empty for none [rad].
    pub noise: &'a [&'a [f64]],
    /// Integrator; for the linear plant only the sub-steps of Runge-Kutta count.
    pub method: Method,
    /// Step of the position sensor [rad]; zero for none.
    pub resolution: f64,
    /// Whether samples say what torque effects add on the motors; zero where not asked for.
    pub disturbances: bool,
    /// Set by another thread to end the run early.
    pub cancel: Option<&'a AtomicBool>,
}

impl Run<'_> {
    /// Whether delays are those of targets, not of torques.
    pub fn has_late_targets(&self) -> bool {
        matches!(self.drive, Drive::Reference(_)) && self.controller.has_targets()
    }

    /// Driven joint angles at the start, each lane at its own.
    pub fn start_angles<S: Scalar>(&self, n_axes: usize) -> Vec<S> {
        (0..n_axes)
            .map(|axis| lane_value(self.start, 0, axis, n_axes))
            .collect()
    }
}

/// One sample as the log sees it, and the truth behind it.
#[derive(Debug)]
pub struct Sample<'a, S> {
    /// Sample number.
    pub index: usize,
    /// Commanded motor torque as the drive reports it [Nm].
    pub command: &'a [S],
    /// Measured motor position [rad].
    pub measured: &'a [S],
    /// Torque added on the motor by ripple, friction and other effects [Nm], where the run
    /// asks for it.
    pub torque_disturbance: &'a [S],
    /// Error of the position measurement, noise included [rad].
    pub position_disturbance: &'a [S],
    /// State `[phi, q, phi', q']`.
    pub state: &'a [S],
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All samples were simulated.
    Completed,
    /// A state became infinite or NaN at this sample: the loop is unstable.
    Diverged(usize),
    /// The error bound could not be met at this sample: the plant is too stiff for an
    /// explicit method or a parameter is far off.
    StepSizeCollapsed(usize),
    /// The run was cancelled before this sample.
    Cancelled(usize),
}

/// Misuse of the simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The arm does not settle.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// An array has the wrong size.
    #[error("{field}: expected {expected}, got {got}")]
    Shape {
        /// Argument.
        field: &'static str,
        /// What it should be.
        expected: String,
        /// What came.
        got: String,
    },
    /// An implicit method without the Jacobian of [`Stepper::with_jacobian`].
    #[error(
        "method: expected an explicit one for several runs in lock-step or for derivatives, got {0:?}"
    )]
    NoJacobian(Method),
    /// A course that does not fit the run.
    #[error(
        "course: expected at least {expected} samples and a method of fixed steps, got {got} samples and {method:?}"
    )]
    Course {
        /// Samples of the run.
        expected: usize,
        /// Samples of the course.
        got: usize,
        /// Integrator.
        method: Method,
    },
    /// A reference-driven run needs a controller.
    #[error("controller: expected one for a run driven by velocity references, got kind `none`")]
    NoController,
    /// An effect is misused.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The robot that the controller knows cannot be built.
    #[error(transparent)]
    Known(#[from] PlantError),
}

/// Simulate until the longest lane ends; `observe` sees every sample.
///
/// # Errors
/// [`SimulationError`] for misuse; trouble during the run is a [`Status`].
#[inline(never)]
pub fn simulate<S: Scalar>(
    plant: &Plant<S>,
    run: &Run<'_>,
    stepper: &mut Stepper<S>,
    observe: &mut dyn FnMut(&Sample<'_, S>),
) -> Result<Status, SimulationError> {
    let n_axes = plant.axes.len();
    let n_samples = check(run, n_axes, S::LANES)?;
    check_turned(plant)?;
    if run.method.may_be_implicit() && !stepper.has_jacobian() {
        return Err(SimulationError::NoJacobian(run.method));
    }
    if let Some(got) = stepper.course_samples()
        && (got < n_samples || !run.method.has_fixed_steps())
    {
        return Err(SimulationError::Course {
            expected: n_samples,
            got,
            method: run.method,
        });
    }
    let rest = equilibrium(plant, &run.start_angles(n_axes))?;
    stepper.begin();
    let mut x = plant.state_at_rest(&rest);
    let mut controller = ControlLoop::new(
        run.controller,
        run.sample_time,
        &rest.motor_angle,
        &rest.motor_torque,
        OwnLaw::of(plant, run.sample_time),
    )?;
    let late_targets = run.has_late_targets();
    let mut paths: Vec<_> = plant
        .axes
        .iter()
        .zip(&rest.motor_torque)
        .map(|(axis, u)| TorquePath::new(axis, *u, run.sample_time))
        .map(|path| if late_targets { path.at_once() } else { path })
        .collect();
    let mut signals = Signals::of(plant, &rest.motor_angle, run.sample_time);
    let mut buffers = TorqueBuffers::new(n_axes);
    for k in 0..n_samples {
        if run.cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Ok(Status::Cancelled(k));
        }
        signals.measure(plant, run, k, &x);
        signals.command(run, k, &mut controller);
        if run.disturbances {
            signals.disturb(plant, &x);
        }
        observe(&signals.sample(k, &x));
        let interval = Interval {
            plant,
            command: &signals.command,
            sample_time: run.sample_time,
        };
        stepper.enter(k);
        let mut torque =
            SampleTorque::new(&mut paths, &signals.command, &signals.added, &mut buffers);
        let met = interval.advance(run.method, &mut x, stepper, &mut torque);
        torque.finish();
        if !all_finite(&x) {
            return Ok(Status::Diverged(k));
        }
        if !met {
            return Ok(Status::StepSizeCollapsed(k));
        }
    }
    Ok(Status::Completed)
}

/// Refuse a rigid gear that another axis turns along: it would be a constraint.
fn check_turned<S: Scalar>(plant: &Plant<S>) -> Result<(), EffectError> {
    let turns = |lead: &&Lead<S>| (0..S::LANES).any(|lane| lead.by.lane(lane) != 0.0);
    for (i, axis) in plant.axes.iter().enumerate() {
        let lead = axis.led_by.iter().find(turns);
        if let (None, Some(lead)) = (&axis.gear, lead) {
            return Err(EffectError::Lacking {
                effect: lead.effect,
                expected: "a compliant transmission of the axis that is turned along".to_owned(),
                got: format!("axis {} (rigid)", i + 1),
            });
        }
    }
    Ok(())
}

/// Whether no state is infinite or NaN: zero times the sum of all would be NaN.
fn all_finite<S: Scalar>(x: &[S]) -> bool {
    let zero = S::Real::zero();
    let sum = x.iter().fold(zero, |sum, v| v.real().fma(zero, sum));
    (0..S::LANES).all(|lane| sum.lane(lane) == 0.0)
}

/// Signals of the current sample.
pub struct Signals<S> {
    /// Measured motor positions [rad].
    pub measured: Vec<S>,
    /// Commanded torques [Nm].
    pub command: Vec<S>,
    reference: Vec<S>,
    /// What of the commands keeps the simulation on a log [Nm]; zero without one.
    pub added: Vec<S>,
    /// Torque that effects add on the motors [Nm].
    pub torque_disturbance: Vec<S>,
    /// Error of the measured positions, noise included [rad].
    pub position_disturbance: Vec<S>,
    /// Error of encoders on the joints where the run begins [rad].
    joint_error_at_start: Vec<S>,
    /// By how much the controller's clock is fast against that of the references; none where they are one.
    clock_drift: Option<S>,
    /// Share of each command that the drive reports, and what it reports [Nm]; empty where all
    /// report what they are told.
    reported_share: Vec<S>,
    reported: Vec<S>,
    /// Of axes whose motors are read late; empty where none is.
    late: Vec<Option<LateReading<S>>>,
}

impl<S: Scalar> Signals<S> {
    /// All zero.
    pub fn new(n_axes: usize) -> Self {
        let zeros = vec![S::zero(); n_axes];
        Self {
            measured: zeros.clone(),
            command: zeros.clone(),
            reference: zeros.clone(),
            added: zeros.clone(),
            torque_disturbance: zeros.clone(),
            position_disturbance: zeros.clone(),
            joint_error_at_start: zeros,
            clock_drift: None,
            reported_share: Vec::new(),
            reported: Vec::new(),
            late: Vec::new(),
        }
    }

    /// All zero, with what the drives of a plant report, and sensors that read motors late, at rest at
    /// `angle`.
    fn of(plant: &Plant<S>, angle: &[S], sample_time: f64) -> Self {
        let n_axes = plant.axes.len();
        let mut signals = Self::new(n_axes);
        signals.clock_drift = plant.clock_drift();
        let share = |i: usize| {
            let shares = plant.axes[i]
                .kernels
                .iter()
                .filter_map(|k| k.reported_share());
            shares.fold(None, |all: Option<S>, one| {
                Some(all.map_or(one, |a| a * one))
            })
        };
        let shares: Vec<_> = (0..n_axes).map(share).collect();
        if shares.iter().any(Option::is_some) {
            let known = shares.into_iter().map(|s| s.unwrap_or_else(S::one));
            signals.reported_share = known.collect();
            signals.reported = vec![S::zero(); n_axes];
        }
        let late = |(axis, &rest): (&Axis<S>, &S)| {
            let delays = axis.kernels.iter().filter_map(|k| k.reading_delay());
            let delay = delays.reduce(|a, b| a + b)?;
            Some(LateReading::new(delay * (1.0 / sample_time), rest))
        };
        let readings: Vec<_> = plant.axes.iter().zip(angle).map(late).collect();
        if readings.iter().any(Option::is_some) {
            signals.late = readings;
        }
        signals
    }

    fn measure(&mut self, plant: &Plant<S>, run: &Run<'_>, k: usize, x: &[S]) {
        for (i, axis) in plant.axes.iter().enumerate() {
            let angle = plant.motor_angle(axis, x);
            let mut error: S = lane_value(run.noise, k, i, plant.axes.len());
            let mut seen = angle;
            if let Some(Some(late)) = self.late.get_mut(i) {
                seen = late.read(angle, plant.motor_speed(axis, x) * run.sample_time);
                error += seen - angle;
            }
            for kernel in &axis.kernels {
                error += kernel.sensor(seen);
            }
            error += self.joint_error(axis, i, k, plant.joint_angle(axis, x));
            let steps = axis.kernels.iter().filter_map(|k| k.resolution());
            let coarsest = steps.fold(S::constant(run.resolution), |a, b| {
                (a - b).if_positive(a, b)
            });
            self.read(i, angle, error, coarsest);
        }
    }

    /// Error of encoders on the joint of an axis, motor side, counted from where the run begins [rad].
    fn joint_error(&mut self, axis: &Axis<S>, i: usize, k: usize, angle: S) -> S {
        let errors = axis
            .kernels
            .iter()
            .filter_map(|kernel| kernel.joint_sensor(angle));
        let Some(error) = errors.reduce(|a, b| a + b) else {
            return S::zero();
        };
        if k == 0 {
            self.joint_error_at_start[i] = error;
        }
        (error - self.joint_error_at_start[i]) * (1.0 / axis.ratio)
    }

    /// Reading of an axis at motor angle `angle`, to the nearest step of the sensor.
    #[inline(always)]
    pub fn read(&mut self, axis: usize, angle: S, mut error: S, resolution: S) {
        if (0..S::LANES).any(|lane| resolution.lane(lane) > 0.0) {
            let exact = angle + error;
            // Rounding is flat between its jumps: derivatives pass as if it were not there.
            error += S::from_lanes(|lane| {
                let (x, step) = (exact.lane(lane), resolution.lane(lane));
                if step > 0.0 {
                    (x / step).round_ties_even() * step - x
                } else {
                    0.0
                }
            });
        }
        self.position_disturbance[axis] = error;
        self.measured[axis] = angle + error;
    }

    /// The command of sample `k`, from what was measured.
    #[inline(always)]
    pub fn command(&mut self, run: &Run<'_>, k: usize, controller: &mut ControlLoop<S>) {
        let n = self.command.len();
        match run.drive {
            Drive::Torque(torque) => {
                for i in 0..n {
                    self.command[i] = self.commanded(lane_value(torque, k, i, n), i);
                }
            }
            Drive::Tracking { torque, position } => {
                for i in 0..n {
                    self.reference[i] = lane_value(position, k, i, n);
                    self.command[i] = self.commanded(lane_value(torque, k, i, n), i);
                }
                controller.follow(&self.measured, &self.reference, &mut self.added);
                for (command, added) in self.command.iter_mut().zip(&self.added) {
                    *command += *added;
                }
            }
            Drive::Reference(reference) => {
                for i in 0..n {
                    self.reference[i] = match self.clock_drift {
                        Some(drift) => value_at(reference, k, drift, i, n),
                        None => lane_value(reference, k, i, n),
                    };
                }
                controller.command(&self.measured, &self.reference, &mut self.command);
            }
        }
        for (i, share) in self.reported_share.iter().enumerate() {
            self.reported[i] = self.command[i] * *share;
        }
    }

    /// The command of an axis whose drive reports `torque`.
    #[inline(always)]
    fn commanded(&self, torque: S, axis: usize) -> S {
        match self.reported_share.get(axis) {
            Some(share) => torque / *share,
            None => torque,
        }
    }

    /// Torque that effects add on the motors in the present state.
    fn disturb(&mut self, plant: &Plant<S>, x: &[S]) {
        plant.motor_disturbances(x, &self.command, &mut self.torque_disturbance);
    }

    /// What an observer sees at sample `index` in state `x`.
    pub fn sample<'a>(&'a self, index: usize, x: &'a [S]) -> Sample<'a, S> {
        Sample {
            index,
            command: if self.reported.is_empty() {
                &self.command
            } else {
                &self.reported
            },
            measured: &self.measured,
            torque_disturbance: &self.torque_disturbance,
            position_disturbance: &self.position_disturbance,
            state: x,
        }
    }
}

/// Entry `(k, axis)` of each lane's array; zero beyond its end or without arrays.
#[inline(always)]
pub fn lane_value<S: Scalar>(arrays: &[&[f64]], k: usize, axis: usize, n_axes: usize) -> S {
    S::from_lanes(|lane| {
        let array = arrays.get(lane).or_else(|| arrays.last());
        array
            .and_then(|a| a.get(k * n_axes + axis))
            .copied()
            .unwrap_or(0.0)
    })
}

/// Entry of each lane's array at sample `(1 + drift) k`, between samples in a line; the first or
/// last one beyond them.
fn value_at<S: Scalar>(arrays: &[&[f64]], k: usize, drift: S, axis: usize, n_axes: usize) -> S {
    let late = drift * k as f64;
    let whole = S::from_lanes(|lane| late.lane(lane).floor());
    let at = |further: f64| {
        S::from_lanes(|lane| {
            let Some(array) = arrays.get(lane).or_else(|| arrays.last()) else {
                return 0.0;
            };
            let last = (array.len() / n_axes).saturating_sub(1);
            // Drifts are bounded, and runs have far fewer samples than numbers have digits.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let sample = (k as f64 + whole.lane(lane) + further).max(0.0) as usize;
            let entry = array.get(sample.min(last) * n_axes + axis);
            entry.copied().unwrap_or(0.0)
        })
    };
    let before = at(0.0);
    (late - whole).fma(at(1.0) - before, before)
}

/// Number of samples of a run of `n_axes` axes in at most `lanes` lanes.
///
/// # Errors
/// [`SimulationError`] naming the field that is wrong.
pub fn check(run: &Run<'_>, n_axes: usize, lanes: usize) -> Result<usize, SimulationError> {
    let shape = |field, expected: String, got: String| SimulationError::Shape {
        field,
        expected,
        got,
    };
    let (field, arrays) = match run.drive {
        Drive::Reference(_) | Drive::Tracking { .. } if *run.controller == Controller::None => {
            return Err(SimulationError::NoController);
        }
        Drive::Tracking { torque, position } => {
            let same = torque
                .iter()
                .map(|t| t.len())
                .eq(position.iter().map(|p| p.len()));
            if !same {
                let got = format!("{} runs", position.len());
                return Err(shape("position", "the shape of torque".to_owned(), got));
            }
            ("torque", torque)
        }
        Drive::Reference(r) => ("velocity_ref", r),
        Drive::Torque(t) => ("torque", t),
    };
    if !(run.sample_time.is_finite() && run.sample_time > 0.0) {
        let got = run.sample_time.to_string();
        return Err(shape(
            "sample_time",
            "a positive time in seconds".to_owned(),
            got,
        ));
    }
    if !(run.resolution.is_finite() && run.resolution >= 0.0) {
        let got = run.resolution.to_string();
        return Err(shape(
            "resolution",
            "a step in radians, or zero".to_owned(),
            got,
        ));
    }
    if arrays.is_empty() || arrays.len() > lanes {
        return Err(shape(
            field,
            format!("1 to {lanes} runs"),
            arrays.len().to_string(),
        ));
    }
    let starts = run.start.len();
    if starts != 1 && starts != arrays.len() {
        let expected = format!(
            "one set of angles, or one for each of {} runs",
            arrays.len()
        );
        return Err(shape("start", expected, starts.to_string()));
    }
    if let Some(start) = run.start.iter().find(|s| s.len() != n_axes) {
        let expected = format!("{n_axes} driven joint angles");
        return Err(shape("start", expected, start.len().to_string()));
    }
    let positions = match run.drive {
        Drive::Tracking { position, .. } => position,
        _ => &[],
    };
    for (name, set) in [
        (field, arrays),
        ("noise", run.noise),
        ("position", positions),
    ] {
        for array in set {
            if array.len() % n_axes != 0 || array.is_empty() {
                let expected = format!("samples of {n_axes} axes");
                return Err(shape(name, expected, format!("{} numbers", array.len())));
            }
            // The whole array first: without an early exit the scan is vector code.
            let all_finite = array.iter().fold(true, |all, v| all & v.is_finite());
            let bad = || array.iter().position(|v| !v.is_finite());
            if let Some(i) = (!all_finite).then(bad).flatten() {
                let got = format!("{} at sample {}", array[i], i / n_axes);
                return Err(shape(name, "finite numbers".to_owned(), got));
            }
        }
    }
    Ok(arrays.iter().map(|a| a.len() / n_axes).max().unwrap_or(0))
}
