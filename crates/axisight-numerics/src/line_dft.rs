//! DFT of real multichannel records at chosen lines only.
//!
//! `X_k = sum_n x_n exp(-2 pi i k n / N)`, without a scale factor. For `N = D M` and `n = D j + d`,
//! this is a sum over `d` of transforms of the `M` samples that lie `D` apart, each multiplied by
//! `exp(-2 pi i k d / N)`. `M = N` is the full FFT and `M = 1` the plain sum. Values between are
//! cheaper if the lines are few. `M` is the divisor of `N` with the least work.
//!
//! The samples of all channels lie side by side, so a record is a matrix of `M` rows with one
//! column for every `(d, channel)`. As many columns as a register has lanes are transformed at a
//! time, without copying. Two records share a transform, as its real and imaginary parts.

use super::lane_fft::{LaneFft, Rows, TwoReal, cost_per_row};
use super::pair::Pair;
use crate::plan::plan;
#[cfg(target_arch = "x86_64")]
use axisight_scalar::wide::{self, Wide};
use axisight_scalar::{Lanes, MOST_LANES, Register};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use std::f64::consts::TAU;
use std::sync::Arc;

type C = Complex<f64>;

/// Registers that every supported processor has.
type Narrow = Lanes<4>;

/// Cost to twiddle one line of one register of columns [vector instructions].
const TURN: f64 = 14.0;

/// The same for a row of a transform whose length has large prime factors, lane by lane.
const LANE_BY_LANE: f64 = 250.0;

/// A plan for records of one length and one set of lines.
#[derive(Debug, Clone)]
pub struct LineDft {
    engine: Engine,
}

/// A plan for the widest registers that the processor has.
#[derive(Debug, Clone)]
enum Engine {
    Narrow(Plan<Narrow>),
    #[cfg(target_arch = "x86_64")]
    Wide(Plan<Wide>),
}

/// Work space of one thread.
#[derive(Debug, Clone, Default)]
pub struct LineDftScratch {
    narrow: Work<Narrow>,
    #[cfg(target_arch = "x86_64")]
    wide: Work<Wide>,
    lines: Vec<(C, C)>,
}

impl LineDft {
    /// A plan for records of `n` samples of `channels`, at `lines` (modulo `n`).
    pub fn new(n: usize, channels: usize, lines: &[usize]) -> Self {
        #[cfg(target_arch = "x86_64")]
        if wide::available() {
            let m = transform_length(n, channels, lines.len(), Wide::LANES);
            let engine = Engine::Wide(Plan::new(m, n, channels, lines));
            return Self { engine };
        }
        let m = transform_length(n, channels, lines.len(), Narrow::LANES);
        let engine = Engine::Narrow(Plan::new(m, n, channels, lines));
        Self { engine }
    }

    /// Lines of two records, as pairs `(line of a, line of b)` over (line, channel).
    ///
    /// Each record holds `n` samples of all channels, `(sample, channel)`. After the requested
    /// lines comes line 0, the sum of the samples. The result is empty if a record is empty or has
    /// another length.
    pub fn pair<'w>(&self, a: &[f64], b: &[f64], scratch: &'w mut LineDftScratch) -> &'w [(C, C)] {
        let LineDftScratch { lines, .. } = scratch;
        lines.clear();
        match &self.engine {
            Engine::Narrow(plan) => plan.pair(a, b, &mut scratch.narrow, lines),
            #[cfg(target_arch = "x86_64")]
            Engine::Wide(plan) => {
                // SAFETY: a wide plan exists only if the processor has the instructions.
                #[allow(unsafe_code)]
                unsafe {
                    pair_wide(plan, a, b, &mut scratch.wide, lines);
                }
            }
        }
        lines
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq")]
fn pair_wide(
    plan: &Plan<Wide>,
    a: &[f64],
    b: &[f64],
    work: &mut Work<Wide>,
    out: &mut Vec<(C, C)>,
) {
    plan.pair(a, b, work, out);
}

/// Work with transforms of `m` samples [vector instructions].
fn work(n: usize, channels: usize, lines: usize, lanes: usize, m: usize) -> f64 {
    let registers = (n / m * channels).div_ceil(lanes) as f64;
    let transform = cost_per_row(m).unwrap_or(LANE_BY_LANE) * m as f64;
    registers * (transform + TURN * lines as f64)
}

