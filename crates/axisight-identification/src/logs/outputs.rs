//! Compared outputs of a simulation, and what is a log's own.
//!
//! The outputs of a log are the motor outputs of all axes (torques or positions), then, if joint
//! encoders are compared, the angles of the driven joints. A joint encoder has a zero of its own, so
//! its mean error over a log says nothing and is removed, as are the means of the derivatives. This
//! is the least-squares fit of one offset per log and joint.

use super::packing::Packing;
use super::record::Record;
use super::simulation_error::{SimulationErrorProblem, Traces};
use axisight_core::robot::EffectSetting;
use axisight_numerics::Weighting;
use axisight_scalar::Scalar;

impl SimulationErrorProblem {
    /// Number of compared outputs of a log.
    pub(super) fn n_outputs(&self) -> usize {
        self.weightings().count()
    }

    /// The weightings of the outputs.
    pub(super) fn weightings(&self) -> impl Iterator<Item = &Weighting> {
        self.weighting.iter().chain(&self.joint_weighting)
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
        let (axis, first) = (output % n_axes, record.lead * n_axes);
        let is_joint = output >= n_axes;
        let measured = if is_joint {
            record.joint.as_deref().unwrap_or_default()
        } else {
            &record.target
        };
        let column = measured.iter().skip(first + axis).step_by(n_axes);
        if is_joint && (measured.is_empty() || column.clone().any(|y| y.is_nan())) {
            // This axis has no joint encoder.
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
        if is_joint {
            let samples = measured[first..].len() / n_axes;
            for quantity in traces {
                centre(&mut quantity[slot], samples);
            }
        }
    }

    /// Multiply whitened series by the certainty of the log.
    fn doubt(
        &self,
        record: &Record,
        output: usize,
        decimation: usize,
        slot: usize,
        out: &mut [Vec<Vec<f64>>],
    ) {
        let n_axes = self.robot.n_axes();
        let Some(certainty) = &record.certainty else {
            return;
        };
        let factors = certainty[output % n_axes..]
            .iter()
            .step_by(decimation * n_axes);
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
