//! Torques beside the plant: a function of the motion that is asked at every sample, and held.

use super::closed_loop::SimulationError;
use super::torque_path::SampleTorque;
use crate::plant::{Axis, Equilibrium, Plant};
use axisight_scalar::Scalar;
use std::fmt;

/// The motion of the motors at a sample, one number per axis, motor side.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time since the start of the run [s].
    pub time: f64,
    /// Motor angles [rad].
    pub angle: Vec<f64>,
    /// Motor speeds [rad/s].
    pub speed: Vec<f64>,
    /// Motor accelerations [rad/s^2] before the command of the sample acts.
    pub acceleration: Vec<f64>,
    /// Torques through the gears [Nm], without rotors and friction of motors.
    pub load: Vec<f64>,
}

/// Torque [Nm] on each motor at a moment; `None` ends the run.
#[derive(Clone, Copy)]
pub struct Beside<'a>(pub &'a (dyn Fn(&Moment) -> Option<Vec<f64>> + Sync));

impl fmt::Debug for Beside<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Beside")
    }
}

/// The torques beside a plant during a run.
pub(super) struct HeldBeside<'a, S> {
    ask: Beside<'a>,
    /// Delivered torques with those beside the plant, and the commands behind them, at the end of
    /// the last interval.
    applied: Vec<S>,
    command: Vec<S>,
    rates: Vec<S>,
    loads: Vec<S>,
}

impl<'a, S: Scalar> HeldBeside<'a, S> {
    /// Begin a run from `rest` in state `x`. The commands at rest also carry the torque beside the
    /// plant. `None` if the function ends the run.
    ///
    /// # Errors
    /// [`SimulationError`] for several runs in lock-step, for derivatives, and for a function that
    /// returns another number of torques.
    pub(super) fn new(
        ask: Beside<'a>,
        plant: &Plant<S>,
        rest: &mut Equilibrium<S>,
        x: &[S],
    ) -> Result<Option<Self>, SimulationError> {
        if S::LANES > 1 || S::PARTIALS > 0 {
            return Err(SimulationError::Shape {
                field: "beside",
                expected: "one run of plain numbers".to_owned(),
                got: format!("{} runs with {} derivatives", S::LANES, S::PARTIALS),
            });
        }
        let drives = plant.axes.iter().zip(&rest.motor_torque);
        let mut held = Self {
            ask,
            applied: drives.map(|(axis, u)| delivered(axis, *u)).collect(),
            command: rest.motor_torque.clone(),
            rates: vec![S::zero(); plant.n_states()],
            loads: vec![S::zero(); plant.axes.len()],
        };
        let mut torque = vec![S::zero(); plant.axes.len()];
        if !held.ask_at(plant, 0.0, x, &mut torque)? {
            return Ok(None);
        }
        for ((axis, u), torque) in plant.axes.iter().zip(&mut rest.motor_torque).zip(torque) {
            let drives = axis.kernels.iter().rev();
            *u = drives.fold(delivered(axis, *u) - torque, |u, k| k.drive_inverse(u));
        }
        held.command.copy_from_slice(&rest.motor_torque);
        Ok(Some(held))
    }

    /// Write the torques on the motors at `time` in state `x` to `torque`; false ends the run.
    ///
    /// # Errors
    /// [`SimulationError`] as [`HeldBeside::new`].
    pub(super) fn ask_at(
        &mut self,
        plant: &Plant<S>,
        time: f64,
        x: &[S],
        torque: &mut [S],
    ) -> Result<bool, SimulationError> {
        let mut scratch = plant.scratch();
        let Self {
            applied,
            command,
            rates,
            loads,
            ..
        } = self;
        plant.derivative(x, applied, command, &mut scratch, rates);
        plant.gear_loads(x, rates, applied, command, loads);
        let of = |value: &dyn Fn(&Axis<S>) -> S| -> Vec<f64> {
            plant.axes.iter().map(|axis| value(axis).lane(0)).collect()
        };
        let now = Moment {
            time,
            angle: of(&|axis| plant.motor_angle(axis, x)),
            speed: of(&|axis| plant.motor_speed(axis, x)),
            // Rates of the rates stand where the rates do in the state.
            acceleration: of(&|axis| plant.motor_speed(axis, rates)),
            load: loads.iter().map(|load| load.lane(0)).collect(),
        };
        let Some(found) = (self.ask.0)(&now) else {
            return Ok(false);
        };
        if found.len() != torque.len() || !found.iter().all(|value| value.is_finite()) {
            return Err(SimulationError::Shape {
                field: "beside",
                expected: "one finite torque for each axis".to_owned(),
                got: format!("{found:?} at {time} s"),
            });
        }
        for (torque, value) in torque.iter_mut().zip(found) {
            *torque = S::constant(value);
        }
        Ok(true)
    }

    /// Note the torques at the end of an interval with the commands `command`.
    pub(super) fn note(&mut self, torque: &SampleTorque<'_, S>, command: &[S]) {
        self.command.copy_from_slice(command);
        for (applied, line) in self.applied.iter_mut().zip(torque.lines()) {
            *applied = line.at(1.0);
        }
    }
}

/// Motor torque that the drive of an axis delivers for a command.
fn delivered<S: Scalar>(axis: &Axis<S>, command: S) -> S {
    axis.kernels.iter().fold(command, |u, k| k.drive(u))
}
