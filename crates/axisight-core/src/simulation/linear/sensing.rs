//! Accelerometers on the linear plant.

use super::plant::LinearPlant;
use axisight_plant::plant::LinearReadings;
use axisight_plant::simulation::Run;
use axisight_scalar::Scalar;

/// Linear readings of accelerometers. A sample is taken before its command acts.
pub(super) struct LinearSensing<'a, S> {
    linear: &'a LinearReadings,
    /// Torques on the motors that command and ripple deliver, minus those at rest [Nm].
    torque: Vec<S>,
    /// The last readings [m/s^2]; empty without accelerometers.
    pub(super) readings: Vec<S>,
}

impl<'a, S: Scalar> LinearSensing<'a, S> {
    /// Accelerometers of `plant`; none unless `run` requests them.
    pub(super) fn new(plant: &'a LinearPlant, run: &Run<'_>) -> Self {
        let linear = &plant.linear.specific_force;
        let rest = linear.rest.iter().filter(|_| run.accelerometers);
        Self {
            linear,
            torque: vec![S::zero(); plant.n_axes()],
            readings: rest.map(|f| S::constant(*f)).collect(),
        }
    }

    /// Read the accelerometers at the deviation `deviation` of the state.
    pub(super) fn read(&mut self, deviation: &[S]) {
        let LinearReadings { rest, c, d } = self.linear;
        for (row, reading) in self.readings.iter_mut().enumerate() {
            let mut sum = S::constant(rest[row]);
            for (x, slope) in deviation.iter().zip(c.row(row).iter()) {
                sum = x.axpy(*slope, sum);
            }
            for (u, slope) in self.torque.iter().zip(d.row(row).iter()) {
                sum = u.axpy(*slope, sum);
            }
            *reading = sum;
        }
    }

    /// Note the torque of an axis at the end of a step, minus that at rest [Nm].
    pub(super) fn note(&mut self, axis: usize, torque: S) {
        self.torque[axis] = torque;
    }
}
