//! The sampled loop: measure, command, integrate to the next sample.

use super::beside::{Beside, HeldBeside};
use super::controller::{ControlLoop, OwnLaw};
use super::lanes::{lane_value, value_at};
use super::late_reading::LateReading;
use super::method::{Interval, Method, Stepper};
use super::sensing::Sensing;
use super::torque_path::{SampleTorque, TorqueBuffers, TorquePath};
use crate::effect::EffectError;
use crate::plant::{Axis, EquilibriumError, Lead, Plant, PlantError, equilibrium};
use crate::robot::Controller;
use axisight_scalar::Scalar;
use std::sync::atomic::{AtomicBool, Ordering};

/// Input of a run. Arrays are row-major `(n_samples, n_axes)`, one per lane.
#[derive(Debug, Clone, Copy)]
pub enum Drive<'a> {
    /// Motor-side velocity references through the controller [rad/s].
    Reference(&'a [&'a [f64]]),
    /// Commanded torques without a controller [Nm].
    Torque(&'a [&'a [f64]]),
    /// A logged run: its commanded torques [Nm], plus a feedback torque that keeps the simulation
    /// on the logged positions [rad].
    ///
    /// In a linear loop, the added torque is the error that a simulation driven by references would
    /// have. In a nonlinear loop, the simulation also stays in phase with the log (lost motion,
    /// stiction).
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
    /// References or torques. A lane that is shorter than the longest is continued with zeros.
    pub drive: Drive<'a>,
    /// Position measurement noise per lane, shaped like the drive; empty for none [rad].
    pub noise: &'a [&'a [f64]],
    /// Integrator. For a linear plant, only the sub-steps of Runge-Kutta methods are used.
    pub method: Method,
    /// Step of the position sensor [rad]; zero for none.
    pub resolution: f64,
    /// Whether samples include the torque that effects add on the motors; otherwise it is zero.
    pub disturbances: bool,
    /// Whether samples include the readings of the accelerometers; otherwise there are none.
    pub accelerometers: bool,
    /// Flag by which another thread ends the run early.
    pub cancel: Option<&'a AtomicBool>,
}

impl Run<'_> {
    /// Whether delays act on position references instead of torques.
    pub fn has_late_targets(&self) -> bool {
        matches!(self.drive, Drive::Reference(_)) && self.controller.has_targets()
    }

    /// Driven joint angles at the start, with the values of each lane.
    pub fn start_angles<S: Scalar>(&self, n_axes: usize) -> Vec<S> {
        (0..n_axes)
            .map(|axis| lane_value(self.start, 0, axis, n_axes))
            .collect()
    }
}

/// One sample as the log records it, with the true disturbances and state.
#[derive(Debug)]
pub struct Sample<'a, S> {
    /// Sample number.
    pub index: usize,
    /// Commanded motor torque as the drive reports it [Nm].
    pub command: &'a [S],
    /// Measured motor position [rad].
    pub measured: &'a [S],
    /// Torque that ripple, friction and other effects add on the motor [Nm]; zero unless the run
    /// requests it.
    pub torque_disturbance: &'a [S],
    /// Error of the position measurement, noise included [rad].
    pub position_disturbance: &'a [S],
    /// Readings of the accelerometers [m/s^2]: the directions of the first one, then of the next
    /// one. Empty unless the run requests them.
    pub specific_force: &'a [S],
    /// State `[phi, q, phi', q']`.
    pub state: &'a [S],
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All samples were simulated.
    Completed,
    /// A state became infinite or NaN at this sample, so the loop is unstable.
    Diverged(usize),
    /// The error bound could not be met at this sample. The plant is too stiff for an explicit
    /// method, or a parameter is far off.
    StepSizeCollapsed(usize),
    /// The run was cancelled before this sample.
    Cancelled(usize),
}

/// Error in the use of the simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The arm does not settle.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// An array has the wrong size or a non-finite entry.
    #[error("{field}: expected {expected}, got {got}")]
    Shape {
        /// Name of the argument.
        field: &'static str,
        /// Expected value.
        expected: String,
        /// Actual value.
        got: String,
    },
    /// The method is implicit, but the stepper was made without [`Stepper::with_jacobian`].
    #[error(
        "method: expected an explicit one for several runs in lock-step or for derivatives, got {0:?}"
    )]
    NoJacobian(Method),
    /// The course does not fit the run.
    #[error(
        "course: expected at least {expected} samples and a method of fixed steps, got {got} samples and {method:?}"
    )]
    Course {
        /// Number of samples of the run.
        expected: usize,
        /// Number of samples of the course.
        got: usize,
        /// Integrator.
        method: Method,
    },
    /// A reference-driven run needs a controller.
    #[error("controller: expected one for a run driven by velocity references, got kind `none`")]
    NoController,
    /// An effect is used incorrectly.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The robot model of the controller cannot be built.
    #[error(transparent)]
    Known(#[from] PlantError),
}

