//! Simulation error: logs compared with a free simulation of the closed loop.
//!
//! Joint encoders and accelerometers may be compared as well ([`super::outputs`]).
//!
//! All logs run in lock-step in the lanes of one simulation. Derivatives are dual numbers, with a
//! few parameters per pass ([`super::packing`]).
//!
//! The residual comes from the model itself. For derivatives, the arm is linearised along that run
//! ([`axisight_core::robot::Course`]). If runs of a similar model are given ([`Courses`]), both use
//! the arm linearised along those runs.
//!
//! A pass with `d` derivatives over `n` samples takes about `4 n (1 + 2 d)` right-hand sides for a
//! batch of logs. The linearised arm leaves a sixth of this.

use super::courses::{Batch, Courses, OwnRun, Runs};
use super::gram::{Block, blocks};
use super::outputs::{SensedOutput, check_sensed};
use super::packing::{LANES, PARTIALS, Packing};
use super::problem::{
    Evaluation, FitParameter, Problem, ProblemError, check_logs, invalid, picked, seeded,
};
use super::record::Record;
use axisight_core::plant::{Plant, Seeded, assemble, fastest_decay};
use axisight_core::robot::{Course, EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method, Run, Sample, Status, Stepper, simulate};
use axisight_numerics::Weighting;
use axisight_scalar::{Dual, Lanes, Scalar};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The input of the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimulationInput {
    /// Velocity references, through the controller.
    Reference,
    /// Commanded torques, in open loop.
    Torque,
    /// Logged torques (the targets), with feedback to the logged positions (the inputs). The
    /// residual is the torque that the feedback adds.
    Tracking,
}

/// The compared output.
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
    /// Effects of the model. Parameters replace some of their values.
    pub effects: Vec<EffectSetting<f64>>,
    /// Parameters, in the order of `theta`.
    pub parameters: Vec<FitParameter>,
    /// The logs.
    pub records: Vec<Arc<Record>>,
    /// Input of the simulation.
    pub input: SimulationInput,
    /// Compared output.
    pub output: SimulationOutput,
    /// One weighting per axis.
    pub weighting: Vec<Weighting>,
    /// Compared readings of sensors on the arm, in the order of [`Record::sensed`].
    pub sensed: Vec<SensedOutput>,
    /// Integrator.
    pub method: Method,
    /// Length of a block [s].
    pub block_s: f64,
    /// Runs of a similar model, along which the arm is linearised.
    pub courses: Option<Arc<Courses>>,
    /// Flag by which another thread cancels the fit.
    pub cancel: Option<Arc<AtomicBool>>,
}

/// A run along which the arm is linearised.
pub(super) type SharedCourse = Arc<Course<Lanes<LANES>>>;

/// A function that receives every state of a run.
type Keep<'a, S> = &'a mut dyn FnMut(&[S]);

/// Series for each lane and output, value first, then derivatives:
/// `[quantity][lane * outputs + output][sample]`. The outputs are those of [`super::outputs`].
pub(super) type Traces = Vec<Vec<Vec<f64>>>;

/// The arm of a run.
pub(super) enum Arm<'a> {
    /// With its full equations.
    Exact,
    /// Linearised.
    Along(&'a SharedCourse),
}

/// Smallest number of derivatives for which a run for the linearisation saves time.
const WORTH_A_COURSE: usize = 3;

impl SimulationErrorProblem {
    /// Check the shapes of all arrays.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] that names the invalid field.
    pub fn validate(&self) -> Result<(), ProblemError> {
        let n_axes = self.robot.n_axes();
        check_logs(self.records.len(), &self.weighting, n_axes)?;
        check_sensed(&self.sensed, &self.robot)?;
        for (i, record) in self.records.iter().enumerate() {
            record.validate(i, n_axes, self.sensed.len())?;
        }
        Ok(())
    }

    /// The same problem with some of the logs, by their indices.
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

