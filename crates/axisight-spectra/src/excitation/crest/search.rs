//! Crest-factor search from many starts in parallel, which keeps the best result.

use super::clipping::Clipper;
use super::lp::Refiner;
use super::{Clipping, CrestProblem, FineGrid, LpRefinement, polar};
use crate::excitation::{ExcitationError, random_phases};
use nalgebra::Complex;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Largest number of unknowns for a refinement. Above it, the dense normal matrices of each thread
/// need more than a quarter of a gigabyte.
const MOST_REFINED: usize = 4096;

/// Start of a search.
#[derive(Debug, Clone)]
pub enum Start {
    /// Random phases, a function of (seed, number of the start).
    Random(u64),
    /// One start from these phases of the wanted lines [rad].
    Given(Vec<f64>),
}

/// Limits of a search.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Number of starts. Without a time limit, the result depends on nothing else.
    pub starts: u64,
    /// Wall time after which no start begins and running starts stop early.
    pub time: Option<Duration>,
    /// Number of threads; 0 takes every processor.
    pub threads: usize,
}

/// Best result of a search.
#[derive(Debug, Clone)]
pub struct Found {
    /// Number of the best start.
    pub start: u64,
    /// Crest factor on the fine grid.
    pub crest_factor: f64,
    /// Crest factor of every start that began, in the order of their numbers.
    pub crest_factors: Vec<f64>,
    /// Phases [rad], wanted lines first, then snow lines.
    pub phase: Vec<f64>,
    /// Amplitudes of the snow lines, relative to the rms of the wanted amplitudes.
    pub snow: Vec<f64>,
    /// Number of clipping iterations and of Gauss-Newton steps, summed over all starts.
    pub effort: (u64, u64),
    /// Whether the search was cut short, by its time limit or by cancellation.
    pub out_of_time: bool,
}

/// Best signal of one start.
struct Best {
    fine: FineGrid,
    crest_factor: f64,
    coefficient: Vec<Complex<f64>>,
}

impl Best {
    fn new(problem: &CrestProblem, coefficient: &[Complex<f64>]) -> Self {
        let mut fine = FineGrid::new(problem);
        Self {
            crest_factor: fine.crest_factor(coefficient),
            coefficient: coefficient.to_vec(),
            fine,
        }
    }

    fn keep(&mut self, coefficient: &[Complex<f64>]) {
        let crest_factor = self.fine.crest_factor(coefficient);
        if crest_factor < self.crest_factor {
            self.crest_factor = crest_factor;
            self.coefficient.copy_from_slice(coefficient);
        }
    }
}

/// Search for the smallest crest factor by clipping and refinement from many starts.
///
/// Returns `None` if the search is cancelled before any start begins. Of equal crest factors the
/// lower start number wins, so the result does not depend on the number of threads.
///
/// # Errors
/// [`ExcitationError`] if a setting is out of range, there are no starts, the refinement has too
/// many unknowns, or the given phases are not one finite number per wanted line.
pub fn search(
    problem: &CrestProblem,
    start: &Start,
    clipping: Clipping,
    refinement: Option<LpRefinement>,
    budget: Budget,
    cancel: &AtomicBool,
) -> Result<Option<Found>, ExcitationError> {
    clipping.check()?;
    refinement.map_or(Ok(()), |r| r.check())?;
    let parts = 2 * problem.lines.len() - problem.wanted();
    if refinement.is_some() && parts > MOST_REFINED {
        let expected = format!("none with more than {MOST_REFINED} phases and amplitudes of snow");
        return Err(ExcitationError::new("refinement", expected, parts));
    }
    if budget.starts == 0 {
        return Err(ExcitationError::new("starts", "at least one", 0));
    }
    if let Start::Given(phases) = start {
        let n = problem.wanted();
        if phases.len() != n || phases.iter().any(|p| !p.is_finite()) {
            let expected = format!("{n} finite numbers");
            let got = format!("{} numbers", phases.len());
            return Err(ExcitationError::new("phase", expected, got));
        }
    }
    Ok(run(problem, start, clipping, refinement, budget, cancel))
}

/// Run a search whose arguments have been checked.
fn run(
    problem: &CrestProblem,
    start: &Start,
    clipping: Clipping,
    refinement: Option<LpRefinement>,
    budget: Budget,
    cancel: &AtomicBool,
) -> Option<Found> {
    let clipper = Clipper::new(problem, clipping);
    let refiner = refinement.map(|r| Refiner::new(problem, r));
    let deadline = budget.time.and_then(|t| Instant::now().checked_add(t));
    let late = || deadline.is_some_and(|d| Instant::now() >= d);
    let stop = || cancel.load(Ordering::Relaxed) || late();
    let effort = (AtomicU64::new(0), AtomicU64::new(0));
    let cut = AtomicBool::new(false);
    let starts = match start {
        Start::Random(_) => budget.starts,
        Start::Given(_) => 1,
    };
    let one = |run: u64| {
        // Even without time left, the first start begins, because there must be a result.
        if cancel.load(Ordering::Relaxed) || (run > 0 && late()) {
            cut.store(true, Ordering::Relaxed);
            return None;
        }
        let mut d = match start {
            Start::Given(phases) => problem.start(phases),
            Start::Random(seed) => problem.start(&random_phases(problem.wanted(), *seed, run)),
        };
        let mut best = Best::new(problem, &d);
        let clips = clipper.run(&mut d, stop);
        best.keep(&d);
        let mut steps = 0;
        if let Some(refiner) = &refiner {
            steps = refiner.run(&mut d, stop);
            best.keep(&d);
        }
        effort.0.fetch_add(clips as u64, Ordering::Relaxed);
        effort.1.fetch_add(steps as u64, Ordering::Relaxed);
        if stop() {
            cut.store(true, Ordering::Relaxed);
        }
        Some((run, best.crest_factor, best.coefficient))
    };
    // The starts begin in order, so that a search cut short has done the first ones.
    let all = || (0..starts).par_bridge().filter_map(one).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(budget.threads);
    let mut found: Vec<_> = match pool.build() {
        Ok(pool) => pool.install(all),
        // If no threads can be started, the calling thread runs all starts.
        Err(_) => (0..starts).filter_map(one).collect(),
    };
    found.sort_unstable_by_key(|f| f.0);
    let best = found
        .iter()
        .min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))?;
    let polar: Vec<_> = best.2.iter().map(|d| polar(*d)).collect();
    Some(Found {
        start: best.0,
        crest_factor: best.1,
        crest_factors: found.iter().map(|f| f.1).collect(),
        phase: polar.iter().map(|p| p.1).collect(),
        snow: polar[problem.wanted()..].iter().map(|p| p.0).collect(),
        effort: (
            effort.0.load(Ordering::Relaxed),
            effort.1.load(Ordering::Relaxed),
        ),
        out_of_time: cut.load(Ordering::Relaxed),
    })
}
