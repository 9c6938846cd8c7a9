//! The sampled loop around the linear plant.

use super::harmonics::Ripple;
use super::plant::{LinearAxis, LinearPlant};
use super::propagator::Propagator;
use super::sensing::LinearSensing;
use super::tiles::Tiles;
use axisight_plant::simulation::{
    ControlLoop, Line, Method, OwnLaw, Run, Sample, SampleTorque, Signals, SimulationError, Status,
    TorqueBuffers, TorquePath, check, lane_value,
};
use axisight_scalar::Scalar;
use std::borrow::Cow;
use std::sync::atomic::Ordering;

/// Simulate the linear plant until the longest lane ends; `observe` receives every sample.
///
/// Everything but the ripple is exact for any sample time. The ripple has an error of order 4 in
/// the step. The fixed-step methods divide the sample into `substeps` steps; any other method takes
/// one step. The error is then about `(n phi' h)^4 / 400` of the amplitude of harmonic `n`, at
/// motor speed `phi'` and step `h`.
///
/// `run.start` must be where `plant` was linearized.
///
/// # Errors
/// [`SimulationError`] if the input is invalid. A failure during the run is a [`Status`]. Ripple
/// that is too steep for its step gives [`Status::StepSizeCollapsed`] at the first such sample;
/// later samples are not valid.
#[inline(never)]
pub fn simulate_linear<S: Scalar>(
    plant: &LinearPlant,
    run: &Run<'_>,
    observe: &mut dyn FnMut(&Sample<'_, S>),
) -> Result<Status, SimulationError> {
    let n_samples = check(run, plant.n_axes(), S::LANES)?;
    #[allow(clippy::float_cmp)] // the same numbers, not nearby ones
    let elsewhere = run.start.iter().find(|start| **start != plant.start);
    if let Some(start) = elsewhere {
        return Err(SimulationError::Shape {
            field: "start",
            expected: format!("{:?}, where the plant was linearized", plant.start),
            got: format!("{start:?}"),
        });
    }
    let mut state = LinearLoop::<S>::new(plant, run)?;
    let mut paths = torque_paths(plant, run)?;
    Ok(samples(&mut state, &mut paths, run, n_samples, observe))
}

#[inline(always)]
fn samples<S: Scalar>(
    state: &mut LinearLoop<'_, S>,
    paths: &mut [TorquePath<S>],
    run: &Run<'_>,
    n_samples: usize,
    observe: &mut dyn FnMut(&Sample<'_, S>),
) -> Status {
    let mut buffers = TorqueBuffers::new(paths.len());
    let mut collapsed = None;
    for k in 0..n_samples {
        if run.cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Status::Cancelled(k);
        }
        state.signals(run, k);
        let readings = &state.sensing.readings;
        observe(&state.signals.sample(k, &state.absolute, readings));
        let mut torque = SampleTorque::new(
            paths,
            &state.signals.command,
            &state.signals.added,
            &mut buffers,
        );
        for substep in 0..state.substeps {
            state.step(torque.part(substep, state.substeps));
            torque.accept();
        }
        torque.finish();
        if !state.settle() {
            return Status::Diverged(collapsed.unwrap_or(k));
        }
        // An unstable loop also makes the ripple steep. Continue, to see whether the loop is
        // unstable.
        let steep = (0..S::LANES).any(|lane| state.coarse.lane(lane) > 0.0);
        if steep && collapsed.is_none() {
            collapsed = Some(k);
        }
    }
    collapsed.map_or(Status::Completed, Status::StepSizeCollapsed)
}

/// Changes of the controller by effects in the command path. They exist only if position references
/// are delayed.
fn own_laws<S: Scalar>(
    plant: &LinearPlant,
    run: &Run<'_>,
) -> Result<Vec<OwnLaw<S>>, SimulationError> {
    if !run.has_late_targets() {
        return Ok(Vec::new());
    }
    let of_axis = |kernels: Vec<_>| OwnLaw::of_axis(&kernels, run.sample_time);
    let each = plant.axes.iter().map(LinearAxis::path_kernels);
    Ok(each
        .map(|kernels| kernels.map(of_axis))
        .collect::<Result<_, _>>()?)
}

/// The torque path of every axis, settled at rest.
fn torque_paths<S: Scalar>(
    plant: &LinearPlant,
    run: &Run<'_>,
) -> Result<Vec<TorquePath<S>>, SimulationError> {
    let torques = &plant.linear.equilibrium.motor_torque;
    let mut paths = Vec::with_capacity(torques.len());
    for (axis, u) in plant.axes.iter().zip(torques) {
        let rest = S::constant(*u);
        let kernels = axis.path_kernels()?;
        let path = TorquePath::through(kernels, rest, run.sample_time);
        paths.push(if run.has_late_targets() {
            path.at_once()
        } else {
            path
        });
    }
    Ok(paths)
}

/// State of a run.
struct LinearLoop<'a, S: Scalar> {
    plant: &'a LinearPlant,
    propagator: Cow<'a, Propagator>,
    substeps: usize,
    torque_ripple: bool,
    controller: ControlLoop<S>,
    signals: Signals<S>,
    sensing: LinearSensing<'a, S>,
    /// Ripple at the present motor angles.
    ripple: Vec<Ripple<S>>,
    powers: Vec<[S; 2]>,
    /// Predicted motor angles [rad].
    angles: Vec<S>,
    /// `[t_0, d_0, x]`, padded: the torque, its change over the step, and the deviation of the
    /// state.
    input: Vec<S>,
    /// Predicted deviation at the end of the step, padded.
    predicted: Vec<S>,
    /// `[e_1, e_2]`, the error of the predicted torque.
    missed: Vec<S>,
    /// The absolute state `[phi, q, phi', q']`.
    absolute: Vec<S>,
    /// One in the lanes with ripple that is too steep for the step, otherwise zero.
    coarse: S,
}