    /// The same problem with the first `samples` compared samples of each log.
    ///
    /// # Errors
    /// [`ProblemError::Invalid`] if there is not one number per log, or if one is zero or above the
    /// number of samples.
    pub fn first(&self, samples: &[usize]) -> Result<Self, ProblemError> {
        let most: Vec<usize> = (0..self.records.len()).map(|i| self.n_samples(i)).collect();
        let there = |(n, most): (&usize, &usize)| (1..=*most).contains(n);
        if samples.len() != most.len() || !samples.iter().zip(&most).all(there) {
            let expected = format!("from 1 to {most:?}, one a log");
            return Err(invalid("samples".into(), expected, format!("{samples:?}")));
        }
        let n_axes = self.robot.n_axes();
        let records = self.records.iter().zip(samples);
        Ok(Self {
            records: records
                .map(|(r, n)| Arc::new(r.first(*n, n_axes, self.sensed.len())))
                .collect(),
            ..self.clone()
        })
    }

    /// Number of compared samples of a log.
    pub(super) fn n_samples(&self, record: usize) -> usize {
        let record = &self.records[record];
        record.input.len() / self.robot.n_axes() - record.lead
    }

    /// Batches of logs that run in lock-step.
    pub(super) fn batches(&self) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..self.records.len()).collect();
        all.chunks(LANES).map(<[usize]>::to_vec).collect()
    }

    /// The plant of the logs `records`, each with its own values of effects in its lanes.
    fn plant<S: Scalar>(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
        seed: impl Fn(S, usize) -> S,
    ) -> Result<Plant<S>, ProblemError> {
        let (overrides, mut settings) = seeded(&self.parameters, &self.effects, theta, seeds, seed);
        self.set_own_values(records, &mut settings);
        Ok(assemble(&self.robot, &overrides, &settings)?)
    }

    /// The plant without derivatives and without a log's own values.
    fn bare<S: Scalar>(&self, theta: &[f64]) -> Result<Plant<S>, ProblemError> {
        self.plant(&[], theta, &[], |number, _| number)
    }

    /// The method, with shorter steps if friction turns sharply.
    fn steps_at(&self, theta: &[f64]) -> Result<Method, ProblemError> {
        let decay = fastest_decay(&self.bare::<Seeded>(theta)?);
        Ok(self.method.stable_at(decay, self.robot.sample_time))
    }

    /// Whether the arm may be linearised along runs.
    pub(super) fn follows_courses(&self, theta: &[f64]) -> Result<bool, ProblemError> {
        Ok(self.method.has_fixed_steps() && self.bare::<f64>(theta)?.follows_courses())
    }

    /// The run of the model over the logs `records`.
    pub(super) fn own_run(&self, records: &[usize], theta: &[f64]) -> Result<OwnRun, ProblemError> {
        let plant = self.plant::<Lanes<LANES>>(records, theta, &[], |number, _| number)?;
        let joints = plant.joint_slots();
        let rates = plant.n_angles() + joints.start..plant.n_angles() + joints.end;
        let mut states = Vec::new();
        let mut keep = |x: &[Lanes<LANES>]| {
            states.extend_from_slice(&x[joints.clone()]);
            states.extend_from_slice(&x[rates.clone()]);
        };
        let mut stepper = Stepper::new(&plant);
        let traces = self.traces(
            records,
            &plant,
            &mut stepper,
            0,
            self.steps_at(theta)?,
            Some(&mut keep),
        )?;
        let output = traces.into_iter().flatten().collect();
        let time = self.robot.sample_time;
        Ok(OwnRun::new(output, plant.chain, time, states))
    }

    /// Model output of the logs `records` with the first `n_seeds` derivatives; `keep` receives
    /// every state.
    fn traces<S: Scalar>(
        &self,
        records: &[usize],
        plant: &Plant<S>,
        stepper: &mut Stepper<S>,
        n_seeds: usize,
        method: Method,
        mut keep: Option<Keep<'_, S>>,
    ) -> Result<Traces, ProblemError> {
        let n_outputs = self.n_outputs();
        let packing = Packing::of(records.len());
        let in_lanes = packing.fill(records);
        let inputs: Vec<&[f64]> = in_lanes
            .iter()
            .map(|r| &self.records[*r].input[..])
            .collect();
        let targets: Vec<&[f64]> = in_lanes
            .iter()
            .map(|r| &self.records[*r].target[..])
            .collect();
        let own = |r: &usize| self.records[*r].start.as_deref();
        let rest = &self.robot.operating_point[..];
        let starts: Vec<&[f64]> = in_lanes.iter().map(|r| own(r).unwrap_or(rest)).collect();
        let n_samples = records
            .iter()
            .map(|r| self.n_samples(*r))
            .max()
            .unwrap_or(0);
        let series = || vec![Vec::with_capacity(n_samples); records.len() * n_outputs];
        let mut traces: Traces = (0..=n_seeds).map(|_| series()).collect();
        let run = Run {
            controller: &self.robot.controller,
            sample_time: self.robot.sample_time,
            start: &starts,
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
            disturbances: false,
            accelerometers: self.compares_accelerations(),
            method,
            cancel: self.cancel.as_deref(),
        };
        let mut observe = |sample: &Sample<'_, S>| {
            if let Some(keep) = &mut keep {
                keep(sample.state);
            }
            let output = match self.output {
                SimulationOutput::Torque => sample.command,
                SimulationOutput::Position => sample.measured,
            };
            let sensed = self.sensed.iter().map(|s| s.quantity.at(plant, sample));
            for (number, y) in output.iter().copied().chain(sensed).enumerate() {
                for (lane, record) in records.iter().enumerate() {
                    if sample.index < self.records[*record].lead {
                        continue;
                    }
                    let slot = lane * n_outputs + number;
                    traces[0][slot].push(y.lane(lane));
                    for seed in 0..n_seeds {
                        traces[seed + 1][slot].push(packing.slope(&y, seed, lane));
                    }
                }
            }
        };
        let (sample, what) = match simulate(plant, &run, stepper, &mut observe)? {
            Status::Completed => return Ok(traces),
            Status::Cancelled(_) => return Err(ProblemError::Cancelled),
            Status::Diverged(k) => (k, "diverged"),
            Status::StepSizeCollapsed(k) => (k, "step size collapsed"),
        };
        let reason = format!("{what} at sample {sample}");
        Err(ProblemError::diverged(records, Some(sample), &reason))
    }

    /// Model output of the logs `records` with derivatives along `seeds`.
    pub(super) fn pass(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
        arm: &Arm<'_>,
    ) -> Result<Traces, ProblemError> {
        match Packing::of(records.len()).partials(seeds.len()) {
            0 => self.run::<Lanes<LANES>>(records, theta, seeds, arm),
            1 => self.run::<Dual<Lanes<LANES>, 1>>(records, theta, seeds, arm),
            2 => self.run::<Dual<Lanes<LANES>, 2>>(records, theta, seeds, arm),
            _ => self.run::<Dual<Lanes<LANES>, PARTIALS>>(records, theta, seeds, arm),
        }
    }

    fn run<S: Scalar<Real = Lanes<LANES>>>(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
        arm: &Arm<'_>,
    ) -> Result<Traces, ProblemError> {
        let packing = Packing::of(records.len());
        let seed = |number, seed| packing.seeded(number, seed);
        let plant = self.plant::<S>(records, theta, seeds, seed)?;
        let mut stepper = match arm {
            Arm::Exact => Stepper::new(&plant),
            Arm::Along(course) => Stepper::along(&plant, course)?,
        };
        self.traces(
            records,
            &plant,
            &mut stepper,
            seeds.len(),
            self.steps_at(theta)?,
            None,
        )
    }
}

