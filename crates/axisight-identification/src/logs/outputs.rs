//! Compared outputs of a simulation, and what is a log's own.
//!
//! The outputs of a log are the motor outputs of all axes (torques or positions), then the readings
//! of sensors on the arm: joint encoders and accelerometers. Such a sensor has a zero of its own, so
//! its mean error over a log says nothing and is removed, as are the means of the derivatives. This
//! is the least-squares fit of one offset per log and reading.

use super::packing::Packing;
use super::problem::{ProblemError, check_weighting, invalid};
use super::record::Record;
use super::simulation_error::{SimulationErrorProblem, Traces};
use axisight_core::plant::Plant;
use axisight_core::robot::{EffectSetting, RobotDescription, n_readings};
use axisight_core::simulation::Sample;
use axisight_numerics::Weighting;
use axisight_scalar::Scalar;

/// What a sensor on the arm measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensed {
    /// Angle of the joint that an axis drives [rad].
    JointAngle(usize),
    /// A reading of the accelerometers [m/s^2], by its place among those of the robot.
    SpecificForce(usize),
}

/// A compared reading of a sensor on the arm.
#[derive(Debug, Clone)]
pub struct SensedOutput {
    /// The measured quantity.
    pub quantity: Sensed,
    /// Weighting of its error.
    pub weighting: Weighting,
}

impl Sensed {
    /// The quantity at a sample of `plant`.
    pub(super) fn at<S: Scalar>(self, plant: &Plant<S>, sample: &Sample<'_, S>) -> S {
        match self {
            Self::JointAngle(axis) => plant.joint_angle(&plant.axes[axis], sample.state),
            Self::SpecificForce(reading) => sample.specific_force[reading],
        }
    }

    /// The axis to which the quantity belongs, if to a single one.
    fn axis(self) -> Option<usize> {
        match self {
            Self::JointAngle(axis) => Some(axis),
            Self::SpecificForce(_) => None,
        }
    }
}

/// Refuse quantities that `robot` does not have, and invalid weightings.
pub(super) fn check_sensed(
    sensed: &[SensedOutput],
    robot: &RobotDescription,
) -> Result<(), ProblemError> {
    for one in sensed {
        let (kind, index, count) = match one.quantity {
            Sensed::JointAngle(axis) => ("axes", axis, robot.n_axes()),
            Sensed::SpecificForce(k) => ("readings", k, n_readings(&robot.accelerometers)),
        };
        if index >= count {
            let expected = format!("one of {count} {kind}");
            return Err(invalid("sensed".into(), expected, index.to_string()));
        }
        check_weighting(&one.weighting)?;
    }
    Ok(())
}

impl SimulationErrorProblem {
    /// Whether readings of accelerometers are compared.
    pub(super) fn compares_accelerations(&self) -> bool {
        let of_acceleration = |s: &SensedOutput| matches!(s.quantity, Sensed::SpecificForce(_));
        self.sensed.iter().any(of_acceleration)
    }

    /// Number of compared outputs of a log.
    pub(super) fn n_outputs(&self) -> usize {
        self.weightings().count()
    }

    /// The weightings of the outputs.
    pub(super) fn weightings(&self) -> impl Iterator<Item = &Weighting> {
        let sensed = self.sensed.iter().map(|s| &s.weighting);
        self.weighting.iter().chain(sensed)
    }

    /// Give each lane of `settings` the values that hold in its log only.
    pub(super) fn set_own_values<S: Scalar>(
        &self,
        records: &[usize],
        settings: &mut [EffectSetting<S>],
    ) {
        let in_lanes = Packing::of(records.len()).fill(records);
        let record = |lane: usize| in_lanes.get(lane).or(in_lanes.last());
        let all = records.iter().flat_map(|r| &self.records[*r].own);
        for one in all {
            let place = (one.effect, one.parameter);
            let number = settings
                .get_mut(place.0)
                .and_then(|s| s.parameters.get_mut(place.1));
            if let Some(number) = number {
                let usual = *number;
                *number = S::from_lanes(|lane| {
                    let own = record(lane).map_or(&[][..], |r| &self.records[*r].own);
                    let own = own.iter().find(|o| (o.effect, o.parameter) == place);
                    own.map_or_else(|| usual.lane(lane), |o| o.value)
                });
            }
        }
    }

    /// Whitened series of one batch: `[quantity][lane][output]`, residual first.
    pub(super) fn whiten(&self, records: &[usize], mut traces: Traces) -> Vec<Vec<Vec<f64>>> {
        let n_outputs = self.n_outputs();
        let mut out = vec![vec![Vec::new(); records.len() * n_outputs]; traces.len()];
        for (lane, number) in records.iter().enumerate() {
            let record = &self.records[*number];
            for (output, weighting) in self.weightings().enumerate() {
                let slot = lane * n_outputs + output;
                self.compare(record, output, slot, &mut traces);
                let plan = weighting.plan(self.n_samples(*number), self.robot.sample_time);
                for pair in (0..traces.len()).step_by(2) {
                    let second = (pair + 1).min(traces.len() - 1);
                    let (a, b) = plan.apply_pair(&traces[pair][slot], &traces[second][slot]);
                    out[pair][slot] = a;
                    out[second][slot] = if second == pair {
                        out[pair][slot].clone()
                    } else {
                        b
                    };
                }
                self.doubt(record, output, weighting.decimation, slot, &mut out);
            }
        }
        out
    }

    /// Subtract the measured output from the simulated one.
    fn compare(&self, record: &Record, output: usize, slot: usize, traces: &mut Traces) {
        let n_axes = self.robot.n_axes();
        let sensor = output.checked_sub(n_axes);
        let (measured, place, width) = match sensor {
            Some(place) => (&record.sensed, place, self.sensed.len()),
            None => (&record.target, output, n_axes),
        };
        let column = measured.iter().skip(record.lead * width + place);
        let column = column.step_by(width);
        if sensor.is_some() && (measured.is_empty() || column.clone().any(|y| y.is_nan())) {
            // The log lacks this sensor.
            for quantity in traces {
                quantity[slot].fill(0.0);
            }
            return;
        }
        let missing = std::iter::repeat(&0.0);
        let model = traces[0][slot].iter_mut();
        model
            .zip(column.chain(missing))
            .for_each(|(y, measured)| *y -= measured);
        if sensor.is_some() {
            let samples = measured.len() / width - record.lead;
            for quantity in traces {
                centre(&mut quantity[slot], samples);
            }
        }
    }

    /// Multiply whitened series of an axis by the certainty of the log.
    fn doubt(
        &self,
        record: &Record,
        output: usize,
        decimation: usize,
        slot: usize,
        out: &mut [Vec<Vec<f64>>],
    ) {
        let n_axes = self.robot.n_axes();
        let axis = match output.checked_sub(n_axes) {
            Some(place) => self.sensed[place].quantity.axis(),
            None => Some(output),
        };
        let (Some(certainty), Some(axis)) = (&record.certainty, axis) else {
            return;
        };
        let factors = certainty[axis..].iter().step_by(decimation * n_axes);
        for quantity in out {
            let values = quantity[slot].iter_mut().zip(factors.clone());
            values.for_each(|(x, factor)| *x *= factor);
        }
    }
}

/// Remove the mean of the first `samples` numbers from all of them.
fn centre(series: &mut [f64], samples: usize) {
    let own = &series[..samples.min(series.len())];
    let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
    for x in series {
        *x -= mean;
    }
}