/// Largest angle [rad] by which a correction may move the highest harmonic, because the ripple is
/// moved to first order only. Steeper ripple needs more sub-steps.
const FARTHEST_MOVE: f64 = 0.1;

impl<'a, S: Scalar> LinearLoop<'a, S> {
    fn new(plant: &'a LinearPlant, run: &Run<'_>) -> Result<Self, SimulationError> {
        let (n, m) = (plant.n_states(), plant.n_axes());
        let substeps = match run.method {
            Method::RungeKutta4 { substeps } | Method::Nystrom4 { substeps } => substeps.max(1),
            _ => 1,
        };
        let step = run.sample_time / substeps as f64;
        #[allow(clippy::float_cmp)] // prepared for exactly this step or not
        let propagator = if step == plant.propagator.step {
            Cow::Borrowed(&plant.propagator)
        } else {
            Cow::Owned(Propagator::new(&plant.linear.a, &plant.linear.b, step))
        };
        let at = &plant.linear.equilibrium;
        let lift = |values: &[f64]| -> Vec<S> { values.iter().map(|v| S::constant(*v)).collect() };
        let (angle, torque) = (lift(&at.motor_angle), lift(&at.motor_torque));
        let mut powers = vec![[S::zero(); 2]; plant.waves.scratch()];
        let mut ripple = vec![Ripple::zero(); m];
        plant.waves.evaluate(&angle, &mut powers, &mut ripple);
        let padded = Tiles::padded(n);
        Ok(Self {
            plant,
            propagator,
            substeps,
            torque_ripple: plant.waves.act_on_torque(),
            controller: ControlLoop::new(
                run.controller,
                run.sample_time,
                &angle,
                &torque,
                own_laws(plant, run)?,
            )?,
            signals: Signals::new(m),
            sensing: LinearSensing::new(plant, run),
            ripple,
            powers,
            angles: angle,
            input: vec![S::zero(); 2 * m + padded],
            predicted: vec![S::zero(); padded],
            missed: vec![S::zero(); 2 * m],
            absolute: lift(&plant.rest),
            coarse: S::zero(),
        })
    }

    /// Measure, compute the commands, and note the torque disturbances of the motors.
    #[inline(always)]
    fn signals(&mut self, run: &Run<'_>, k: usize) {
        let (n, m) = (self.plant.n_states(), self.plant.n_axes());
        let deviation = &self.input[2 * m..];
        for (i, axis) in self.plant.axes.iter().enumerate() {
            let angle = deviation[axis.slot] * axis.scale + axis.angle;
            let error = lane_value::<S>(run.noise, k, i, m) + self.ripple[i].resolver.value;
            self.signals
                .read(i, angle, error, S::constant(run.resolution));
        }
        self.signals.command(run, k, &mut self.controller);
        for (i, axis) in self.plant.axes.iter().enumerate() {
            let speed = deviation[axis.slot + n / 2] * axis.scale;
            let ripple = self.ripple[i].torque(self.signals.command[i]).value;
            self.signals.torque_disturbance[i] = ripple - speed * axis.viscous;
        }
    }

