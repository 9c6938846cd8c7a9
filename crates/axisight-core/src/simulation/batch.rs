//! Many runs of one robot: lanes in lock-step on each thread, groups of lanes over threads.
//!
//! Groups are formed by run number, so results do not depend on the number of threads. All runs of
//! a group take the same steps:
//!
//! * With fixed steps, and with the linear plant, a run has the same bits in any group.
//! * With an error-controlled method, a group takes the shortest step that any of its runs needs. A
//!   run then differs from the same run alone by less than the tolerance allows.

use super::linear::{LinearPlant, LinearPlantError, simulate_linear};
use crate::plant::{Plant, PlantError, assemble, stepper};
use crate::robot::{EffectSetting, RobotDescription, n_readings};
use axisight_plant::simulation::{
    Beside, Drive, Effort, Method, Run, Sample, SimulationError, Status, Stepper, simulate_beside,
};
use axisight_scalar::{Lanes, Scalar};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

/// Runs in lock-step: two registers of four hide each other's latency.
const LANES: usize = 8;

/// Equations of the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// The full equations.
    Nonlinear,
    /// The plant linearized at the start, with ripple and torque path in full.
    Linear,
}

/// Input of a batch, row-major `(n_samples, n_axes)` for each run.
#[derive(Debug, Clone, Copy)]
pub enum BatchInput<'a> {
    /// Motor-side velocity references [rad/s].
    Reference(&'a [Vec<f64>]),
    /// Commanded torques [Nm].
    Torque(&'a [Vec<f64>]),
}

impl<'a> BatchInput<'a> {
    fn runs(self) -> &'a [Vec<f64>] {
        match self {
            Self::Reference(runs) | Self::Torque(runs) => runs,
        }
    }
}

/// The runs of a batch.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Robot, with its controller.
    pub robot: &'a RobotDescription,
    /// Effects to add to the robot's own.
    pub settings: &'a [EffectSetting<f64>],
    /// Driven joint angles at the start [rad]: one set for all runs, or one per run. The linear
    /// plant needs one set, at which it is linearized.
    pub start: &'a [Vec<f64>],
    /// Inputs, one per run.
    pub input: BatchInput<'a>,
    /// Position noise [rad], one array per run, shaped like the inputs; empty for none.
    pub noise: &'a [Vec<f64>],
    /// Step of the position sensor [rad]; zero for none.
    pub resolution: f64,
    /// Equations of the plant.
    pub model: Model,
    /// Integrator.
    pub method: Method,
    /// Torques beside the plant; runs are then simulated one by one. The linear plant has none.
    pub beside: Option<Beside<'a>>,
    /// Flag by which another thread ends the runs early.
    pub cancel: Option<&'a AtomicBool>,
}

/// Signals of all runs, row-major `(n_runs, n_samples, columns)`. They are NaN after the sample at
/// which a run stopped.
#[derive(Debug, Clone, Default)]
pub struct Traces {
    /// Number of samples of each run.
    pub n_samples: usize,
    /// Commanded torques [Nm], per axis.
    pub command: Vec<f64>,
    /// Measured motor positions [rad], per axis.
    pub measured: Vec<f64>,
    /// True motor positions [rad], per axis.
    pub motor: Vec<f64>,
    /// Joint positions [rad], per joint.
    pub joint: Vec<f64>,
    /// Torque added on the motors [Nm], per axis.
    pub torque_disturbance: Vec<f64>,
    /// Error of the measured positions [rad], per axis.
    pub position_disturbance: Vec<f64>,
    /// Readings of the accelerometers [m/s^2], per direction.
    pub specific_force: Vec<f64>,
}

impl Traces {
    fn zeros(robot: &RobotDescription, n_runs: usize, n_samples: usize) -> Self {
        let (n_axes, n_joints) = (robot.n_axes().max(1), robot.n_joints().max(1));
        let zeros = |columns: usize| vec![0.0; n_runs * n_samples * columns];
        Self {
            n_samples,
            command: zeros(n_axes),
            measured: zeros(n_axes),
            motor: zeros(n_axes),
            joint: zeros(n_joints),
            torque_disturbance: zeros(n_axes),
            position_disturbance: zeros(n_axes),
            specific_force: zeros(n_readings(&robot.accelerometers)),
        }
    }

