//! A block of consecutive runs, which is the unit of work, of storage and of repetition.

use super::error::StudyError;
use super::simulate::{Group, GroupPlant, Job, Model, Outcome};
use super::spread::draw;
use super::study::Study;
use axisight_core::simulation::Status;
use axisight_numerics::SmallSolver;
use axisight_scalar::Lanes;
use axisight_spectra::ensemble::{Moments, QuantileSketch};
use axisight_spectra::frf::{Spectra, response};
use nalgebra::Complex;
use std::sync::atomic::{AtomicBool, Ordering};

type C = Complex<f64>;

/// Reason why a run gave no response, or only a part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureKind {
    /// A state became infinite or NaN: the loop is unstable.
    Diverged,
    /// The commands keep growing from period to period: the loop is unstable.
    Unstable,
    /// The error bound of the integrator could not be met.
    StepSizeCollapsed,
    /// The drawn parameters are physically impossible.
    InvalidParameters,
    /// The arm does not settle with the drawn parameters.
    NoEquilibrium,
    /// The experiments do not excite all inputs at some lines. All other lines count.
    SingularLines,
}

impl FailureKind {
    /// All kinds, in the order of their codes.
    pub const ALL: [Self; 6] = [
        Self::Diverged,
        Self::Unstable,
        Self::StepSizeCollapsed,
        Self::InvalidParameters,
        Self::NoEquilibrium,
        Self::SingularLines,
    ];

    /// Name for reports and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Diverged => "diverged",
            Self::Unstable => "unstable",
            Self::StepSizeCollapsed => "step_size_collapsed",
            Self::InvalidParameters => "invalid_parameters",
            Self::NoEquilibrium => "no_equilibrium",
            Self::SingularLines => "singular_lines",
        }
    }
}

/// A failed run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Failure {
    /// Run number.
    pub run: u64,
    /// Kind of the failure.
    pub kind: FailureKind,
    /// First experiment with the failure; zero if it concerns the whole run.
    pub experiment: usize,
    /// Sample at which the simulation stopped, or the number of singular lines.
    pub detail: usize,
}

/// Accumulated results of the runs of a block.
#[derive(Debug, Clone)]
pub struct Block {
    /// Means and covariances.
    pub moments: Moments,
    /// Magnitude quantiles.
    pub sketch: QuantileSketch,
    /// Failed runs, in order.
    pub failures: Vec<Failure>,
    /// Every response, `(run, line, output, input)`, NaN for failed runs; empty unless requested.
    pub responses: Vec<C>,
}

/// Reason why a block gave no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BlockError {
    /// The caller cancelled the block.
    #[error("cancelled")]
    Cancelled,
    /// The run number is too large for the random streams.
    #[error("run: expected less than 2^40, got {0}")]
    Run(u64),
    /// The quantile accuracy is out of range.
    #[error(transparent)]
    Sketch(#[from] axisight_spectra::ensemble::SketchError),
}

/// The number of a noise stream is `(run * axes + experiment) << 16 | axis`, in 64 bits.
const MOST_RUNS: u64 = 1 << 40;

/// Compute the runs `first` to `first + count - 1` of a study, on the calling thread.
///
/// # Errors
/// [`BlockError`] if the block is cancelled or an argument is invalid. A failure of a run is a
/// [`Failure`].
pub fn run_block(
    study: &Study,
    seed: u64,
    first: u64,
    count: u64,
    keep_responses: bool,
    cancel: &AtomicBool,
) -> Result<Block, BlockError> {
    let end = first.saturating_add(count);
    if end > MOST_RUNS {
        return Err(BlockError::Run(end));
    }
    let size = study.size();
    let sketch = QuantileSketch::new(size, study.settings.relative_accuracy)?;
    let omega: Vec<f64> = study
        .frequency_hz()
        .iter()
        .map(|f| f * std::f64::consts::TAU)
        .collect();
    let mut sink = Sink {
        study,
        omega,
        keep_responses,
        block: Block {
            moments: Moments::new(size),
            sketch,
            failures: Vec::new(),
            responses: Vec::new(),
        },
    };
    let s = &study.settings;
    if matches!(s.model, Model::Linear { .. }) && s.spread.is_empty() {
        let plant = own_plant(study, seed, first);
        share_plant(study, seed, (first, end), plant, &mut sink, cancel)?;
    } else {
        for run in first..end {
            let outcomes = match own_plant(study, seed, run) {
                Ok(plant) => one_run(study, seed, run, &plant, cancel),
                Err(kind) => Err(unbuilt(run, kind)),
            };
            if cancel.load(Ordering::Relaxed) {
                return Err(BlockError::Cancelled);
            }
            sink.finish(run, outcomes);
        }
    }
    Ok(sink.block)
}

