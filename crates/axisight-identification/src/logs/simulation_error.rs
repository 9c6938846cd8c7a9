//! Simulation error: logs against a free-running simulation of the loop.
//!
//! All logs run in lock-step in the lanes of one simulation; derivatives ride
//! along as dual numbers, a few parameters per pass. Cost of a pass with `d`
//! derivatives over `n` samples: about `4 n (1 + 2 d)` times one right-hand
//! side for a batch of logs.

use super::gram::{Block, blocks};
use super::problem::{
    Evaluation, FitParameter, Problem, ProblemError, check_logs, invalid, seeded,
};
use axisight_core::plant::assemble;
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method, Run, Sample, Status, Stepper, simulate};
use axisight_numerics::Weighting;
use axisight_scalar::{Dual, Lanes, Scalar};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Logs simulated in lock-step.
const LANES: usize = 4;
/// Derivatives per pass.
const SEEDS: usize = 4;

/// One log to be reproduced; arrays are row-major `(n_samples, n_axes)`.
#[derive(Debug, Clone)]
pub struct Record {
    /// Velocity reference [rad/s], commanded torque [Nm] or, when tracking, measured
    /// position [rad], as the problem's input asks.
    pub input: Vec<f64>,
    /// Commanded torque [Nm] or measured position [rad], as the problem's output asks.
    pub target: Vec<f64>,
}

/// What drives the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimulationInput {
    /// Velocity references, through the controller.
    Reference,
    /// Commanded torques, in open loop.
    Torque,
    /// The logged torques (the targets), with feedback to the logged positions (the inputs):
    /// the residual is the torque the feedback has to add.
    Tracking,
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimulationOutput {
    /// Commanded torque.
    Torque,
    /// Measured motor position.
    Position,
}

/// A simulation-error problem.
#[derive(Debug, Clone)]
pub struct SimulationErrorProblem {
    /// The robot.
    pub robot: RobotDescription,
    /// Effects in the model, at the values parameters do not replace.
    pub effects: Vec<EffectSetting<f64>>,
    /// Parameters, in the order of `theta`.
    pub parameters: Vec<FitParameter>,
    /// The logs.
    pub records: Vec<Record>,
    /// Input of the simulation.
    pub input: SimulationInput,
    /// Output compared.
    pub output: SimulationOutput,
    /// One weighting per axis.
    pub weighting: Vec<Weighting>,
    /// Integrator.
    pub method: Method,
    /// Length of a block [s].
    pub block_s: f64,
    /// Set by another thread to give the fit up.
    pub cancel: Option<Arc<AtomicBool>>,
}

/// Series per lane and axis, value and derivatives: `[quantity][lane * axes + axis][sample]`.
type Traces = Vec<Vec<Vec<f64>>>;

