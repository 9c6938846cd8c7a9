//! Record of a simulated experiment: the sum over its measured periods, and sums for drift and
//! growth.

use axisight_core::simulation::Sample;
use axisight_numerics::{Dft, DftScratch};
use axisight_scalar::Scalar;
use axisight_spectra::frf::Spectra;
use nalgebra::Complex;

/// Recorder of `S::LANES` experiments in lock-step.
pub(super) struct Recorder<S> {
    n_axes: usize,
    period: usize,
    waiting: usize,
    total: usize,
    /// Sums over the measured periods, `(axis, sample)`, because each axis has its own transform.
    command: Vec<S>,
    position: Vec<S>,
    /// For each of the last two periods and each axis: sums of the position (over the last quarter
    /// of the period), the command and the squared command.
    sums: [Vec<[S; 3]>; 2],
}

impl<S: Scalar> Recorder<S> {
    pub(super) fn new(n_axes: usize, period: usize, waiting: usize, periods: usize) -> Self {
        let none = vec![[S::zero(); 3]; n_axes];
        Self {
            n_axes,
            period,
            waiting,
            total: waiting + periods,
            command: vec![S::zero(); period * n_axes],
            position: vec![S::zero(); period * n_axes],
            sums: [none.clone(), none],
        }
    }

    pub(super) fn observe(&mut self, sample: &Sample<'_, S>) {
        let (period, k) = (sample.index / self.period, sample.index % self.period);
        for i in 0..self.n_axes {
            let at = i * self.period + k;
            let (u, y) = (sample.command[i], sample.measured[i]);
            if period == self.waiting {
                self.command[at] = u;
                self.position[at] = y;
            } else if period > self.waiting {
                self.command[at] += u;
                self.position[at] += y;
            }
        }
        if period + 2 >= self.total {
            let late = k >= self.tail_start();
            let sums = &mut self.sums[period + 2 - self.total];
            for (i, sums) in sums.iter_mut().enumerate() {
                let u = sample.command[i];
                if late {
                    sums[0] += sample.measured[i];
                }
                sums[1] += u;
                sums[2] = u.fma(u, sums[2]);
            }
        }
    }

    fn tail_start(&self) -> usize {
        self.period - (self.period / 4).max(1)
    }

    /// Whether the commands of `lane` keep growing. Their standard deviation more than triples from
    /// one period to the next, which under steady excitation happens only in an unstable loop.
    pub(super) fn grows(&self, lane: usize) -> bool {
        let count = self.period as f64;
        (0..self.n_axes).any(|i| {
            let scatter = |period: usize| {
                let [_, sum, squares] = self.sums[period][i];
                let (mean, square) = (sum.lane(lane) / count, squares.lane(lane) / count);
                (square - mean * mean, square)
            };
            let ((before, _), (after, size)) = (scatter(0), scatter(1));
            // The rounding of a constant command does not count as scatter.
            after > 9.0 * before && after > 1e-12 * size
        })
    }

    /// Spectra of one lane at `lines`, with the linear drift of the position removed.
    pub(super) fn spectra(
        &self,
        lane: usize,
        dft: &Dft,
        lines: &[usize],
        scratch: &mut DftScratch,
    ) -> Spectra {
        let n = self.n_axes;
        let zero = Complex::default();
        let mut out = Spectra {
            input: vec![zero; lines.len() * n],
            output: vec![zero; lines.len() * n],
        };
        let measured = (self.total - self.waiting) as f64;
        let count = (self.period - self.tail_start()) as f64;
        for i in 0..n {
            let tail = |t: usize| self.sums[t][i][0].lane(lane);
            // Drift per period, times the number of summed periods, per sample.
            let slope = (tail(1) - tail(0)) / count * measured / self.period as f64;
            let own = i * self.period..(i + 1) * self.period;
            let (command, position) = (&self.command[own.clone()], &self.position[own]);
            let samples = command
                .iter()
                .zip(position)
                .enumerate()
                .map(|(k, (u, y))| (u.lane(lane), y.lane(lane) - slope * k as f64));
            dft.pair(samples, lines, scratch, |line, u, y| {
                out.input[line * n + i] = u / measured;
                out.output[line * n + i] = y / measured;
            });
        }
        out
    }
}
