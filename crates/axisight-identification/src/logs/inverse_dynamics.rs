//! Inverse-dynamics error: torque predicted from a measured motion.
//!
//! Gears count as rigid (`q = r phi`) and elastic joints as standing still, so the prediction is
//! valid below the first resonance. Effects of the transmission and the sensor cannot be included.

use super::gram::{Block, blocks};
use super::lateness::commanded;
use super::problem::{
    Evaluation, FitParameter, Problem, ProblemError, check_logs, invalid, picked, seeded,
};
use axisight_core::effects::{CoupledAxis, Motor};
use axisight_core::plant::{Axis, Plant, assemble};
use axisight_core::robot::{DynamicsScratch, EffectSetting, RobotDescription};
use axisight_numerics::Weighting;
use axisight_scalar::{Dual, Scalar};
use rayon::prelude::*;
use std::sync::Arc;

/// Number of derivatives per pass.
const SEEDS: usize = 8;

/// A measured motion. Arrays are row-major `(n_samples, n_axes)`, motor side.
#[derive(Debug, Clone)]
pub struct MotionRecord {
    /// Motor position [rad].
    pub position: Vec<f64>,
    /// Motor velocity [rad/s].
    pub velocity: Vec<f64>,
    /// Motor acceleration [rad/s^2].
    pub acceleration: Vec<f64>,
    /// Motor torque [Nm].
    pub torque: Vec<f64>,
    /// Factor on the weighted error of each sample, from 0 to 1: how well the torque can be
    /// predicted there.
    pub certainty: Vec<f64>,
}

/// An inverse-dynamics problem.
#[derive(Debug, Clone)]
pub struct InverseDynamics {
    /// The robot.
    pub robot: RobotDescription,
    /// Effects of the model.
    pub effects: Vec<EffectSetting<f64>>,
    /// Parameters, in the order of `theta`.
    pub parameters: Vec<FitParameter>,
    /// The motions.
    pub records: Vec<Arc<MotionRecord>>,
    /// One weighting per axis.
    pub weighting: Vec<Weighting>,
    /// Length of a block [s].
    pub block_s: f64,
}

