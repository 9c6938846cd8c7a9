//! Logs in the lanes of a simulation, and derivatives in the lanes that logs leave.
//!
//! Fewer logs than lanes run in several copies, each with derivatives by other parameters: two
//! logs in four lanes carry eight of them in the time of four. Lanes do not feel one another: every
//! number is the one that it would be alone, but for rounding.

use axisight_scalar::Scalar;
use std::ops::Range;

/// Runs in lock-step.
pub(super) const LANES: usize = 4;
/// Most derivatives of one run in a pass.
pub(super) const PARTIALS: usize = 4;

/// How many logs share the lanes of a simulation, and in how many copies.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packing {
    logs: usize,
    copies: usize,
}

impl Packing {
    /// Of `logs` logs, one to as many as there are lanes.
    pub(super) fn of(logs: usize) -> Self {
        let logs = logs.clamp(1, LANES);
        Self {
            logs,
            copies: LANES / logs,
        }
    }

    /// The logs lane by lane.
    pub(super) fn fill(&self, logs: &[usize]) -> Vec<usize> {
        logs.repeat(self.copies)
    }

    /// Ranges of `columns` derivatives by pass; one empty range for none.
    pub(super) fn passes(&self, columns: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let most = self.copies * PARTIALS;
        (0..columns.div_ceil(most).max(1)).map(move |i| i * most..((i + 1) * most).min(columns))
    }

    /// Derivatives that each run carries, where a pass has `seeds` in all.
    pub(super) fn partials(&self, seeds: usize) -> usize {
        seeds.div_ceil(self.copies)
    }

    /// `number` with slope one by `seed`, in the copy that carries it.
    pub(super) fn seeded<S: Scalar>(&self, number: S, seed: usize) -> S {
        let (copy, partial) = Self::place::<S>(seed);
        let here = S::from_lanes(|lane| f64::from(lane / self.logs == copy));
        number + S::zero().seeded(partial) * here
    }

    /// Slope of `y` by `seed` for a log.
    pub(super) fn slope<S: Scalar>(&self, y: &S, seed: usize, log: usize) -> f64 {
        let (copy, partial) = Self::place::<S>(seed);
        y.partial(partial, copy * self.logs + log)
    }

    /// Copy and partial that carry a seed.
    fn place<S: Scalar>(seed: usize) -> (usize, usize) {
        let each = S::PARTIALS.max(1);
        (seed / each, seed % each)
    }
}
