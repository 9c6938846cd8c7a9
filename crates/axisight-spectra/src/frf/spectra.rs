//! DFT lines of every period of every experiment.

use axisight_numerics::{LineDft, LineDftScratch, Threads, line_plan};
use nalgebra::Complex;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

type C = Complex<f64>;

/// Records of several channels, row-major `(experiment, period, sample, channel)`.
#[derive(Debug, Clone, Copy)]
pub struct Channels<'a> {
    /// Samples.
    pub data: &'a [f64],
    /// Number of channels.
    pub count: usize,
}

/// Numbers of experiments, of periods, and of samples of a period.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Number of experiments.
    pub experiments: usize,
    /// Number of periods of each experiment.
    pub periods: usize,
    /// Number of samples of a period.
    pub samples: usize,
}

/// Plans for signals of one extent at the requested lines.
#[derive(Debug, Clone)]
pub struct LineSpectra {
    lines: Vec<usize>,
    /// One plan for each signal. Signals with the same number of channels share a plan.
    plans: Vec<Arc<LineDft>>,
}

impl LineSpectra {
    /// Plans for signals with these numbers of channels and periods of `samples`.
    pub fn new(channels: &[usize], samples: usize, lines: &[usize]) -> Self {
        let plan = |count: &usize| line_plan(samples, *count, lines);
        let plans = channels.iter().map(plan).collect();
        Self {
            lines: lines.to_vec(),
            plans,
        }
    }

    /// Spectra `(experiment, period, line, channel)` without a scale factor, with the channels of
    /// all signals side by side.
    ///
    /// The linear drift is removed from signals marked `true`. Each experiment and channel has one
    /// slope, computed from the means of its periods. A single period has no slope.
    pub fn of(&self, signals: &[(Channels<'_>, bool)], extent: Extent, threads: Threads) -> Vec<C> {
        let channels: usize = signals.iter().map(|(s, _)| s.count).sum();
        let records = extent.experiments * extent.periods;
        let record = self.lines.len() * channels;
        let mut out = vec![C::default(); records * record];
        let mut sums = vec![0.0; records * channels];
        if out.is_empty() || extent.samples == 0 {
            return out;
        }
        let work = |scratch: &mut LineDftScratch,
                    (first, (out, sums)): (usize, (&mut [C], &mut [f64]))| {
            self.two(
                signals,
                (2 * first, records),
                extent.samples,
                scratch,
                out,
                sums,
            );
        };
        // Two periods share a transform.
        let (two, both) = (2 * record, 2 * channels);
        if threads == Threads::This {
            let mut scratch = LineDftScratch::default();
            let pairs = out.chunks_mut(two).zip(sums.chunks_mut(both));
            pairs.enumerate().for_each(|pair| work(&mut scratch, pair));
        } else {
            let pairs = out.par_chunks_mut(two).zip(sums.par_chunks_mut(both));
            pairs
                .enumerate()
                .for_each_init(LineDftScratch::default, work);
        }
        remove_drift(&mut out, &sums, signals, extent, &self.lines);
        out
    }

    /// Compute lines and sums of record `one` and the next. The last of an odd number is paired
    /// with itself.
    fn two(
        &self,
        signals: &[(Channels<'_>, bool)],
        (one, records): (usize, usize),
        samples: usize,
        scratch: &mut LineDftScratch,
        out: &mut [C],
        sums: &mut [f64],
    ) {
        let channels: usize = signals.iter().map(|(s, _)| s.count).sum();
        let mut first = 0;
        for ((signal, _), plan) in signals.iter().zip(&self.plans) {
            let size = samples * signal.count;
            let own = |record: usize| &signal.data[record * size..][..size];
            let found = plan.pair(own(one), own((one + 1).min(records - 1)), scratch);
            let halves = out.chunks_exact_mut(self.lines.len() * channels);
            for (half, (out, sums)) in halves.zip(sums.chunks_exact_mut(channels)).enumerate() {
                let pick = |both: &(C, C)| if half == 0 { both.0 } else { both.1 };
                let (lines, total) = found.split_at(self.lines.len() * signal.count);
                let rows = lines.chunks_exact(signal.count.max(1));
                for (out, row) in out.chunks_exact_mut(channels).zip(rows) {
                    for (out, both) in out[first..].iter_mut().zip(row) {
                        *out = pick(both);
                    }
                }
                for (sum, both) in sums[first..].iter_mut().zip(total) {
                    *sum = pick(both).re;
                }
            }
            first += signal.count;
        }
    }
}

/// Subtract the ramp `slope n`, whose DFT is `slope N / (exp(-2 pi i k / N) - 1)`.
fn remove_drift(
    out: &mut [C],
    sums: &[f64],
    signals: &[(Channels<'_>, bool)],
    extent: Extent,
    lines: &[usize],
) {
    let (periods, n) = (extent.periods, extent.samples as f64);
    if periods < 2 {
        return;
    }
    let channels: usize = signals.iter().map(|(s, _)| s.count).sum();
    let drifting: Vec<bool> = signals
        .iter()
        .flat_map(|(s, drifts)| std::iter::repeat_n(*drifts, s.count))
        .collect();
    let centre = (periods - 1) as f64 / 2.0;
    let weight: f64 = (0..periods).map(|p| (p as f64 - centre).powi(2)).sum();
    let ramp: Vec<C> = lines
        .iter()
        .map(|k| C::new(n, 0.0) / (C::from_polar(1.0, -TAU * *k as f64 / n) - 1.0))
        .collect();
    let record = lines.len() * channels;
    let experiments = out.chunks_exact_mut(periods * record);
    for (out, sums) in experiments.zip(sums.chunks_exact(periods * channels)) {
        for channel in (0..channels).filter(|c| drifting[*c]) {
            let moment: f64 = (0..periods)
                .map(|p| (p as f64 - centre) * sums[p * channels + channel])
                .sum();
            let slope = moment / weight / (n * n);
            for out in out.chunks_exact_mut(record) {
                for (line, ramp) in ramp.iter().enumerate() {
                    out[line * channels + channel] -= ramp * slope;
                }
            }
        }
    }
}