impl InverseDynamics {
    /// Check the shapes of all arrays.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] that names the invalid field.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let n_axes = self.robot.n_axes();
        check_logs(self.records.len(), &self.weighting, n_axes)?;
        for (i, r) in self.records.iter().enumerate() {
            let n = r.position.len();
            for (name, x) in [
                ("position", &r.position),
                ("velocity", &r.velocity),
                ("acceleration", &r.acceleration),
                ("torque", &r.torque),
                ("certainty", &r.certainty),
            ] {
                if x.len() != n || n == 0 || n % n_axes != 0 {
                    let expected = format!("{n} numbers, {n_axes} axes");
                    return Err(invalid(
                        format!("records[{i}].{name}"),
                        expected,
                        x.len().to_string(),
                    ));
                }
                if let Some(k) = x.iter().position(|v| !v.is_finite()) {
                    let got = format!("{} at sample {}", x[k], k / n_axes);
                    return Err(invalid(
                        format!("records[{i}].{name}"),
                        "finite numbers".into(),
                        got,
                    ));
                }
            }
        }
        Ok(())
    }

    /// The same problem with some of the motions, by their indices.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] if `logs` is empty or an index does not exist.
    pub fn part(&self, logs: &[usize]) -> Result<Self, ProblemError> {
        let records = picked(&self.records, logs)?;
        Ok(Self {
            records,
            ..self.clone()
        })
    }

    /// The same motions with other factors on the errors of their samples.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] if there is not one array per motion, or the factors are invalid.
    pub fn with_certainty(&self, certainty: Vec<Vec<f64>>) -> Result<Self, ProblemError> {
        if certainty.len() != self.records.len() {
            let expected = format!("one array for each of {} motions", self.records.len());
            let got = certainty.len().to_string();
            return Err(invalid("certainty".into(), expected, got));
        }
        let records = self.records.iter().zip(certainty);
        let weighed = |(record, certainty): (&Arc<MotionRecord>, Vec<f64>)| {
            Arc::new(MotionRecord {
                certainty,
                ..MotionRecord::clone(record)
            })
        };
        let found = Self {
            records: records.map(weighed).collect(),
            ..self.clone()
        };
        found.validate()?;
        Ok(found)
    }

    /// Predicted torque of one record, `[quantity][axis][sample]`, with the value first.
    ///
    /// If no seed is in the arm, its dynamics, which are most of the work, use plain numbers.
    fn predict<S: Scalar>(
        &self,
        record: &MotionRecord,
        theta: &[f64],
        seeds: &[usize],
    ) -> Result<Vec<Vec<Vec<f64>>>, ProblemError> {
        let (overrides, settings) =
            seeded::<S>(&self.parameters, &self.effects, theta, seeds, S::seeded);
        let plant = assemble(&self.robot, &overrides, &settings)?;
        if plant.arm_carries_derivatives() {
            return Ok(self.predicted(&plant, record, seeds.len(), &mut Arm::new(&plant)));
        }
        let (overrides, settings) =
            seeded::<f64>(&self.parameters, &self.effects, theta, &[], f64::seeded);
        let plain = assemble(&self.robot, &overrides, &settings)?;
        Ok(self.predicted(&plant, record, seeds.len(), &mut Arm::new(&plain)))
    }

    /// Torque of `plant` along a record, `[quantity][axis][sample]`, with the value first.
    fn predicted<S: Scalar, T: Scalar>(
        &self,
        plant: &Plant<S>,
        record: &MotionRecord,
        n_seeds: usize,
        arm: &mut Arm<'_, T>,
    ) -> Vec<Vec<Vec<f64>>> {
        let n_axes = plant.axes.len();
        let n_samples = record.position.len() / n_axes;
        let mut out = vec![vec![Vec::with_capacity(n_samples); n_axes]; n_seeds + 1];
        for k in 0..n_samples {
            let forces = arm.forces(record, k);
            let time = S::constant(k as f64 * self.robot.sample_time);
            for (i, axis) in plant.axes.iter().enumerate() {
                let turned = reaction(plant, forces, i) + coupled(plant, record, k, i);
                let force = lifted(&forces[axis.joint]);
                let command = drive(axis, record, (k * n_axes + i, time), force, turned);
                out[0][i].push(command.lane(0));
                for (seed, series) in out[1..].iter_mut().enumerate() {
                    series[i].push(command.partial(seed, 0));
                }
            }
        }
        for (i, axis) in plant.axes.iter().enumerate() {
            let own = out.iter_mut().map(|x| std::mem::take(&mut x[i])).collect();
            let late = commanded(&axis.kernels, self.robot.sample_time, own);
            out.iter_mut()
                .zip(late)
                .for_each(|(x, series)| x[i] = series);
        }
        out
    }

    /// Whitened series of residuals and derivatives of one record, axis after axis.
    fn pass(
        &self,
        record: &MotionRecord,
        theta: &[f64],
        seeds: &[usize],
    ) -> Result<Vec<Vec<f64>>, ProblemError> {
        let mut series = match seeds.len() {
            0 => self.predict::<f64>(record, theta, seeds)?,
            _ => self.predict::<Dual<f64, SEEDS>>(record, theta, seeds)?,
        };
        let n_axes = self.robot.n_axes();
        for (axis, model) in series[0].iter_mut().enumerate() {
            for (k, y) in model.iter_mut().enumerate() {
                *y -= record.torque[k * n_axes + axis];
            }
        }
        let n_samples = record.torque.len() / n_axes;
        let mut out = vec![Vec::new(); series.len()];
        for (axis, weighting) in self.weighting.iter().enumerate() {
            let plan = weighting.plan(n_samples, self.robot.sample_time);
            // Series of zeros need no filter. All others are filtered in pairs.
            let acting: Vec<usize> = (0..series.len())
                .filter(|i| series[*i][axis].iter().any(|x| *x != 0.0))
                .collect();
            let start = out[0].len();
            for target in &mut out {
                target.resize(start + weighting.output_len(n_samples), 0.0);
            }
            for pair in acting.chunks(2) {
                let (first, second) = (pair[0], pair[pair.len() - 1]);
                let (a, b) = plan.apply_pair(&series[first][axis], &series[second][axis]);
                out[first].splice(start.., a);
                if second != first {
                    out[second].splice(start.., b);
                }
            }
            for target in &mut out {
                let step = n_axes * weighting.decimation;
                let factors = record.certainty[axis..].iter().step_by(step);
                for (x, factor) in target[start..].iter_mut().zip(factors) {
                    *x *= factor;
                }
            }
        }
        Ok(out)
    }
}

/// The arm along a motion, which gives the forces on its driven joints without effects.
struct Arm<'a, S: Scalar> {
    plant: &'a Plant<S>,
    scratch: DynamicsScratch<S>,
    motion: [Vec<S>; 3],
    force: Vec<S>,
}

impl<'a, S: Scalar> Arm<'a, S> {
    fn new(plant: &'a Plant<S>) -> Self {
        let zeros = vec![S::zero(); plant.chain.len()];
        Self {
            plant,
            scratch: plant.scratch(),
            motion: [zeros.clone(), zeros.clone(), zeros.clone()],
            force: zeros,
        }
    }

