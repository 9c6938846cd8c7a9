//! Cache of recent plans: making a plan takes longer than transforming a few records.

use super::LineDft;
use std::sync::{Arc, Mutex, PoisonError};

/// Number of plans that the cache keeps.
const KEPT: usize = 4;

/// Largest record (samples times channels) whose plan is kept. For longer records the transform
/// takes much longer than the plan.
const LARGEST: usize = 1 << 20;

struct Kept {
    samples: usize,
    channels: usize,
    lines: Vec<usize>,
    plan: Arc<LineDft>,
}

/// The latest plan comes last.
static RECENT: Mutex<Vec<Kept>> = Mutex::new(Vec::new());

/// A plan for records of `samples` of `channels`, at `lines`, from the cache if possible.
pub fn line_plan(samples: usize, channels: usize, lines: &[usize]) -> Arc<LineDft> {
    let fits =
        |kept: &Kept| (kept.samples, kept.channels) == (samples, channels) && kept.lines == lines;
    let recent = || RECENT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(kept) = recent().iter().find(|kept| fits(kept)) {
        return Arc::clone(&kept.plan);
    }
    let plan = Arc::new(LineDft::new(samples, channels, lines));
    if samples * channels <= LARGEST {
        let mut kept = recent();
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push(Kept {
            samples,
            channels,
            lines: lines.to_vec(),
            plan: Arc::clone(&plan),
        });
    }
    plan
}