impl SimulationErrorProblem {
    /// Check shapes.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] naming the field.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let n_axes = self.robot.n_axes();
        check_logs(self.records.len(), &self.weighting, n_axes)?;
        for (i, record) in self.records.iter().enumerate() {
            let (n, m) = (record.input.len(), record.target.len());
            if n != m || n == 0 || n % n_axes != 0 {
                let expected = format!("input and target of equal size, {n_axes} axes");
                return Err(invalid(
                    format!("records[{i}]"),
                    expected,
                    format!("{n} and {m} numbers"),
                ));
            }
            if let Some(k) = record.target.iter().position(|v| !v.is_finite()) {
                let got = format!("{} at sample {}", record.target[k], k / n_axes);
                return Err(invalid(
                    format!("records[{i}]"),
                    "finite numbers".into(),
                    got,
                ));
            }
        }
        Ok(())
    }

    fn n_samples(&self, record: usize) -> usize {
        self.records[record].input.len() / self.robot.n_axes()
    }

    /// Model output of the logs `records` with derivatives along `seeds`.
    fn traces<S: Scalar>(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
    ) -> Result<Traces, ProblemError> {
        let (overrides, settings) = seeded::<S>(&self.parameters, &self.effects, theta, seeds);
        let failed = |e: &dyn std::fmt::Display| ProblemError::Failed(e.to_string());
        let plant = assemble(&self.robot, &overrides, &settings).map_err(|e| failed(&e))?;
        let n_axes = plant.axes.len();
        let inputs: Vec<&[f64]> = records
            .iter()
            .map(|r| &self.records[*r].input[..])
            .collect();
        let targets: Vec<&[f64]> = records
            .iter()
            .map(|r| &self.records[*r].target[..])
            .collect();
        let n_samples = records
            .iter()
            .map(|r| self.n_samples(*r))
            .max()
            .unwrap_or(0);
        let series = || vec![Vec::with_capacity(n_samples); records.len() * n_axes];
        let mut traces: Traces = (0..=seeds.len()).map(|_| series()).collect();
        let run = Run {
            controller: &self.robot.controller,
            sample_time: self.robot.sample_time,
            start: &self.robot.operating_point,
            drive: match self.input {
                SimulationInput::Reference => Drive::Reference(&inputs),
                SimulationInput::Torque => Drive::Torque(&inputs),
                SimulationInput::Tracking => Drive::Tracking {
                    torque: &targets,
                    position: &inputs,
                },
            },
            noise: &[],
            resolution: 0.0,
            method: self.method,
            cancel: self.cancel.as_deref(),
        };
        let mut observe = |sample: &Sample<'_, S>| {
            let output = match self.output {
                SimulationOutput::Torque => sample.command,
                SimulationOutput::Position => sample.measured,
            };
            for (axis, y) in output.iter().enumerate() {
                for lane in 0..records.len() {
                    let slot = lane * n_axes + axis;
                    traces[0][slot].push(y.lane(lane));
                    for seed in 0..seeds.len() {
                        traces[seed + 1][slot].push(y.partial(seed, lane));
                    }
                }
            }
        };
        let mut stepper = Stepper::new(&plant);
        match simulate(&plant, &run, &mut stepper, &mut observe).map_err(|e| failed(&e))? {
            Status::Completed => Ok(traces),
            Status::Cancelled(_) => Err(ProblemError::Cancelled),
            Status::Diverged(k) => Err(failed(&format!("diverged at sample {k}"))),
            Status::StepSizeCollapsed(k) => {
                Err(failed(&format!("step size collapsed at sample {k}")))
            }
        }
    }

    fn pass(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
    ) -> Result<Traces, ProblemError> {
        match seeds.len() {
            0 => self.traces::<Lanes<LANES>>(records, theta, seeds),
            1 => self.traces::<Dual<Lanes<LANES>, 1>>(records, theta, seeds),
            2 => self.traces::<Dual<Lanes<LANES>, 2>>(records, theta, seeds),
            _ => self.traces::<Dual<Lanes<LANES>, SEEDS>>(records, theta, seeds),
        }
    }

    /// Whitened series of one batch: `[quantity][lane][axis]`, residual first.
    fn whiten(&self, records: &[usize], mut traces: Traces) -> Vec<Vec<Vec<f64>>> {
        let n_axes = self.robot.n_axes();
        for (lane, record) in records.iter().enumerate() {
            let target = &self.records[*record].target;
            for axis in 0..n_axes {
                let model = &mut traces[0][lane * n_axes + axis];
                for (k, y) in model.iter_mut().enumerate() {
                    *y -= target.get(k * n_axes + axis).copied().unwrap_or(0.0);
                }
            }
        }
        let mut out = vec![vec![Vec::new(); records.len() * n_axes]; traces.len()];
        for (lane, record) in records.iter().enumerate() {
            for (axis, weighting) in self.weighting.iter().enumerate() {
                let slot = lane * n_axes + axis;
                let plan = weighting.plan(self.n_samples(*record), self.robot.sample_time);
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
            }
        }
        out
    }
}

impl Problem for SimulationErrorProblem {
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError> {
        let all: Vec<usize> = (0..self.records.len()).collect();
        let mut chunks: Vec<&[usize]> = columns.chunks(SEEDS).collect();
        if chunks.is_empty() {
            chunks.push(&[]);
        }
        let tasks: Vec<(usize, &[usize], &[usize])> = all
            .chunks(LANES)
            .flat_map(|batch| chunks.iter().enumerate().map(move |(i, c)| (i, batch, *c)))
            .collect();
        let done: Vec<_> = tasks
            .par_iter()
            .map(|(_, batch, seeds)| {
                let traces = self.pass(batch, theta, seeds)?;
                Ok(self.whiten(batch, traces))
            })
            .collect::<Result<_, ProblemError>>()?;
        let mut residual = Vec::new();
        let mut derivatives = vec![Vec::new(); columns.len()];
        for ((chunk, _, seeds), series) in tasks.iter().zip(done) {
            let mut series = series.into_iter();
            let first = series.next().unwrap_or_default();
            if *chunk == 0 {
                residual.extend(first.into_iter().flatten());
            }
            for (i, column) in series.take(seeds.len()).enumerate() {
                derivatives[chunk * SEEDS + i].extend(column.into_iter().flatten());
            }
        }
        Ok(Evaluation {
            residual,
            columns: derivatives,
        })
    }

    fn blocks(&self) -> Vec<Block> {
        let lengths = (0..self.records.len()).map(|record| self.n_samples(record));
        blocks(
            lengths,
            &self.weighting,
            self.robot.sample_time,
            self.block_s,
        )
    }
}