/// Simulate all runs on one plant, with the experiments of all runs as lanes.
///
/// Lanes do not affect each other, because every operation is elementwise and the steps are fixed.
fn share_plant(
    study: &Study,
    seed: u64,
    (first, end): (u64, u64),
    plant: Result<GroupPlant, FailureKind>,
    sink: &mut Sink<'_>,
    cancel: &AtomicBool,
) -> Result<(), BlockError> {
    let n = study.n_axes();
    let jobs: Vec<Job> = (first..end)
        .flat_map(|run| (0..n).map(move |experiment| Job { run, experiment }))
        .collect();
    let plant = match plant {
        Ok(plant) => plant,
        Err(kind) => {
            (first..end).for_each(|run| sink.finish(run, Err(unbuilt(run, kind))));
            return Ok(());
        }
    };
    let group = Group {
        study,
        seed,
        plant: &plant,
        cancel,
    };
    let mut waiting: Vec<(Job, Outcome)> = Vec::new();
    for chunk in jobs.chunks(8) {
        let outcomes = group.run::<Lanes<8>>(chunk);
        if cancel.load(Ordering::Relaxed) {
            return Err(BlockError::Cancelled);
        }
        waiting.extend(chunk.iter().copied().zip(outcomes));
        while waiting.len() >= n {
            let rest = waiting.split_off(n);
            let run = waiting[0].0.run;
            sink.finish(run, collect(run, waiting));
            waiting = rest;
        }
    }
    Ok(())
}

/// The failure of a run whose plant could not be built.
fn unbuilt(run: u64, kind: FailureKind) -> Failure {
    Failure {
        run,
        kind,
        experiment: 0,
        detail: 0,
    }
}

fn own_plant(study: &Study, seed: u64, run: u64) -> Result<GroupPlant, FailureKind> {
    let s = &study.settings;
    let drawn = draw(&s.robot, &s.effects, &s.spread, seed, run);
    let (robot, effects) = drawn.ok_or(FailureKind::InvalidParameters)?;
    GroupPlant::new(s.model, &robot, &effects, &s.start).map_err(|error| match error {
        StudyError::Equilibrium(_) => FailureKind::NoEquilibrium,
        _ => FailureKind::InvalidParameters,
    })
}

/// Simulate one run, with its experiments as lanes.
///
/// Lanes share adaptive steps, so runs are kept separate. Otherwise a response would depend on the
/// other runs in its lanes.
fn one_run(
    study: &Study,
    seed: u64,
    run: u64,
    plant: &GroupPlant,
    cancel: &AtomicBool,
) -> Result<Vec<Spectra>, Failure> {
    let group = Group {
        study,
        seed,
        plant,
        cancel,
    };
    let n = study.n_axes();
    let jobs: Vec<Job> = (0..n).map(|experiment| Job { run, experiment }).collect();
    let outcomes: Vec<Outcome> = match n {
        1 => group.run::<f64>(&jobs),
        2..=4 => group.run::<Lanes<4>>(&jobs),
        _ => jobs
            .chunks(8)
            .flat_map(|c| group.run::<Lanes<8>>(c))
            .collect(),
    };
    collect(run, jobs.into_iter().zip(outcomes).collect())
}

/// The spectra of a run, or the first failure among its experiments.
fn collect(run: u64, outcomes: Vec<(Job, Outcome)>) -> Result<Vec<Spectra>, Failure> {
    let mut out = Vec::with_capacity(outcomes.len());
    for (job, outcome) in outcomes {
        let (kind, detail) = match outcome {
            Outcome::Completed(spectra) => {
                out.push(spectra);
                continue;
            }
            Outcome::Unstable => (FailureKind::Unstable, 0),
            Outcome::NoEquilibrium => (FailureKind::NoEquilibrium, 0),
            Outcome::Stopped(Status::StepSizeCollapsed(k)) => (FailureKind::StepSizeCollapsed, k),
            Outcome::Stopped(Status::Diverged(k) | Status::Cancelled(k)) => {
                (FailureKind::Diverged, k)
            }
            Outcome::Stopped(Status::Completed) => (FailureKind::Diverged, 0),
        };
        return Err(Failure {
            run,
            kind,
            experiment: job.experiment,
            detail,
        });
    }
    Ok(out)
}

/// Accumulates the runs in their order.
struct Sink<'a> {
    study: &'a Study,
    omega: Vec<f64>,
    keep_responses: bool,
    block: Block,
}

impl Sink<'_> {
    fn finish(&mut self, run: u64, outcome: Result<Vec<Spectra>, Failure>) {
        let spectra = match outcome {
            Ok(spectra) => spectra,
            Err(failure) => {
                self.block.failures.push(failure);
                if self.keep_responses {
                    let nan = C::new(f64::NAN, f64::NAN);
                    let padded = self.block.responses.len() + self.study.size();
                    self.block.responses.resize(padded, nan);
                }
                return;
            }
        };
        let (g, singular) = response(&spectra, &self.omega, self.study.settings.output);
        if singular > 0 {
            self.block.failures.push(Failure {
                run,
                kind: FailureKind::SingularLines,
                experiment: 0,
                detail: singular,
            });
        }
        self.accumulate(&g);
        if self.keep_responses {
            self.block.responses.extend(g);
        }
    }

    fn accumulate(&mut self, g: &[C]) {
        let n = self.study.n_axes();
        let mut solver = SmallSolver::new(n);
        let mut inverse = vec![C::default(); n * n];
        for (line, matrix) in g.chunks_exact(n * n).enumerate() {
            // All elements of a singular line are NaN.
            if !matrix[0].re.is_finite() {
                continue;
            }
            let inverted = solver.invert(matrix, &mut inverse);
            for (i, value) in matrix.iter().enumerate() {
                let element = line * n * n + i;
                self.block.moments.push(element, *value);
                self.block.sketch.push(element, value.norm());
                if inverted {
                    self.block.moments.push_inverse(element, inverse[i]);
                }
            }
        }
    }
}