/// How an evaluation simulates one batch of logs.
enum Prepared<'a> {
    /// With the full equations of the arm, for values and derivatives.
    Exact,
    /// Along runs of a similar model.
    Near(&'a Batch),
    /// Along the run of the model itself.
    Own(Arc<OwnRun>),
}

impl SimulationErrorProblem {
    /// Choose how each batch is simulated.
    fn prepared(
        &self,
        batches: &[Vec<usize>],
        theta: &[f64],
        n_columns: usize,
    ) -> Result<Vec<Prepared<'_>>, ProblemError> {
        let exact = || batches.iter().map(|_| Prepared::Exact).collect();
        let few = 0 < n_columns && n_columns < WORTH_A_COURSE;
        if self.courses.is_none() && few || !self.follows_courses(theta)? {
            return Ok(exact());
        }
        if let Some(courses) = &self.courses {
            let joints = self.bare::<f64>(theta)?.chain.len();
            if !courses.fit(joints, batches.len()) {
                return Ok(exact());
            }
            let numbers = 0..batches.len();
            let batch = |b| courses.batch(b).map_or(Prepared::Exact, Prepared::Near);
            return Ok(numbers.map(batch).collect());
        }
        let run = |records: &Vec<usize>| {
            let run = self.own_run(records, theta)?;
            Ok(Prepared::Own(Arc::new(run)))
        };
        batches.par_iter().map(run).collect()
    }

    /// Output of a batch with derivatives along `seeds`.
    fn output(
        &self,
        records: &[usize],
        theta: &[f64],
        seeds: &[usize],
        prepared: &Prepared<'_>,
    ) -> Result<Traces, ProblemError> {
        match prepared {
            Prepared::Exact => self.pass(records, theta, seeds, &Arm::Exact),
            Prepared::Near(batch) => {
                let mut traces = self.pass(records, theta, seeds, &Arm::Along(&batch.course))?;
                batch.correct(&mut traces);
                Ok(traces)
            }
            Prepared::Own(run) if seeds.is_empty() => Ok(vec![run.output.clone()]),
            Prepared::Own(run) => {
                let mut traces = self.pass(records, theta, seeds, &Arm::Along(run.course()))?;
                if let Some(first) = traces.first_mut() {
                    first.clone_from(&run.output);
                }
                Ok(traces)
            }
        }
    }

    /// Residuals and derivatives of all batches.
    fn evaluated(
        &self,
        theta: &[f64],
        columns: &[usize],
        batches: &[Vec<usize>],
        prepared: &[Prepared<'_>],
    ) -> Result<Evaluation, ProblemError> {
        let tasks: Vec<_> = batches
            .iter()
            .zip(prepared)
            .flat_map(|(batch, prepared)| {
                let passes = Packing::of(batch.len()).passes(columns.len());
                passes.map(move |range| (batch, prepared, range))
            })
            .collect();
        let done: Vec<_> = tasks
            .par_iter()
            .map(|(batch, prepared, range)| {
                let traces = self.output(batch, theta, &columns[range.clone()], prepared)?;
                Ok(self.whiten(batch, traces))
            })
            .collect::<Result<_, ProblemError>>()?;
        let mut residual = Vec::new();
        let mut derivatives = vec![Vec::new(); columns.len()];
        for ((_, _, range), series) in tasks.iter().zip(done) {
            let mut series = series.into_iter();
            let first = series.next().unwrap_or_default();
            if range.start == 0 {
                residual.extend(first.into_iter().flatten());
            }
            for (column, values) in derivatives[range.clone()].iter_mut().zip(series) {
                column.extend(values.into_iter().flatten());
            }
        }
        let own = prepared.iter().filter_map(|batch| match batch {
            Prepared::Own(run) => Some(Arc::clone(run)),
            _ => None,
        });
        Ok(Evaluation {
            residual,
            columns: derivatives,
            runs: own.collect(),
        })
    }
}

impl Problem for SimulationErrorProblem {
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError> {
        let batches = self.batches();
        let prepared = self.prepared(&batches, theta, columns.len())?;
        self.evaluated(theta, columns, &batches, &prepared)
    }

    fn differentiate(
        &self,
        theta: &[f64],
        columns: &[usize],
        runs: &Runs,
    ) -> Result<Evaluation, ProblemError> {
        let batches = self.batches();
        if runs.len() != batches.len() {
            return self.evaluate(theta, columns);
        }
        let own = runs.iter().map(|run| Prepared::Own(Arc::clone(run)));
        self.evaluated(theta, columns, &batches, &own.collect::<Vec<_>>())
    }

    fn blocks(&self) -> Vec<Block> {
        let lengths = (0..self.records.len()).map(|record| self.n_samples(record));
        blocks(
            lengths,
            self.weightings(),
            self.robot.sample_time,
            self.block_s,
        )
    }
}
