//! Packing of logs, and of derivatives, into the lanes of a simulation.
//!
//! If there are fewer logs than lanes, the logs run in several copies, each with derivatives along
//! other parameters. Two logs in four lanes compute eight derivatives in the time of four. Lanes do
//! not affect each other, so every number is the same as in a separate run, up to rounding.

use axisight_scalar::Scalar;
use std::ops::Range;

/// Number of runs in lock-step.
pub(super) const LANES: usize = 4;
/// Largest number of derivatives of one run in a pass.
pub(super) const PARTIALS: usize = 4;

/// Number of logs in the lanes of a simulation, and of their copies.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packing {
    logs: usize,
    copies: usize,
}

impl Packing {
    /// The packing of `logs` logs, from one log to one log per lane.
    pub(super) fn of(logs: usize) -> Self {
        let logs = logs.clamp(1, LANES);
        Self {
            logs,
            copies: LANES / logs,
        }
    }

    /// The log of each lane.
    pub(super) fn fill(&self, logs: &[usize]) -> Vec<usize> {
        logs.repeat(self.copies)
    }

    /// Range of the derivatives in each pass, for `columns` derivatives. There is one empty range
    /// if there are none.
    pub(super) fn passes(&self, columns: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let most = self.copies * PARTIALS;
        (0..columns.div_ceil(most).max(1)).map(move |i| i * most..((i + 1) * most).min(columns))
    }

    /// Number of derivatives of each run in a pass with `seeds` derivatives.
    pub(super) fn partials(&self, seeds: usize) -> usize {
        seeds.div_ceil(self.copies)
    }

    /// `number` with slope one along `seed`, in the copy that has this seed.
    pub(super) fn seeded<S: Scalar>(&self, number: S, seed: usize) -> S {
        let (copy, partial) = Self::place::<S>(seed);
        let here = S::from_lanes(|lane| f64::from(lane / self.logs == copy));
        number + S::zero().seeded(partial) * here
    }

    /// Slope of `y` along `seed` for a log.
    pub(super) fn slope<S: Scalar>(&self, y: &S, seed: usize, log: usize) -> f64 {
        let (copy, partial) = Self::place::<S>(seed);
        y.partial(partial, copy * self.logs + log)
    }

    /// Copy and partial derivative that belong to a seed.
    fn place<S: Scalar>(seed: usize) -> (usize, usize) {
        let each = S::PARTIALS.max(1);
        (seed / each, seed % each)
    }
}