/// The divisor of `n` with the least work.
fn transform_length(n: usize, channels: usize, lines: usize, lanes: usize) -> usize {
    let divisors = (1..=n)
        .take_while(|d| d * d <= n)
        .filter(|d| n.is_multiple_of(*d));
    let work = |m: &usize| work(n, channels, lines, lanes, *m);
    divisors
        .flat_map(|d| [d, n / d])
        .min_by(|a, b| work(a).total_cmp(&work(b)))
        .unwrap_or(n)
}

/// Roots of unity, `exp(-2 pi i k / n)`, each the product of two entries of short tables.
struct Roots {
    n: usize,
    coarse: Vec<C>,
    fine: Vec<C>,
    /// The short table of fine steps has `2^bits` entries.
    bits: u32,
}

impl Roots {
    fn new(n: usize) -> Self {
        let bits = n.ilog2().div_ceil(2);
        let step = 1 << bits;
        let root = |k: usize| C::from_polar(1.0, -TAU * k as f64 / n as f64);
        Self {
            n,
            coarse: (0..=n >> bits).map(|i| root(i * step)).collect(),
            fine: (0..step).map(root).collect(),
            bits,
        }
    }

    /// The roots at `0, k, 2 k, ...`, with the exponents reduced modulo `n` before any rounding.
    fn multiples(&self, k: usize, count: usize) -> impl Iterator<Item = C> {
        let k = k % self.n;
        let mut next = 0;
        (0..count).map(move |_| {
            let index = next;
            next += k;
            if next >= self.n {
                next -= self.n;
            }
            self.coarse[index >> self.bits] * self.fine[index & (self.fine.len() - 1)]
        })
    }
}

#[derive(Clone)]
enum Transform {
    Lanes(LaneFft),
    LaneByLane(Arc<dyn Fft<f64>>),
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Lanes(_) => "Lanes",
            Self::LaneByLane(_) => "LaneByLane",
        })
    }
}

/// The plan for one width of registers.
#[derive(Debug, Clone)]
struct Plan<R> {
    n: usize,
    m: usize,
    channels: usize,
    /// Number of columns: `D` times the channels.
    columns: usize,
    transform: Transform,
    /// Rows of the lines `k` and `-k`, modulo `M`.
    places: Vec<(usize, usize)>,
    /// `exp(-2 pi i k d / N) / 2` of every column, `(register, line)`.
    turns: Vec<Pair<R>>,
}

#[derive(Debug, Clone)]
struct Work<R> {
    one: Vec<Pair<R>>,
    two: Vec<Pair<R>>,
    /// Sums over the columns for lines and mirror lines, `(arrangement of the channels, line)`.
    sums: Vec<(Pair<R>, Pair<R>)>,
    /// Columns that do not fill a register, of both records.
    rest: (Vec<f64>, Vec<f64>),
    /// One column and the work space of its transform.
    lane: (Vec<C>, Vec<C>),
}

impl<R> Default for Work<R> {
    fn default() -> Self {
        Self {
            one: Vec::new(),
            two: Vec::new(),
            sums: Vec::new(),
            rest: Default::default(),
            lane: Default::default(),
        }
    }
}

impl<R: Register> Plan<R> {
    fn new(m: usize, n: usize, channels: usize, lines: &[usize]) -> Self {
        let m = m.max(1);
        let columns = n / m * channels;
        let roots = Roots::new(n.max(1));
        let lines: Vec<usize> = lines.iter().copied().chain([0]).collect();
        let halves = lines.iter().flat_map(|k| roots.multiples(*k, n / m));
        let halves: Vec<C> = halves.map(|root| root * 0.5).collect();
        let mut turns = Vec::with_capacity(columns.div_ceil(R::LANES) * lines.len());
        for first in (0..columns).step_by(R::LANES) {
            let own = R::LANES.min(columns - first);
            let mut offset = [0; MOST_LANES];
            for (l, offset) in offset.iter_mut().enumerate().take(own) {
                *offset = (first + l) / channels;
            }
            for halves in halves.chunks_exact(n / m) {
                let mut numbers = [C::default(); MOST_LANES];
                for (number, offset) in numbers.iter_mut().zip(&offset[..own]) {
                    *number = halves[*offset];
                }
                turns.push(Pair::split(&numbers, 1));
            }
        }
        Self {
            n,
            m,
            channels,
            columns,
            transform: LaneFft::new(m).map_or_else(
                || Transform::LaneByLane(plan(m, FftDirection::Forward)),
                Transform::Lanes,
            ),
            places: lines.iter().map(|k| (k % m, (m - k % m) % m)).collect(),
            turns,
        }
    }

