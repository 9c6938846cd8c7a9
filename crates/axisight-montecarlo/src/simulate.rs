//! Simulation of a group of experiments. Only this module distinguishes linear and nonlinear
//! plants.

use super::error::StudyError;
use super::record::Recorder;
use super::study::Study;
use axisight_core::plant::{assemble, equilibrium, stepper};
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_core::simulation::{
    Drive, LinearPlant, Method, Run, Sample, SimulationError, Status, Stepper, simulate,
    simulate_linear,
};
use axisight_numerics::DftScratch;
use axisight_scalar::Scalar;
use axisight_spectra::frf::Spectra;
use std::sync::atomic::AtomicBool;

/// The plant that a study simulates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Model {
    /// Linearized at the start and propagated exactly, see [`LinearPlant`].
    Linear {
        /// Steps per sample, for the ripple.
        substeps: usize,
    },
    /// Full equations of motion.
    Nonlinear(Method),
}

/// One experiment of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Job {
    pub(super) run: u64,
    pub(super) experiment: usize,
}

/// The plant of a group of experiments.
pub(super) enum GroupPlant {
    Linear {
        plant: Box<LinearPlant>,
        substeps: usize,
    },
    Nonlinear {
        robot: Box<RobotDescription>,
        effects: Vec<EffectSetting<f64>>,
        method: Method,
    },
}

impl GroupPlant {
    pub(super) fn new(
        model: Model,
        robot: &RobotDescription,
        effects: &[EffectSetting<f64>],
        start: &[f64],
    ) -> Result<Self, StudyError> {
        let plant = assemble::<f64>(robot, &[], effects)?;
        equilibrium(&plant, start)?;
        match model {
            Model::Linear { substeps } => Ok(Self::Linear {
                plant: Box::new(LinearPlant::new(robot, effects, start)?),
                substeps,
            }),
            Model::Nonlinear(method) => Ok(Self::Nonlinear {
                robot: Box::new(robot.clone()),
                effects: effects.to_vec(),
                method,
            }),
        }
    }

    fn simulate<S: Scalar>(
        &self,
        run: &Run<'_>,
        recorder: &mut Recorder<S>,
    ) -> Result<Status, SimulationError> {
        let mut observe = |s: &Sample<'_, S>| recorder.observe(s);
        match self {
            Self::Linear { plant, .. } => simulate_linear(plant, run, &mut observe),
            Self::Nonlinear { robot, effects, .. } => {
                let lifted: Vec<_> = effects.iter().map(EffectSetting::lifted).collect();
                let Ok(plant) = assemble::<S>(robot, &[], &lifted) else {
                    return Ok(Status::Diverged(0));
                };
                let mut stepper = if run.method.may_be_implicit() {
                    match stepper(&plant, robot, effects) {
                        Ok(stepper) => stepper,
                        Err(_) => return Ok(Status::Diverged(0)),
                    }
                } else {
                    Stepper::new(&plant)
                };
                simulate(&plant, run, &mut stepper, &mut observe)
            }
        }
    }

    /// Whether the integrator can simulate single runs only.
    fn one_at_a_time(&self) -> bool {
        matches!(self, Self::Nonlinear { method, .. } if method.may_be_implicit())
    }

    fn method(&self) -> Method {
        match self {
            Self::Linear { substeps, .. } => Method::RungeKutta4 {
                substeps: *substeps,
            },
            Self::Nonlinear { method, .. } => *method,
        }
    }
}

/// How an experiment ended.
pub(super) enum Outcome {
    Completed(Spectra),
    /// The commands keep growing, so the loop is unstable.
    Unstable,
    Stopped(Status),
    NoEquilibrium,
}

/// Simulate up to `S::LANES` experiments on one plant, in lock-step.
///
/// A status other than completed holds for the whole group, see [`Group::run`].
fn lock_step<S: Scalar>(group: &Group<'_>, jobs: &[Job]) -> Result<Vec<Outcome>, Status> {
    let (study, seed) = (group.study, group.seed);
    let settings = &study.settings;
    let mut broadband: Vec<(u64, Vec<f64>)> = Vec::new();
    for job in jobs {
        if broadband.last().is_none_or(|(run, _)| *run != job.run) {
            broadband.push((job.run, study.broadband(seed, job.run)));
        }
    }
    let of_run = |run: u64| {
        let found = broadband.iter().find(|(r, _)| *r == run);
        found.map_or(&[][..], |(_, b)| b)
    };
    let references: Vec<Vec<f64>> = jobs
        .iter()
        .map(|job| study.reference(of_run(job.run), job.experiment))
        .collect();
    let noises: Vec<Vec<f64>> = jobs
        .iter()
        .filter_map(|job| study.noise(seed, job.run, job.experiment))
        .collect();
    let references: Vec<&[f64]> = references.iter().map(Vec::as_slice).collect();
    let noises: Vec<&[f64]> = noises.iter().map(Vec::as_slice).collect();
    let mut recorder = Recorder::<S>::new(
        study.n_axes(),
        study.period_samples(),
        settings.waiting_periods,
        settings.periods,
    );
    let run = Run {
        controller: &settings.robot.controller,
        sample_time: settings.robot.sample_time,
        start: &[&settings.start],
        drive: Drive::Reference(&references),
        noise: &noises,
        resolution: settings.resolution,
        disturbances: false,
        accelerometers: false,
        method: group.plant.method(),
        cancel: Some(group.cancel),
    };
    match group.plant.simulate(&run, &mut recorder) {
        Ok(Status::Completed) => {}
        Ok(status) => return Err(status),
        Err(_) => return Ok(jobs.iter().map(|_| Outcome::NoEquilibrium).collect()),
    }
    let mut scratch = DftScratch::default();
    let multisine = &settings.multisine;
    let outcomes = (0..jobs.len()).map(|lane| {
        if recorder.grows(lane) {
            return Outcome::Unstable;
        }
        let (dft, lines) = (multisine.dft(), multisine.lines());
        Outcome::Completed(recorder.spectra(lane, dft, lines, &mut scratch))
    });
    Ok(outcomes.collect())
}

/// Experiments that share a plant.
pub(super) struct Group<'a> {
    pub(super) study: &'a Study,
    pub(super) seed: u64,
    pub(super) plant: &'a GroupPlant,
    pub(super) cancel: &'a AtomicBool,
}

impl Group<'_> {
    /// Simulate `jobs`, at most `S::LANES` of them.
    ///
    /// If one lane stops, all lanes stop. The jobs are then repeated one by one, so that a run does
    /// not affect its neighbours.
    pub(super) fn run<S: Scalar>(&self, jobs: &[Job]) -> Vec<Outcome> {
        if S::LANES > 1 && self.plant.one_at_a_time() {
            let single = |job| self.run::<f64>(std::slice::from_ref(job));
            return jobs.iter().flat_map(single).collect();
        }
        match lock_step::<S>(self, jobs) {
            Ok(outcomes) => outcomes,
            Err(status @ Status::Cancelled(_)) => {
                jobs.iter().map(|_| Outcome::Stopped(status)).collect()
            }
            Err(status) if jobs.len() == 1 => vec![Outcome::Stopped(status)],
            Err(_) => jobs
                .iter()
                .flat_map(|job| self.run::<f64>(std::slice::from_ref(job)))
                .collect(),
        }
    }
}