    /// Advance the deviation by one sub-step under the torques `lines` of the axes.
    #[inline(always)]
    fn step(&mut self, lines: &[Line<S>]) {
        let (n, m) = (self.plant.n_states(), self.plant.n_axes());
        let step = self.propagator.step;
        for (i, (axis, line)) in self.plant.axes.iter().zip(lines).enumerate() {
            let ripple = self.ripple[i].torque(self.signals.command[i]);
            let speed = self.input[2 * m + axis.slot + n / 2] * (axis.scale * step);
            let (from, to) = (line.at(0.0), line.at(1.0));
            let change = ripple.slope * speed;
            self.input[i] = from - S::constant(axis.torque) + ripple.value;
            self.input[m + i] = to - from + change;
            // Minus the prediction of the straight line for the end of the step.
            self.missed[i] = -(ripple.value + change);
            self.missed[m + i] = -change;
        }
        self.propagator
            .predict
            .multiply(&self.input, None, &mut self.predicted);
        if self.torque_ripple {
            self.correct();
        } else {
            self.input[2 * m..].copy_from_slice(&self.predicted);
            if !self.plant.waves.is_empty() {
                self.ripple_at_prediction();
            }
        }
        if !self.sensing.readings.is_empty() {
            self.sense(lines);
        }
    }

    /// Read the accelerometers at the end of a step under the torques `lines`.
    fn sense(&mut self, lines: &[Line<S>]) {
        let m = self.plant.n_axes();
        for (i, (axis, line)) in self.plant.axes.iter().zip(lines).enumerate() {
            let ripple = self.ripple[i].torque(self.signals.command[i]).value;
            self.sensing
                .note(i, line.at(1.0) - S::constant(axis.torque) + ripple);
        }
        self.sensing.read(&self.input[2 * m..]);
    }

    /// Evaluate the ripple at the predicted motor angles.
    #[inline(always)]
    fn ripple_at_prediction(&mut self) {
        for (angle, axis) in self.angles.iter_mut().zip(&self.plant.axes) {
            *angle = self.predicted[axis.slot] * axis.scale + axis.angle;
        }
        let waves = &self.plant.waves;
        waves.evaluate(&self.angles, &mut self.powers, &mut self.ripple);
    }

    /// Correct the prediction for the ripple at its end.
    #[inline(always)]
    fn correct(&mut self) {
        let (n, m) = (self.plant.n_states(), self.plant.n_axes());
        let step = self.propagator.step;
        self.ripple_at_prediction();
        for (i, axis) in self.plant.axes.iter().enumerate() {
            let speed = self.predicted[axis.slot + n / 2] * (axis.scale * step);
            let ripple = self.ripple[i].torque(self.signals.command[i]);
            self.missed[i] += ripple.value;
            self.missed[m + i] = ripple.slope.fma(speed, self.missed[m + i]);
        }
        let deviation = &mut self.input[2 * m..];
        self.propagator
            .correct
            .multiply(&self.missed, Some(&self.predicted), deviation);
        // The error of the predicted angle is of fourth order. Its square is far below the error of
        // the method, so one evaluation serves both angles.
        for (i, axis) in self.plant.axes.iter().enumerate() {
            let by = (deviation[axis.slot] - self.predicted[axis.slot]) * axis.scale;
            self.ripple[i] = self.ripple[i].moved(by);
            let far = by.abs() * self.plant.waves.highest - FARTHEST_MOVE;
            self.coarse = far.if_positive(S::one(), self.coarse);
        }
    }

    /// Compute the absolute state at the new sample. Returns false if it is not finite.
    #[inline(always)]
    fn settle(&mut self) -> bool {
        let deviation = &self.input[2 * self.plant.n_axes()..];
        // Infinity and NaN times zero are NaN, and the sum keeps a NaN.
        let mut trace = S::zero();
        for ((x, d), rest) in self
            .absolute
            .iter_mut()
            .zip(deviation)
            .zip(&self.plant.rest)
        {
            *x = *d + *rest;
            trace = d.fma(S::zero(), trace);
        }
        (0..S::LANES).all(|l| !trace.lane(l).is_nan())
    }
}
