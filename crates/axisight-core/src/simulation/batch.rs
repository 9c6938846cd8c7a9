//! Many runs of one robot: lanes in lock-step on each thread, groups of lanes over threads.
//!
//! Groups are cut by run number, so that results do not depend on the number of threads.
//! Runs in a group take the same steps: with fixed steps and with the linear plant a run has
//! the same bits in any group; with an error-controlled method the group takes the shortest
//! step any of its runs asks for, and a run differs from itself alone by less than the
//! tolerance allows.

use super::closed_loop::{Drive, Run, Sample, SimulationError, Status, simulate};
use super::linear::{LinearPlant, LinearPlantError, simulate_linear};
use super::method::{Effort, Method, Stepper};
use crate::robot::{EffectSetting, Plant, PlantError, RobotDescription};
use crate::scalar::{Lanes, Scalar};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Runs in lock-step: two registers of four hide the latency of one another's operations.
const LANES: usize = 8;

/// Equations the plant follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// All of it.
    Nonlinear,
    /// Linearized at the start, ripple and the torque path as they are.
    Linear,
}

/// Input of a batch, `(n_samples, n_axes)` row-major per run.
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

/// Runs to simulate.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Robot with its controller.
    pub robot: &'a RobotDescription,
    /// Effects.
    pub settings: &'a [EffectSetting<f64>],
    /// Driven joint angles at the start [rad].
    pub start: &'a [f64],
    /// Inputs by run.
    pub input: BatchInput<'a>,
    /// Position noise by run, shaped like the inputs; empty for none [rad].
    pub noise: &'a [Vec<f64>],
    /// Step of the position sensor [rad]; zero for none.
    pub resolution: f64,
    /// Equations.
    pub model: Model,
    /// Integrator.
    pub method: Method,
    /// Set by another thread to end the runs early.
    pub cancel: Option<&'a AtomicBool>,
}

/// What a run recorded, row-major; it ends with the sample that failed, if one did.
#[derive(Debug, Clone, Default)]
pub struct RunTrace {
    /// Commanded torques [Nm], `(n, n_axes)`.
    pub command: Vec<f64>,
    /// Measured motor positions [rad], `(n, n_axes)`.
    pub measured: Vec<f64>,
    /// True motor positions [rad], `(n, n_axes)`.
    pub motor: Vec<f64>,
    /// Joint positions [rad], `(n, n_joints)`.
    pub joint: Vec<f64>,
    /// Torque added on the motors [Nm], `(n, n_axes)`.
    pub torque_disturbance: Vec<f64>,
    /// Error of the measured positions [rad], `(n, n_axes)`.
    pub position_disturbance: Vec<f64>,
}

/// A run and how it ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Signals.
    pub trace: RunTrace,
    /// End of the run.
    pub status: Status,
    /// Cost; shared by the runs of a group, zero for the linear plant.
    pub effort: Effort,
}

