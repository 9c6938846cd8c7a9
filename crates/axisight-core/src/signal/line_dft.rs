//! DFT of real records at chosen lines only.
//!
//! `X_k = sum_n x_n exp(-2 pi i k n / N)` without scale. With `N = D M`, the sum over
//! `n = D j + d` is a sum over `d` of transforms of `M` samples, `D` apart, turned by
//! `exp(-2 pi i k d / N)`. `M = N` is the whole FFT, `M = 1` the plain sum; what lies between
//! pays when the lines are few. `M` is the divisor of `N` with the fewest operations.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

type C = Complex<f64>;

/// What one turn of one line costs, in the operations of the FFT's innermost loop (which run
/// four or eight at a time; the turns do not).
const TURN: f64 = 40.0;

/// A plan for records of one length and one set of lines.
#[derive(Clone)]
pub struct LineDft {
    n: usize,
    fft: Arc<dyn Fft<f64>>,
    /// Places of `k` and `-k` modulo `M`.
    places: Vec<(usize, usize)>,
    /// `exp(-2 pi i k d / N) / 2`, row-major `(d, line)`.
    turns: Vec<C>,
}

/// Work space of one thread.
#[derive(Debug, Clone, Default)]
pub struct LineDftScratch {
    data: Vec<C>,
    work: Vec<C>,
}

impl std::fmt::Debug for LineDft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (n, m, lines) = (self.n, self.fft.len(), self.places.len());
        write!(f, "LineDft({lines} lines of {n}, transforms of {m})")
    }
}

/// Operations with transforms of `m` samples.
fn operations(n: usize, m: usize, lines: usize) -> f64 {
    5.0 * n as f64 * (m as f64).log2() + TURN * (lines * (n / m)) as f64
}

/// The divisor of `n` with the fewest operations.
fn transform_length(n: usize, lines: usize) -> usize {
    let divisors = (1..=n).take_while(|d| d * d <= n).filter(|d| n % d == 0);
    divisors
        .flat_map(|d| [d, n / d])
        .min_by(|a, b| operations(n, *a, lines).total_cmp(&operations(n, *b, lines)))
        .unwrap_or(n)
}

impl LineDft {
    /// For records of `n` samples, at `lines` (modulo `n`).
    pub fn new(n: usize, lines: &[usize]) -> Self {
        Self::with_transforms_of(transform_length(n, lines.len()), n, lines)
    }

    fn with_transforms_of(m: usize, n: usize, lines: &[usize]) -> Self {
        let count = n.checked_div(m).unwrap_or(0);
        let turns = (0..count).flat_map(|d| {
            // The product is reduced before it is rounded.
            let angle = move |k: &usize| -TAU * ((k * d) % n) as f64 / n as f64;
            lines.iter().map(move |k| C::from_polar(0.5, angle(k)))
        });
        Self {
            n,
            fft: FftPlanner::new().plan_fft_forward(m),
            places: lines.iter().map(|k| (k % m, (m - k % m) % m)).collect(),
            turns: turns.collect(),
        }
    }

    /// Samples per record.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Whether the record length is zero.
    pub fn is_empty(&self) -> bool {
        self.n == 0
    }

    /// Add the lines of two real records to `a` and `b`, sample `n` being `pair(n)`; returns
    /// the sums of their samples.
    ///
    /// Both go through one complex transform and are told apart by symmetry.
    pub fn pair(
        &self,
        pair: impl Fn(usize) -> (f64, f64),
        scratch: &mut LineDftScratch,
        a: &mut [C],
        b: &mut [C],
    ) -> (f64, f64) {
        let m = self.fft.len();
        let count = self.n.checked_div(m).unwrap_or(0);
        let LineDftScratch { data, work } = scratch;
        work.resize(self.fft.get_inplace_scratch_len(), C::default());
        data.resize(self.n, C::default());
        for j in 0..m {
            for d in 0..count {
                let (a, b) = pair(j * count + d);
                data[d * m + j] = C::new(a, b);
            }
        }
        self.fft.process_with_scratch(data, work);
        let mut sum = C::default();
        for (d, data) in data.chunks_exact(m.max(1)).enumerate() {
            sum += data[0];
            let turns = &self.turns[d * self.places.len()..];
            let out = a.iter_mut().zip(b.iter_mut());
            for (((a, b), (here, mirror)), turn) in out.zip(&self.places).zip(turns) {
                let (z, w) = (data[*here], data[*mirror].conj());
                let difference = z - w;
                *a += turn * (z + w);
                *b += turn * C::new(difference.im, -difference.re);
            }
        }
        (sum.re, sum.im)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every way to cut a record gives the plain sum.
    #[test]
    fn equals_the_plain_sum_for_every_divisor() {
        let n = 60;
        let x = |i: usize| {
            (
                (0.37 * i as f64).sin() + 0.2,
                (1.3 * i as f64).cos() * i as f64,
            )
        };
        let lines = [1, 2, 7, 15, 29];
        for m in [1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60] {
            let plan = LineDft::with_transforms_of(m, n, &lines);
            let (mut a, mut b) = (vec![C::default(); 5], vec![C::default(); 5]);
            let sums = plan.pair(x, &mut LineDftScratch::default(), &mut a, &mut b);
            let plain = (0..n).fold((0.0, 0.0), |s, i| (s.0 + x(i).0, s.1 + x(i).1));
            assert!((sums.0 - plain.0).abs() + (sums.1 - plain.1).abs() < 1e-11);
            for (line, k) in lines.iter().enumerate() {
                let turn = |i: usize| C::from_polar(1.0, -TAU * (k * i) as f64 / n as f64);
                let p: C = (0..n).map(|i| turn(i) * x(i).0).sum();
                let q: C = (0..n).map(|i| turn(i) * x(i).1).sum();
                // 60 terms up to 60, angles to 1e-15.
                assert!((a[line] - p).norm() < 1e-11, "{m}");
                assert!((b[line] - q).norm() < 1e-10, "{m}");
            }
        }
    }

    #[test]
    fn few_lines_are_summed_many_are_transformed() {
        assert_eq!(transform_length(20_011, 1), 1); // prime
        assert_eq!(transform_length(20_011, 391), 20_011);
        assert!((500..=5000).contains(&transform_length(20_000, 391)));
        assert_eq!(transform_length(20_000, 9_999), 20_000);
    }
}