    /// The runs in groups of `width`, each with its part of every signal; none without samples.
    fn groups(&mut self, n_runs: usize, width: usize) -> Vec<Group<'_>> {
        let n_samples = self.n_samples;
        let mut parts = [
            &mut self.command,
            &mut self.measured,
            &mut self.motor,
            &mut self.joint,
            &mut self.torque_disturbance,
            &mut self.position_disturbance,
            &mut self.specific_force,
        ]
        .map(|signal| {
            // Chunks of length zero panic. A signal without columns has no chunks.
            let each = (signal.len() / n_runs.max(1) * width).max(1);
            signal.chunks_mut(each)
        });
        let starts = (0..n_runs).step_by(width).filter(|_| n_samples > 0);
        starts
            .map(|first| Group {
                runs: (first..(first + width).min(n_runs)).collect(),
                n_samples,
                signals: parts.each_mut().map(|part| part.next().unwrap_or_default()),
            })
            .collect()
    }
}

/// Status and effort of a run.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// How the run ended.
    pub status: Status,
    /// Effort, shared by the runs of a group; zero for the linear plant.
    pub effort: Effort,
}

/// Reason why a batch cannot run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BatchError {
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The plant cannot be linearized.
    #[error(transparent)]
    Linear(#[from] LinearPlantError),
    /// The input of the simulation is invalid.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Simulate all runs, in the order of the inputs, on the threads of the current pool.
///
/// # Errors
/// [`BatchError`] if the input is invalid or the plant cannot be built or linearized. A failure
/// during a run is the status of that run.
pub fn simulate_batch(batch: &Batch<'_>) -> Result<(Traces, Vec<Outcome>), BatchError> {
    let linear = match batch.model {
        Model::Linear => {
            let start = batch.start.first().map_or(&[][..], Vec::as_slice);
            Some(LinearPlant::new(batch.robot, batch.settings, start)?)
        }
        Model::Nonlinear => None,
    };
    let runs = batch.input.runs();
    let n_axes = batch.robot.n_axes().max(1);
    let n_samples = runs.first().map_or(0, |r| r.len() / n_axes);
    if let Some(i) = runs.iter().position(|r| r.len() != n_samples * n_axes) {
        let expected = format!("{n_samples} samples in every run");
        let got = format!("{} numbers in run {}", runs[i].len(), i + 1);
        return Err(SimulationError::Shape {
            field: "input",
            expected,
            got,
        }
        .into());
    }
    let alone = batch.method.may_be_implicit() || batch.beside.is_some();
    let width = if alone && linear.is_none() { 1 } else { LANES };
    if batch.start.len() != 1 && batch.start.len() != runs.len() {
        return Err(SimulationError::Shape {
            field: "start",
            expected: format!("one set of angles, or one for each of {} runs", runs.len()),
            got: batch.start.len().to_string(),
        }
        .into());
    }
    let mut traces = Traces::zeros(batch.robot, runs.len(), n_samples);
    let mut groups = traces.groups(runs.len(), width);
    let outcomes: Vec<Vec<Outcome>> = groups
        .par_iter_mut()
        .map(|group| group.simulate(batch, linear.as_ref()))
        .collect::<Result<_, _>>()?;
    Ok((traces, outcomes.into_iter().flatten().collect()))
}

/// Runs in lock-step, with the output arrays for their signals.
struct Group<'a> {
    runs: Vec<usize>,
    n_samples: usize,
    /// Command, measured and motor position, joint position, torque and position disturbance,
    /// readings of accelerometers.
    signals: [&'a mut [f64]; 7],
}

impl Group<'_> {
    /// Simulate all runs at once. If one of them fails, simulate each alone, so that no run affects
    /// another.
    fn simulate(
        &mut self,
        batch: &Batch<'_>,
        linear: Option<&LinearPlant>,
    ) -> Result<Vec<Outcome>, BatchError> {
        let lanes: Vec<usize> = (0..self.runs.len()).collect();
        if lanes.len() > 1 {
            let outcome = if let Some(plant) = linear {
                self.linear::<Lanes<LANES>>(batch, plant, &lanes)?
            } else {
                let lifted: Vec<_> = batch.settings.iter().map(EffectSetting::lifted).collect();
                let plant = assemble::<Lanes<LANES>>(batch.robot, &[], &lifted)?;
                self.nonlinear(batch, &plant, Stepper::new(&plant), &lanes)?
            };
            if let Status::Cancelled(first) = outcome.status {
                for lane in &lanes {
                    self.blank(*lane, first);
                }
            }
            if matches!(outcome.status, Status::Completed | Status::Cancelled(_)) {
                return Ok(vec![outcome; lanes.len()]);
            }
        }
        let alone = lanes.iter().map(|lane| self.single(batch, linear, *lane));
        alone.collect()
    }

    fn single(
        &mut self,
        batch: &Batch<'_>,
        linear: Option<&LinearPlant>,
        lane: usize,
    ) -> Result<Outcome, BatchError> {
        let outcome = if let Some(plant) = linear {
            self.linear::<f64>(batch, plant, &[lane])?
        } else {
            let plant = assemble(batch.robot, &[], batch.settings)?;
            let stepper = if batch.method.may_be_implicit() {
                stepper(&plant, batch.robot, batch.settings)?
            } else {
                Stepper::new(&plant)
            };
            self.nonlinear(batch, &plant, stepper, &[lane])?
        };
        if let Status::Diverged(k) | Status::StepSizeCollapsed(k) | Status::Cancelled(k) =
            outcome.status
        {
            // Sample k was observed in a failed run, but not in a cancelled one.
            let seen = k + usize::from(!matches!(outcome.status, Status::Cancelled(_)));
            self.blank(lane, seen);
        }
        Ok(outcome)
    }

    /// Set the signals to NaN from sample `first` on.
    fn blank(&mut self, lane: usize, first: usize) {
        let count = self.runs.len() * self.n_samples;
        for signal in &mut self.signals {
            let columns = signal.len() / count.max(1);
            let own = lane * self.n_samples * columns..(lane + 1) * self.n_samples * columns;
            signal[own][first * columns..].fill(f64::NAN);
        }
    }

    fn nonlinear<S: Scalar>(
        &mut self,
        batch: &Batch<'_>,
        plant: &Plant<S>,
        mut stepper: Stepper<S>,
        lanes: &[usize],
    ) -> Result<Outcome, BatchError> {
        let motors = plant.motor_slots();
        let joints = plant.n_motors()..plant.n_motors() + plant.chain.len();
        let runs: Vec<usize> = lanes.iter().map(|l| self.runs[*l]).collect();
        let status = batch.with_run(&runs, |run| {
            simulate_beside(plant, run, batch.beside, &mut stepper, &mut |sample| {
                self.take(lanes, sample, &motors, &joints);
            })
        })?;
        Ok(Outcome {
            status,
            effort: stepper.effort,
        })
    }

    fn linear<S: Scalar>(
        &mut self,
        batch: &Batch<'_>,
        plant: &LinearPlant,
        lanes: &[usize],
    ) -> Result<Outcome, BatchError> {
        let (motors, joints) = (plant.motor_slots(), plant.joint_slots());
        let runs: Vec<usize> = lanes.iter().map(|l| self.runs[*l]).collect();
        let status = batch.with_run(&runs, |run| {
            simulate_linear::<S>(plant, run, &mut |sample| {
                self.take(lanes, sample, &motors, &joints);
            })
        })?;
        Ok(Outcome {
            status,
            effort: Effort::default(),
        })
    }

    /// Store a sample of each lane.
    #[inline(always)]
    fn take<S: Scalar>(
        &mut self,
        lanes: &[usize],
        sample: &Sample<'_, S>,
        motors: &[(usize, f64)],
        joints: &Range<usize>,
    ) {
        let n = self.n_samples;
        let [command, measured, motor, joint, torque, position, readings] = &mut self.signals;
        let keep = |to: &mut [f64], values: &[S]| {
            for (slot, lane) in lanes.iter().enumerate() {
                let row = (lane * n + sample.index) * values.len();
                if let Some(to) = to.get_mut(row..row + values.len()) {
                    for (to, value) in to.iter_mut().zip(values) {
                        *to = value.lane(slot);
                    }
                }
            }
        };
        keep(command, sample.command);
        keep(measured, sample.measured);
        keep(torque, sample.torque_disturbance);
        keep(position, sample.position_disturbance);
        keep(readings, sample.specific_force);
        keep(joint, &sample.state[joints.clone()]);
        for (slot, lane) in lanes.iter().enumerate() {
            let row = (lane * n + sample.index) * motors.len();
            if let Some(to) = motor.get_mut(row..row + motors.len()) {
                for (to, (state, scale)) in to.iter_mut().zip(motors) {
                    *to = sample.state[*state].lane(slot) * scale;
                }
            }
        }
    }
}

