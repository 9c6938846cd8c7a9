//! Inverse-dynamics error: torque predicted from a measured motion.
//!
//! Gears count as rigid (`q = r phi`) and elastic joints as standing still, so the prediction is
//! valid below the first resonance. Effects of the transmission and the sensor cannot be included.

use super::gram::{Block, blocks};
use super::lateness::commanded;
use super::problem::{
    Evaluation, FitParameter, Problem, ProblemError, Target, check_logs, invalid, picked, seeded,
};
use axisight_core::effects::{Acts, CoupledAxis, Motor, info};
use axisight_core::plant::{Axis, Plant, assemble};
use axisight_core::robot::{DynamicsScratch, EffectSetting, Parameter, Place, RobotDescription};
use axisight_numerics::Weighting;
use axisight_scalar::{Dual, Scalar};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
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

    /// The columns in passes of at most [`SEEDS`]: those of each axis apart, and those of the arm.
    fn passes(&self, columns: &[usize]) -> Vec<Pass> {
        let mut by_axis: BTreeMap<Option<usize>, Pass> = BTreeMap::new();
        let mut out = Vec::new();
        for (place, parameter) in columns.iter().enumerate() {
            let axis = self.own_axis(*parameter);
            let pass = by_axis.entry(axis).or_insert_with(|| Pass::of(axis));
            pass.places.push(place);
            pass.seeds.push(*parameter);
            if pass.seeds.len() == SEEDS {
                out.push(std::mem::replace(pass, Pass::of(axis)));
            }
        }
        out.extend(by_axis.into_values().filter(|pass| !pass.seeds.is_empty()));
        out
    }

    /// The axis whose drive a parameter belongs to; `None` for links and for effects of several
    /// axes.
    fn own_axis(&self, parameter: usize) -> Option<usize> {
        match self.parameters[parameter].target {
            Target::Robot(Parameter::MotorInertia(joint) | Parameter::ViscousFriction(joint)) => {
                let before = self.robot.joints[..joint].iter();
                Some(before.filter(|j| j.drive.is_some()).count())
            }
            Target::Robot(_) => None,
            Target::Effect(effect, _) => {
                let setting = self.effects.get(effect)?;
                match setting.place {
                    Place::Axis(axis) if info(&setting.name).ok()?.acts != Acts::Arm => Some(axis),
                    _ => None,
                }
            }
        }
    }

    /// The plant at `theta`, with derivatives along `seeds`.
    fn plant<S: Scalar>(&self, theta: &[f64], seeds: &[usize]) -> Result<Plant<S>, ProblemError> {
        let (overrides, settings) =
            seeded::<S>(&self.parameters, &self.effects, theta, seeds, S::seeded);
        Ok(assemble(&self.robot, &overrides, &settings)?)
    }

    /// Residuals of one record, and the forces on the joints of the plain arm along it, which are
    /// most of the work.
    fn value(
        &self,
        record: &MotionRecord,
        theta: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), ProblemError> {
        let plant = self.plant::<f64>(theta, &[])?;
        let n_axes = plant.axes.len();
        let mut forces = Vec::new();
        let mut arm = Arm::new(&plant);
        for k in 0..record.position.len() / n_axes {
            forces.extend_from_slice(arm.forces(record, k));
        }
        let stored = stored(&forces, plant.chain.len());
        let mut series = self.predicted(&plant, record, 0, 0..n_axes, stored);
        for (axis, model) in series[0].iter_mut().enumerate() {
            let measured = record.torque[axis..].iter().step_by(n_axes);
            model.iter_mut().zip(measured).for_each(|(y, x)| *y -= x);
        }
        let residual = self.whitened(record, &series).swap_remove(0);
        Ok((residual, forces))
    }

    /// Whitened derivatives of one record, one series for each seed of a pass. `forces` on the
    /// joints of the plain arm serve if no seed is in the arm.
    fn slopes(
        &self,
        record: &MotionRecord,
        theta: &[f64],
        pass: &Pass,
        forces: &[f64],
    ) -> Result<Vec<Vec<f64>>, ProblemError> {
        let plant = self.plant::<Dual<f64, SEEDS>>(theta, &pass.seeds)?;
        let (all, n_seeds) = (0..plant.axes.len(), pass.seeds.len());
        let series = if plant.arm_carries_derivatives() {
            let mut arm = Arm::new(&plant);
            let along = |k: usize, force: &mut Vec<_>| {
                force.clear();
                force.extend_from_slice(arm.forces(record, k));
            };
            self.predicted(&plant, record, n_seeds, all, along)
        } else {
            let axes = pass.axis.map_or(all, |axis| axis..axis + 1);
            let stored = stored(forces, plant.chain.len());
            self.predicted(&plant, record, n_seeds, axes, stored)
        };
        Ok(self.whitened(record, &series[1..]))
    }

    /// Torque of some axes of `plant` along a record, `[quantity][axis][sample]`, with the value
    /// first. Series of other axes are empty. `forces` gives those on all joints of the chain, by
    /// sample.
    fn predicted<S: Scalar, T: Scalar>(
        &self,
        plant: &Plant<S>,
        record: &MotionRecord,
        n_seeds: usize,
        axes: Range<usize>,
        mut forces: impl FnMut(usize, &mut Vec<T>),
    ) -> Vec<Vec<Vec<f64>>> {
        let n_axes = plant.axes.len();
        let n_samples = record.position.len() / n_axes;
        let mut out = vec![vec![Vec::new(); n_axes]; n_seeds + 1];
        for series in &mut out {
            series[axes.clone()]
                .iter_mut()
                .for_each(|x| x.reserve(n_samples));
        }
        let mut force = Vec::new();
        for k in 0..n_samples {
            forces(k, &mut force);
            let time = S::constant(k as f64 * self.robot.sample_time);
            for i in axes.clone() {
                let axis = &plant.axes[i];
                let turned = reaction(plant, &force, i) + coupled(plant, record, k, i);
                let own = lifted(&force[axis.joint]);
                let command = drive(axis, record, (k * n_axes + i, time), own, turned);
                out[0][i].push(command.lane(0));
                for (seed, series) in out[1..].iter_mut().enumerate() {
                    series[i].push(command.partial(seed, 0));
                }
            }
        }
        for i in axes {
            let own = out.iter_mut().map(|x| std::mem::take(&mut x[i])).collect();
            let late = commanded(&plant.axes[i].kernels, self.robot.sample_time, own);
            out.iter_mut()
                .zip(late)
                .for_each(|(x, series)| x[i] = series);
        }
        out
    }

    /// Whitened series of one record, axis after axis, of `[quantity][axis][sample]`. An empty
    /// series is one of zeros.
    fn whitened(&self, record: &MotionRecord, series: &[Vec<Vec<f64>>]) -> Vec<Vec<f64>> {
        let n_axes = self.robot.n_axes();
        let n_samples = record.torque.len() / n_axes;
        let mut out = vec![Vec::new(); series.len()];
        for (axis, weighting) in self.weighting.iter().enumerate() {
            // Series of zeros need no filter. All others are filtered in pairs.
            let acting: Vec<usize> = (0..series.len())
                .filter(|i| series[*i][axis].iter().any(|x| *x != 0.0))
                .collect();
            let start = out.first().map_or(0, Vec::len);
            for target in &mut out {
                target.resize(start + weighting.output_len(n_samples), 0.0);
            }
            if acting.is_empty() {
                continue;
            }
            let plan = weighting.plan(n_samples, self.robot.sample_time);
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
        out
    }
}

