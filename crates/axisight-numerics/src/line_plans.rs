//! Plans used lately: a plan takes longer to make than a few records to transform.

use super::LineDft;
use std::sync::{Arc, Mutex, PoisonError};

/// Plans kept.
const KEPT: usize = 4;

/// Numbers of a record, samples times channels, above which the work dwarfs the plan.
const LARGEST: usize = 1 << 20;

struct Kept {
    samples: usize,
    channels: usize,
    lines: Vec<usize>,
    plan: Arc<LineDft>,
}

/// Latest last.
static RECENT: Mutex<Vec<Kept>> = Mutex::new(Vec::new());

/// A plan for records of `samples` of `channels`, at `lines`.
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