    #[inline(always)]
    fn pair(&self, a: &[f64], b: &[f64], work: &mut Work<R>, out: &mut Vec<(C, C)>) {
        let (lanes, lines, columns) = (R::LANES, self.places.len(), self.columns);
        if a.len() != self.n * self.channels || b.len() != a.len() || a.is_empty() {
            return;
        }
        // The assignment of channels to lanes repeats after this number of registers.
        let arrangements = (1..=self.channels)
            .find(|r| (r * lanes).is_multiple_of(self.channels))
            .unwrap_or(1);
        let Work {
            one,
            two,
            sums,
            rest,
            lane,
        } = work;
        one.resize(self.m, Pair::zero());
        two.resize(self.m, Pair::zero());
        sums.clear();
        sums.resize(arrangements * lines, (Pair::zero(), Pair::zero()));
        for (register, turns) in self.turns.chunks_exact(lines).enumerate() {
            let first = register * lanes;
            let rows = if first + lanes <= columns {
                TwoReal {
                    a: &a[first..],
                    b: &b[first..],
                    step: columns,
                }
            } else {
                for (from, to) in [(a, &mut rest.0), (b, &mut rest.1)] {
                    to.resize(self.m * lanes, 0.0);
                    let from = from.chunks_exact(columns);
                    for (from, to) in from.zip(to.chunks_exact_mut(lanes)) {
                        to[..columns - first].copy_from_slice(&from[first..]);
                    }
                }
                TwoReal {
                    a: &rest.0,
                    b: &rest.1,
                    step: lanes,
                }
            };
            let found = match &self.transform {
                Transform::Lanes(fft) => fft.transform(&rows, one, two),
                Transform::LaneByLane(fft) => {
                    lane_by_lane(fft.as_ref(), &rows, one, lane);
                    &*one
                }
            };
            let sums = &mut sums[register % arrangements * lines..][..lines];
            for ((sum, turn), (here, mirror)) in sums.iter_mut().zip(turns).zip(&self.places) {
                sum.0 = sum.0.plus_product(*turn, found[*here]);
                sum.1 = sum.1.plus_conjugate_product(*turn, found[*mirror]);
            }
        }
        out.resize(lines * self.channels, (C::default(), C::default()));
        for (arrangement, sums) in sums.chunks_exact(lines).enumerate() {
            let offset = arrangement * lanes % self.channels;
            for (sum, out) in sums.iter().zip(out.chunks_exact_mut(self.channels)) {
                gather(sum, offset, lanes, out);
            }
        }
        for (a, b) in out {
            let difference = *a - *b;
            *a += *b;
            *b = C::new(difference.im, -difference.re);
        }
    }
}

/// Add each lane to its channel; `offset` is the channel of the first lane.
#[inline(always)]
fn gather<R: Register>(sum: &(Pair<R>, Pair<R>), offset: usize, lanes: usize, out: &mut [(C, C)]) {
    let mut numbers = [[C::default(); MOST_LANES]; 2];
    sum.0.join(&mut numbers[0], 1);
    sum.1.join(&mut numbers[1], 1);
    let mut channel = offset;
    for l in 0..lanes {
        out[channel].0 += numbers[0][l];
        out[channel].1 += numbers[1][l];
        channel += 1;
        if channel == out.len() {
            channel = 0;
        }
    }
}