/// Why a batch cannot run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BatchError {
    /// The plant cannot be built.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The plant cannot be linearized.
    #[error(transparent)]
    Linear(#[from] LinearPlantError),
    /// Misuse.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Simulate all runs, in the order of the inputs, on the threads of the current pool.
///
/// # Errors
/// [`BatchError`] for misuse; trouble of a run is its status.
pub fn simulate_batch(batch: &Batch<'_>) -> Result<Vec<Outcome>, BatchError> {
    let linear = match batch.model {
        Model::Linear => Some(LinearPlant::new(batch.robot, batch.settings, batch.start)?),
        Model::Nonlinear => None,
    };
    let n_runs = batch.input.runs().len();
    let width = if batch.method.may_be_implicit() && linear.is_none() {
        1
    } else {
        LANES
    };
    let groups: Vec<Vec<usize>> = (0..n_runs)
        .collect::<Vec<_>>()
        .chunks(width)
        .map(<[usize]>::to_vec)
        .collect();
    let done: Vec<Vec<Outcome>> = groups
        .par_iter()
        .map(|runs| group(batch, linear.as_ref(), runs))
        .collect::<Result<_, _>>()?;
    Ok(done.into_iter().flatten().collect())
}

/// Simulate runs in lock-step; if one of them fails, each alone, so that it spoils no other.
fn group(
    batch: &Batch<'_>,
    linear: Option<&LinearPlant>,
    runs: &[usize],
) -> Result<Vec<Outcome>, BatchError> {
    if let [run] = runs {
        return Ok(vec![single(batch, linear, *run)?]);
    }
    let (traces, status, effort) = match linear {
        Some(plant) => linear_runs::<Lanes<LANES>>(batch, plant, runs)?,
        None => {
            let lifted: Vec<_> = batch.settings.iter().map(EffectSetting::lifted).collect();
            let plant = Plant::<Lanes<LANES>>::new(batch.robot, &[], &lifted)?;
            let stepper = Stepper::new(&plant);
            nonlinear_runs(batch, &plant, stepper, runs)?
        }
    };
    if !matches!(status, Status::Completed | Status::Cancelled(_)) {
        return runs.iter().map(|run| single(batch, linear, *run)).collect();
    }
    Ok(traces
        .into_iter()
        .map(|trace| Outcome {
            trace,
            status,
            effort,
        })
        .collect())
}

fn single(
    batch: &Batch<'_>,
    linear: Option<&LinearPlant>,
    run: usize,
) -> Result<Outcome, BatchError> {
    let (traces, status, effort) = match linear {
        Some(plant) => linear_runs::<f64>(batch, plant, &[run])?,
        None => {
            let plant = Plant::<f64>::new(batch.robot, &[], batch.settings)?;
            let stepper = if batch.method.may_be_implicit() {
                Stepper::with_jacobian(&plant, batch.robot, &[], batch.settings)?
            } else {
                Stepper::new(&plant)
            };
            nonlinear_runs(batch, &plant, stepper, &[run])?
        }
    };
    Ok(Outcome {
        trace: traces.into_iter().next().unwrap_or_default(),
        status,
        effort,
    })
}

type Recorded = (Vec<RunTrace>, Status, Effort);

fn nonlinear_runs<S: Scalar>(
    batch: &Batch<'_>,
    plant: &Plant<S>,
    mut stepper: Stepper<S>,
    runs: &[usize],
) -> Result<Recorded, BatchError> {
    let mut recorder = Recorder::new(batch, runs);
    let slots: Vec<(usize, f64)> = plant.motor_slots();
    let joints = plant.n_motors()..plant.n_motors() + plant.chain.len();
    let status = batch.with_run(runs, |run| {
        simulate(plant, run, &mut stepper, &mut |sample| {
            recorder.take(sample, &slots, &joints);
        })
    })?;
    Ok((recorder.traces, status, stepper.effort))
}

fn linear_runs<S: Scalar>(
    batch: &Batch<'_>,
    plant: &LinearPlant,
    runs: &[usize],
) -> Result<Recorded, BatchError> {
    let mut recorder = Recorder::new(batch, runs);
    let (slots, joints) = (plant.motor_slots(), plant.joint_slots());
    let status = batch.with_run(runs, |run| {
        simulate_linear::<S>(plant, run, &mut |sample| {
            recorder.take(sample, &slots, &joints);
        })
    })?;
    Ok((recorder.traces, status, Effort::default()))
}

impl Batch<'_> {
    /// Call `simulate` with the inputs and noise of `runs` as lanes.
    fn with_run<T>(&self, runs: &[usize], simulate: impl FnOnce(&Run<'_>) -> T) -> T {
        let pick = |all: &[Vec<f64>]| -> Vec<usize> {
            runs.iter().copied().filter(|r| *r < all.len()).collect()
        };
        let inputs: Vec<&[f64]> = runs.iter().map(|r| &self.input.runs()[*r][..]).collect();
        let noise: Vec<&[f64]> = pick(self.noise).iter().map(|r| &self.noise[*r][..]).collect();
        simulate(&Run {
            controller: &self.robot.controller,
            sample_time: self.robot.sample_time,
            start: self.start,
            drive: match self.input {
                BatchInput::Reference(_) => Drive::Reference(&inputs),
                BatchInput::Torque(_) => Drive::Torque(&inputs),
            },
            noise: &noise,
            resolution: self.resolution,
            method: self.method,
            cancel: self.cancel,
        })
    }
}

/// Keeps every sample of every lane up to the end of its input.
struct Recorder {
    traces: Vec<RunTrace>,
    lengths: Vec<usize>,
}

impl Recorder {
    fn new(batch: &Batch<'_>, runs: &[usize]) -> Self {
        let n_axes = batch.robot.n_axes().max(1);
        let size = |run: &usize| batch.input.runs()[*run].len();
        let trace = |run: &usize| RunTrace {
            command: Vec::with_capacity(size(run)),
            measured: Vec::with_capacity(size(run)),
            motor: Vec::with_capacity(size(run)),
            joint: Vec::with_capacity(size(run) / n_axes * batch.robot.n_joints()),
            torque_disturbance: Vec::with_capacity(size(run)),
            position_disturbance: Vec::with_capacity(size(run)),
        };
        Self {
            traces: runs.iter().map(trace).collect(),
            lengths: runs.iter().map(|r| size(r) / n_axes).collect(),
        }
    }

    #[inline(always)]
    fn take<S: Scalar>(
        &mut self,
        sample: &Sample<'_, S>,
        motors: &[(usize, f64)],
        joints: &std::ops::Range<usize>,
    ) {
        for (lane, (trace, length)) in self.traces.iter_mut().zip(&self.lengths).enumerate() {
            if sample.index >= *length {
                continue;
            }
            let own = |values: &[S], to: &mut Vec<f64>| to.extend(values.iter().map(|v| v.lane(lane)));
            own(sample.command, &mut trace.command);
            own(sample.measured, &mut trace.measured);
            own(sample.torque_disturbance, &mut trace.torque_disturbance);
            own(sample.position_disturbance, &mut trace.position_disturbance);
            own(&sample.state[joints.clone()], &mut trace.joint);
            let angles = motors.iter().map(|(i, scale)| sample.state[*i].lane(lane) * scale);
            trace.motor.extend(angles);
        }
    }
}
