//! Accelerometers in a run: the acceleration of the arm at each sample.

use super::method::Stepper;
use super::torque_path::SampleTorque;
use crate::plant::{Equilibrium, Plant};
use crate::robot::DynamicsScratch;
use axisight_scalar::Scalar;

/// Reads the accelerometers of a plant.
///
/// A sample is taken before its command acts: the drives still deliver the torque of the interval
/// before. With a rigid gear, the acceleration jumps there.
pub(super) struct Sensing<S: Scalar> {
    scratch: DynamicsScratch<S>,
    rates: Vec<S>,
    /// Delivered torques, and the commands behind them.
    applied: Vec<S>,
    command: Vec<S>,
    /// The last readings [m/s^2].
    pub(super) readings: Vec<S>,
}

impl<S: Scalar> Sensing<S> {
    /// Accelerometers of `plant` in a run from `rest`, on the arm of `stepper`; without readings
    /// unless they are `wanted`.
    pub(super) fn new(
        plant: &Plant<S>,
        rest: &Equilibrium<S>,
        stepper: &Stepper<S>,
        wanted: bool,
    ) -> Option<Self> {
        let count = plant.n_readings();
        if !wanted || count == 0 {
            return None;
        }
        let drives = plant.axes.iter().zip(&rest.motor_torque);
        let applied = drives.map(|(axis, u)| axis.kernels.iter().fold(*u, |t, k| k.drive(t)));
        Some(Self {
            // The integrator keeps results in its own memory from step to step.
            scratch: stepper.plant_scratch.clone(),
            rates: vec![S::zero(); plant.n_states()],
            applied: applied.collect(),
            command: rest.motor_torque.clone(),
            readings: vec![S::zero(); count],
        })
    }

    /// Read the accelerometers at sample `k` in state `x`.
    pub(super) fn read(&mut self, plant: &Plant<S>, k: usize, x: &[S]) {
        if let Some(along) = &mut self.scratch.along {
            along.enter(k);
            along.go_to(0.0);
        }
        let (applied, command) = (&self.applied, &self.command);
        plant.derivative(x, applied, command, &mut self.scratch, &mut self.rates);
        plant.specific_force(x, &self.rates, &mut self.readings);
    }

    /// Note the torques at the end of an interval with the commands `command`.
    pub(super) fn note(&mut self, torque: &SampleTorque<'_, S>, command: &[S]) {
        self.command.copy_from_slice(command);
        for (applied, line) in self.applied.iter_mut().zip(torque.lines()) {
            *applied = line.at(1.0);
        }
    }
}