impl Batch<'_> {
    /// Call `simulate` with the inputs and noise of `runs` as lanes.
    fn with_run<T>(&self, runs: &[usize], simulate: impl FnOnce(&Run<'_>) -> T) -> T {
        let pick = |all: &[Vec<f64>]| -> Vec<usize> {
            runs.iter().copied().filter(|r| *r < all.len()).collect()
        };
        let inputs: Vec<&[f64]> = runs.iter().map(|r| &self.input.runs()[*r][..]).collect();
        let noise: Vec<&[f64]> = pick(self.noise)
            .iter()
            .map(|r| &self.noise[*r][..])
            .collect();
        let mut starts: Vec<&[f64]> = self.start.iter().map(Vec::as_slice).collect();
        if starts.len() > 1 {
            starts = runs.iter().map(|r| starts[*r]).collect();
        }
        simulate(&Run {
            controller: &self.robot.controller,
            sample_time: self.robot.sample_time,
            start: &starts,
            drive: match self.input {
                BatchInput::Reference(_) => Drive::Reference(&inputs),
                BatchInput::Torque(_) => Drive::Torque(&inputs),
            },
            noise: &noise,
            resolution: self.resolution,
            disturbances: true,
            accelerometers: true,
            method: self.method,
            cancel: self.cancel,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot_file::read_robot;

    const LEVER: &str = r#"
schema = "axisight.robot/2"
name = "lever"
gravity = [0.0, 0.0, -9.81]
sample_time = 1e-3
[[joint]]
name = "axis1"
kind = "driven"
origin = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[joint.link]
mass = 2.0
com = [0.1, 0.0, 0.0]
inertia = [0.02, 0.02, 0.02, 0.0, 0.0, 0.0]
[joint.drive]
gear_ratio = 0.02
motor_inertia = 1e-4
viscous_friction = 1e-3
[operating_point]
joint_angle = [0.2]
"#;

    /// One run alone, and a group of runs in lock-step, by both sets of equations.
    #[test]
    fn a_cancelled_run_has_no_values() {
        let robot = read_robot(LEVER).expect("a valid robot");
        let cancel = AtomicBool::new(true);
        for model in [Model::Nonlinear, Model::Linear] {
            for runs in [1, 3] {
                let input = vec![vec![0.1; 20]; runs];
                let batch = Batch {
                    robot: &robot,
                    settings: &[],
                    start: &[vec![0.2]],
                    input: BatchInput::Torque(&input),
                    noise: &[],
                    resolution: 0.0,
                    model,
                    method: Method::RungeKutta4 { substeps: 1 },
                    beside: None,
                    cancel: Some(&cancel),
                };
                let (traces, outcomes) = simulate_batch(&batch).expect("a valid batch");
                assert!(outcomes.iter().all(|o| o.status == Status::Cancelled(0)));
                assert_eq!(traces.measured.len(), 20 * runs);
                for signal in [&traces.measured, &traces.motor, &traces.joint] {
                    assert!(signal.iter().all(|x| x.is_nan()), "{model:?}, {runs} runs");
                }
            }
        }
    }
}
