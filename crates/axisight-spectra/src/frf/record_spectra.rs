//! DFT lines of whole records, periodic or not, for the local methods.

use super::local_least_squares::C;
use axisight_numerics::{Dft, DftScratch};
use rayon::prelude::*;

/// Records of several experiments, row-major `(experiment, sample, channel)`.
#[derive(Debug, Clone, Copy)]
pub struct Records<'a> {
    /// Samples of one record.
    pub n_samples: usize,
    /// Channels of the input.
    pub n_inputs: usize,
    /// Channels of the output.
    pub n_outputs: usize,
    /// Input.
    pub input: &'a [f64],
    /// Output.
    pub output: &'a [f64],
}

/// Lines 1 to the last below half the sampling frequency, for every channel, inputs first.
#[derive(Debug, Clone)]
pub(super) struct RecordSpectra {
    pub(super) n_samples: usize,
    pub(super) n_experiments: usize,
    pub(super) n_inputs: usize,
    pub(super) n_outputs: usize,
    n_lines: usize,
    lines: Vec<C>,
}

impl RecordSpectra {
    pub(super) fn new(records: &Records<'_>) -> Self {
        let Records {
            n_samples,
            n_inputs,
            n_outputs,
            ..
        } = *records;
        let channels = n_inputs + n_outputs;
        let n_experiments = records.input.len() / (n_samples * n_inputs);
        let wanted: Vec<usize> = (1..n_samples.div_ceil(2)).collect();
        let n_lines = wanted.len();
        let mut lines = vec![C::default(); n_experiments * channels * n_lines];
        let dft = Dft::new(n_samples);
        let sample = |e: usize, c: usize, n: usize| match c.checked_sub(n_inputs) {
            None => records.input[(e * n_samples + n) * n_inputs + c],
            Some(o) if o < n_outputs => records.output[(e * n_samples + n) * n_outputs + o],
            Some(_) => 0.0,
        };
        // Two channels share a transform. Each is scaled to its peak, because the rounding of a
        // large channel would drown a small one. A channel of zeros stays zero.
        let peak = |e: usize, c: usize| {
            (0..n_samples)
                .map(|n| sample(e, c, n).abs())
                .fold(0.0, f64::max)
        };
        let divisor = |peak: f64| if peak > 0.0 { peak } else { 1.0 };
        for (e, record) in lines.chunks_exact_mut(channels * n_lines).enumerate() {
            record
                .par_chunks_mut(2 * n_lines)
                .enumerate()
                .for_each_init(DftScratch::default, |scratch, (pair, out)| {
                    let (a, b) = out.split_at_mut(n_lines);
                    let (c, d) = (2 * pair, 2 * pair + 1);
                    let (p, q) = (peak(e, c), peak(e, d));
                    let (by_p, by_q) = (divisor(p), divisor(q));
                    let samples =
                        (0..n_samples).map(|n| (sample(e, c, n) / by_p, sample(e, d, n) / by_q));
                    dft.pair(samples, &wanted, scratch, |i, first, second| {
                        a[i] = first * p;
                        if let Some(value) = b.get_mut(i) {
                            *value = second * q;
                        }
                    });
                });
        }
        Self {
            n_samples,
            n_experiments,
            n_inputs,
            n_outputs,
            n_lines,
            lines,
        }
    }

    /// Highest line available.
    pub(super) fn last_line(&self) -> usize {
        self.n_lines
    }

    /// Lines 1, 2, ... of a channel; inputs first, then outputs.
    pub(super) fn channel(&self, experiment: usize, channel: usize) -> &[C] {
        let start = (experiment * (self.n_inputs + self.n_outputs) + channel) * self.n_lines;
        &self.lines[start..start + self.n_lines]
    }

    /// Largest amplitude of every input over all lines and experiments.
    pub(super) fn input_peaks(&self) -> Vec<f64> {
        (0..self.n_inputs)
            .map(|i| {
                (0..self.n_experiments)
                    .flat_map(|e| self.channel(e, i))
                    .map(|c| c.norm())
                    .fold(0.0, f64::max)
            })
            .collect()
    }
}