    /// Force on every joint of the chain in sample `k`: `M(q) q'' + c(q, q') + g(q)`.
    fn forces(&mut self, record: &MotionRecord, k: usize) -> &[S] {
        let n_axes = self.plant.axes.len();
        let sources = [&record.position, &record.velocity, &record.acceleration];
        for (target, source) in self.motion.iter_mut().zip(sources) {
            for (axis, x) in self.plant.axes.iter().zip(&source[k * n_axes..]) {
                target[axis.joint] = S::constant(x * axis.ratio);
                for lead in &axis.led_by {
                    target[axis.joint] += lead.by * source[k * n_axes + lead.axis];
                }
            }
        }
        let [q, v, a] = &self.motion;
        self.plant
            .dynamics
            .forces_along(q, v, a, &mut self.scratch, &mut self.force);
        &self.force
    }
}

/// Torque of a motor on the other gears that it turns [Nm].
fn reaction<S: Scalar, T: Scalar>(plant: &Plant<S>, forces: &[T], motor: usize) -> S {
    let mut torque = S::zero();
    for axis in &plant.axes {
        for lead in axis.led_by.iter().filter(|lead| lead.axis == motor) {
            torque += lifted::<T, S>(&forces[axis.joint]) * lead.by;
        }
    }
    torque
}

/// Torque of a motor for effects between axes in sample `k` [Nm].
fn coupled<S: Scalar>(plant: &Plant<S>, record: &MotionRecord, k: usize, motor: usize) -> S {
    let first = k * plant.axes.len();
    let state = |i: usize| {
        let (angle, speed) = (record.position[first + i], record.velocity[first + i]);
        let ratio = plant.axes[i].ratio;
        let [motor_angle, motor_speed, joint_angle, joint_speed] =
            [angle, speed, angle * ratio, speed * ratio].map(S::constant);
        CoupledAxis {
            motor_angle,
            motor_speed,
            joint_angle,
            joint_speed,
        }
    };
    let mut torque = S::zero();
    for (axes, added) in plant.between_axes(state) {
        for (_, added) in axes.iter().zip(added).filter(|(i, _)| **i == motor) {
            torque -= added.motor + added.joint * plant.axes[motor].ratio;
        }
    }
    torque
}

/// A number over another scalar, with its derivatives if it has any.
fn lifted<T: Scalar, S: Scalar>(x: &T) -> S {
    (0..T::PARTIALS).fold(S::constant(x.lane(0)), |sum, seed| {
        let slope = x.partial(seed, 0);
        sum + S::zero().seeded(seed) * slope
    })
}

/// Commanded torque at entry `i` of a record and the time `time`.
///
/// `force` is the force that the arm needs on the joint, `turned` the torque that other axes need
/// on the motor.
fn drive<S: Scalar>(
    axis: &Axis<S>,
    record: &MotionRecord,
    (i, time): (usize, S),
    force: S,
    turned: S,
) -> S {
    let at = |x: &[f64]| S::constant(x[i]);
    let (angle, speed) = (at(&record.position), at(&record.velocity));
    let joint_force = force - axis.joint_torque_of(angle * axis.ratio, speed * axis.ratio);
    let motor = Motor {
        angle,
        speed,
        acceleration: at(&record.acceleration),
        command: at(&record.torque),
        load: joint_force * axis.ratio,
        internal: &[],
    };
    let mut torque = joint_force * axis.ratio
        + axis.motor_inertia * at(&record.acceleration)
        + axis.viscous_friction * speed
        + turned;
    for kernel in &axis.kernels {
        let state = kernel.state_at(time);
        let internal = state.as_slice();
        torque -= kernel.motor_torque(&Motor { internal, ..motor });
    }
    let kernels = axis.kernels.iter().rev();
    kernels.fold(torque, |t, k| k.drive_inverse(t))
}

impl Problem for InverseDynamics {
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError> {
        let mut chunks: Vec<&[usize]> = columns.chunks(SEEDS).collect();
        if chunks.is_empty() {
            chunks.push(&[]);
        }
        let tasks: Vec<(&Arc<MotionRecord>, usize, &[usize])> = self
            .records
            .iter()
            .flat_map(|r| chunks.iter().enumerate().map(move |(i, c)| (r, i, *c)))
            .collect();
        let done: Vec<_> = tasks
            .par_iter()
            .map(|(record, _, seeds)| self.pass(record, theta, seeds))
            .collect::<Result<_, ProblemError>>()?;
        let mut residual = Vec::new();
        let mut derivatives = vec![Vec::new(); columns.len()];
        for ((_, chunk, seeds), series) in tasks.iter().zip(done) {
            let mut series = series.into_iter();
            let first = series.next().unwrap_or_default();
            if *chunk == 0 {
                residual.extend(first);
            }
            for (i, column) in series.take(seeds.len()).enumerate() {
                derivatives[chunk * SEEDS + i].extend(column);
            }
        }
        Ok(Evaluation::new(residual, derivatives))
    }

    fn blocks(&self) -> Vec<Block> {
        let n_axes = self.robot.n_axes();
        let lengths = self.records.iter().map(|r| r.torque.len() / n_axes);
        blocks(
            lengths,
            &self.weighting,
            self.robot.sample_time,
            self.block_s,
        )
    }
}