/// Transform columns of any length, one at a time.
fn lane_by_lane<R: Register>(
    fft: &dyn Fft<f64>,
    rows: &impl Rows<R>,
    out: &mut [Pair<R>],
    (lane, work): &mut (Vec<C>, Vec<C>),
) {
    let m = fft.len();
    lane.resize(m * R::LANES, C::default());
    work.resize(fft.get_inplace_scratch_len(), C::default());
    for row in 0..m {
        // Each lane is stored as `m` consecutive numbers.
        rows.at(row).join(&mut lane[row..], m);
    }
    fft.process_with_scratch(lane, work);
    for (row, out) in out.iter_mut().enumerate() {
        *out = Pair::split(&lane[row..], m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINES: [usize; 6] = [1, 2, 7, 15, 29, 74];

    fn signal(channels: usize) -> (Vec<f64>, Vec<f64>) {
        let a = (0..60 * channels).map(|i| (0.37 * i as f64).sin() + 0.2);
        let b = (0..60 * channels).map(|i| (1.3 * i as f64).cos() * i as f64);
        (a.collect(), b.collect())
    }

    fn plain(x: &[f64], channels: usize, channel: usize, k: usize) -> C {
        let n = x.len() / channels;
        let turn = |i: usize| C::from_polar(1.0, -TAU * (k * i % n) as f64 / n as f64);
        (0..n).map(|i| turn(i) * x[i * channels + channel]).sum()
    }

    fn compare(found: &[(C, C)], channels: usize, (a, b): (&[f64], &[f64]), what: &str) {
        assert_eq!(found.len(), (LINES.len() + 1) * channels);
        for (line, k) in LINES.iter().chain(&[0]).enumerate() {
            for channel in 0..channels {
                let got = found[line * channels + channel];
                // 60 terms up to 60 channels, rounded to 1e-16; a and b share a transform.
                let off = (got.0 - plain(a, channels, channel, *k)).norm();
                assert!(off < 1e-11 * channels as f64, "{what}: a off {off}");
                let off = (got.1 - plain(b, channels, channel, *k)).norm();
                assert!(off < 1e-11 * channels as f64, "{what}: b off {off}");
            }
        }
    }

    /// Every divisor gives the plain sum, for every register width.
    #[test]
    fn equals_the_plain_sum_for_every_divisor() {
        for channels in [1, 2, 3, 5, 8, 9] {
            let (a, b) = signal(channels);
            for m in [1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60] {
                let mut out = Vec::new();
                let plan = Plan::<Narrow>::new(m, 60, channels, &LINES);
                plan.pair(&a, &b, &mut Work::default(), &mut out);
                compare(&out, channels, (&a, &b), &format!("narrow {m} {channels}"));
                #[cfg(target_arch = "x86_64")]
                if wide::available() {
                    let plan = Plan::<Wide>::new(m, 60, channels, &LINES);
                    out.clear();
                    plan.pair(&a, &b, &mut Work::default(), &mut out);
                    compare(&out, channels, (&a, &b), &format!("wide {m} {channels}"));
                }
            }
        }
    }

    /// Lengths with large prime factors, and a work space used again.
    #[test]
    fn other_lengths_and_used_work_spaces() {
        let (a, b) = signal(3);
        let mut scratch = LineDftScratch::default();
        for n in [59, 49, 60, 22] {
            let (a, b) = (&a[..3 * n], &b[..3 * n]);
            let found = LineDft::new(n, 3, &LINES).pair(a, b, &mut scratch).to_vec();
            compare(&found, 3, (a, b), &format!("{n} samples"));
            let plan = Plan::<Narrow>::new(n, n, 3, &LINES);
            let mut out = Vec::new();
            plan.pair(a, b, &mut Work::default(), &mut out);
            compare(&out, 3, (a, b), &format!("{n} samples whole"));
        }
        let short = LineDft::new(60, 3, &LINES);
        assert!(short.pair(&a[1..], &b[1..], &mut scratch).is_empty());
    }

    #[test]
    fn few_lines_are_summed_many_are_transformed() {
        assert_eq!(transform_length(20_011, 3, 1, 4), 1); // prime
        assert_eq!(transform_length(20_011, 3, 9_999, 4), 20_011);
        assert!((200..=2000).contains(&transform_length(20_000, 3, 391, 8)));
        assert!(transform_length(20_000, 3, 9_999, 8) >= 2000);
    }
}