/// Simulate until the longest lane ends; `observe` receives every sample.
///
/// # Errors
/// [`SimulationError`] if the input is invalid. A failure during the run is a [`Status`].
#[inline(never)]
pub fn simulate<S: Scalar>(
    plant: &Plant<S>,
    run: &Run<'_>,
    stepper: &mut Stepper<S>,
    observe: &mut dyn FnMut(&Sample<'_, S>),
) -> Result<Status, SimulationError> {
    simulate_beside(plant, run, None, stepper, observe)
}

/// [`simulate`] with torques beside the plant, which are held over a sample.
///
/// # Errors
/// [`SimulationError`] as [`simulate`].
#[inline(never)]
pub fn simulate_beside<S: Scalar>(
    plant: &Plant<S>,
    run: &Run<'_>,
    beside: Option<Beside<'_>>,
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
    let mut rest = equilibrium(plant, &run.start_angles(n_axes))?;
    stepper.begin();
    let mut x = plant.state_at_rest(&rest);
    let mut beside = match beside {
        Some(ask) => match HeldBeside::new(ask, plant, &mut rest, &x)? {
            Some(held) => Some(held),
            None => return Ok(Status::Cancelled(0)),
        },
        None => None,
    };
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
    let mut sensing = Sensing::new(plant, &rest, stepper, run.accelerometers);
    for k in 0..n_samples {
        if run.cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Ok(Status::Cancelled(k));
        }
        signals.measure(plant, run, k, &x);
        signals.command(run, k, &mut controller);
        if let Some(beside) = &mut beside
            && !beside.ask_at(plant, k as f64 * run.sample_time, &x, &mut buffers.beside)?
        {
            return Ok(Status::Cancelled(k));
        }
        if run.disturbances {
            signals.disturb(plant, &x, &buffers.beside);
        }
        if let Some(sensing) = &mut sensing {
            sensing.read(plant, k, &x);
        }
        let readings = sensing.as_ref().map_or(&[][..], |s| &s.readings);
        observe(&signals.sample(k, &x, readings));
        let interval = Interval {
            plant,
            command: &signals.command,
            sample_time: run.sample_time,
        };
        stepper.enter(k);
        let mut torque =
            SampleTorque::new(&mut paths, &signals.command, &signals.added, &mut buffers);
        let met = interval.advance(run.method, &mut x, stepper, &mut torque);
        if let Some(sensing) = &mut sensing {
            sensing.note(&torque, &signals.command);
        }
        if let Some(beside) = &mut beside {
            beside.note(&torque, &signals.command);
        }
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

/// Refuse a rigid gear that another axis turns, because it would be a constraint.
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

/// Whether all states are finite: zero times their sum is NaN if any is not.
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
    /// Part of the commands that keeps the simulation on a log [Nm]; zero without a log.
    pub added: Vec<S>,
    /// Torque that effects add on the motors [Nm].
    pub torque_disturbance: Vec<S>,
    /// Error of the measured positions, noise included [rad].
    pub position_disturbance: Vec<S>,
    /// Error of joint encoders at the start of the run [rad].
    joint_error_at_start: Vec<S>,
    /// Relative error of the controller's clock, positive if fast compared with the references;
    /// `None` if both use one clock.
    clock_drift: Option<S>,
    /// Share of each command that the drive reports, and the reported torque [Nm]; empty if every
    /// drive reports its full command.
    reported_share: Vec<S>,
    reported: Vec<S>,
    /// Delayed readings by axis; empty if no motor is read with a delay.
    late: Vec<Option<LateReading<S>>>,
}

impl<S: Scalar> Signals<S> {
    /// Signals of zero.
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

    /// Signals of zero for a plant at rest at the motor angles `angle`, prepared for reported
    /// torques and delayed readings.
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

    /// Error of the joint encoders of an axis, motor side [rad], relative to the start of the run.
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

    /// Read an axis at motor angle `angle`, rounded to the nearest step of the sensor.
    #[inline(always)]
    pub fn read(&mut self, axis: usize, angle: S, mut error: S, resolution: S) {
        if (0..S::LANES).any(|lane| resolution.lane(lane) > 0.0) {
            let exact = angle + error;
            // Rounding is constant between its jumps, so derivatives pass unchanged.
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

    /// Compute the command of sample `k` from the measured positions.
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

    /// Compute the torque on the motors of effects and `beside` the plant in the present state.
    fn disturb(&mut self, plant: &Plant<S>, x: &[S], beside: &[S]) {
        plant.motor_disturbances(x, &self.command, &mut self.torque_disturbance);
        for (torque, beside) in self.torque_disturbance.iter_mut().zip(beside) {
            *torque += *beside;
        }
    }

    /// The sample `index` in state `x` with the readings of accelerometers, for an observer.
    pub fn sample<'a>(
        &'a self,
        index: usize,
        x: &'a [S],
        specific_force: &'a [S],
    ) -> Sample<'a, S> {
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
            specific_force,
            state: x,
        }
    }
}

/// Check a run of `n_axes` axes in at most `lanes` lanes; returns its number of samples.
///
/// # Errors
/// [`SimulationError`] that names the invalid field.
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
            // Scan the whole array first: without an early exit the loop becomes vector code.
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
