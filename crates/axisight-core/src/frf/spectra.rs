//! DFT lines of every period of every experiment.

use crate::signal::{LineDft, LineDftScratch};
use nalgebra::Complex;
use rayon::prelude::*;
use std::f64::consts::TAU;

type C = Complex<f64>;

/// Records of several channels, row-major `(experiment, period, sample, channel)`.
#[derive(Debug, Clone, Copy)]
pub struct Channels<'a> {
    /// Samples.
    pub data: &'a [f64],
    /// Channels.
    pub count: usize,
}

/// How many experiments, periods of each and samples of a period.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Experiments.
    pub experiments: usize,
    /// Periods of each.
    pub periods: usize,
    /// Samples of a period.
    pub samples: usize,
}

/// Spectra `(experiment, period, line, channel)`, the channels of all signals side by side,
/// without scale. Works on the threads of the current pool.
///
/// From the channels of the signals marked `true` the linear drift is removed: one slope for
/// each experiment and channel, from the means of its periods, none with a single period.
pub fn spectra(signals: &[(Channels<'_>, bool)], extent: Extent, lines: &[usize]) -> Vec<C> {
    let Extent {
        experiments,
        periods,
        samples,
    } = extent;
    let channels: usize = signals.iter().map(|(s, _)| s.count).sum();
    let plan = LineDft::new(samples, lines);
    let mut out = vec![C::default(); experiments * periods * lines.len() * channels];
    let mut sums = vec![0.0; experiments * periods * channels];
    if lines.is_empty() || channels == 0 {
        return out;
    }
    out.par_chunks_mut(lines.len() * channels)
        .zip(sums.par_chunks_mut(channels))
        .enumerate()
        .for_each_init(
            || {
                (
                    LineDftScratch::default(),
                    vec![C::default(); 2 * lines.len()],
                )
            },
            |(scratch, pair), (record, (out, sums))| {
                let places = signals.iter().flat_map(|(signal, _)| {
                    let start = record * samples * signal.count;
                    let own = &signal.data[start..start + samples * signal.count];
                    (0..signal.count).map(move |c| (&own[c..], signal.count))
                });
                let places: Vec<_> = places.collect();
                for (group, two) in places.chunks(2).enumerate() {
                    let (a, b) = (two[0], two[two.len() - 1]);
                    pair.fill(C::default());
                    let (first, second) = pair.split_at_mut(lines.len());
                    let at = |n: usize| (a.0[n * a.1], b.0[n * b.1]);
                    let both = plan.pair(at, scratch, first, second);
                    for (half, (values, sum)) in [(&*first, both.0), (&*second, both.1)]
                        .into_iter()
                        .take(two.len())
                        .enumerate()
                    {
                        let channel = 2 * group + half;
                        sums[channel] = sum;
                        for (line, value) in values.iter().enumerate() {
                            out[line * channels + channel] = *value;
                        }
                    }
                }
            },
        );
    remove_drift(&mut out, &sums, signals, extent, lines);
    out
}

/// Subtract `slope n`, whose DFT is `slope N / (exp(-2 pi i k / N) - 1)`.
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