/// Columns that are computed together.
struct Pass {
    /// The axis whose drive all of them belong to; `None` if there is no such axis.
    axis: Option<usize>,
    /// Places among the requested columns.
    places: Vec<usize>,
    /// Their parameters.
    seeds: Vec<usize>,
}

impl Pass {
    fn of(axis: Option<usize>) -> Self {
        Self {
            axis,
            places: Vec::new(),
            seeds: Vec::new(),
        }
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

/// The forces of each sample, of `n_joints` joints, as [`Arm::forces`] gave them.
fn stored(forces: &[f64], n_joints: usize) -> impl FnMut(usize, &mut Vec<f64>) {
    move |k, force| {
        force.clear();
        force.extend_from_slice(&forces[k * n_joints..(k + 1) * n_joints]);
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
        let values: Vec<(Vec<f64>, Vec<f64>)> = self
            .records
            .par_iter()
            .map(|record| self.value(record, theta))
            .collect::<Result<_, ProblemError>>()?;
        let passes = self.passes(columns);
        let tasks: Vec<(usize, &Pass)> = (0..self.records.len())
            .flat_map(|record| passes.iter().map(move |pass| (record, pass)))
            .collect();
        let done: Vec<_> = tasks
            .par_iter()
            .map(|(i, pass)| self.slopes(&self.records[*i], theta, pass, &values[*i].1))
            .collect::<Result<_, ProblemError>>()?;
        let mut derivatives = vec![Vec::new(); columns.len()];
        for ((_, pass), series) in tasks.iter().zip(done) {
            for (place, column) in pass.places.iter().zip(series) {
                derivatives[*place].extend(column);
            }
        }
        let residual = values
            .into_iter()
            .flat_map(|(residual, _)| residual)
            .collect();
        Ok(Evaluation::new(residual, derivatives))
    }

    fn blocks(&self) -> Vec<Block> {
        let n_axes = self.robot.n_axes();
        let lengths = self.records.iter().map(|r| r.torque.len() / n_axes);
        blocks(
            lengths,
            self.weighting.iter(),
            self.robot.sample_time,
            self.block_s,
        )
    }
}
