//! Fourier transforms of several columns in lock-step, one column per lane, so that no butterfly
//! mixes lanes. Stockham's ordering, with passes of radix 2, 3, 4 and 5.

use super::pair::Pair;
use axisight_scalar::Register;
use nalgebra::Complex;
use std::f64::consts::TAU;

type C = Complex<f64>;

/// A matrix whose columns are transformed.
pub(super) trait Rows<R> {
    /// The columns of a row.
    fn at(&self, row: usize) -> Pair<R>;
}

impl<R: Register> Rows<R> for &[Pair<R>] {
    #[inline(always)]
    fn at(&self, row: usize) -> Pair<R> {
        self[row]
    }
}

/// Two real matrices with rows of `step` numbers, taken as real and imaginary parts.
pub(super) struct TwoReal<'a> {
    pub(super) a: &'a [f64],
    pub(super) b: &'a [f64],
    pub(super) step: usize,
}

impl<R: Register> Rows<R> for TwoReal<'_> {
    #[inline(always)]
    fn at(&self, row: usize) -> Pair<R> {
        let start = row * self.step;
        Pair {
            re: R::load(&self.a[start..]),
            im: R::load(&self.b[start..]),
        }
    }
}

/// One pass over all rows.
#[derive(Debug, Clone)]
struct Pass {
    radix: usize,
    /// Number of butterflies with the same twiddles.
    stride: usize,
    sets: usize,
    /// Twiddles, `(set, 1..radix)`.
    twiddles: Vec<C>,
}

/// A plan for columns of one length.
#[derive(Debug, Clone)]
pub(super) struct LaneFft {
    passes: Vec<Pass>,
}

/// Radices of a length, or `None` if the length has a prime factor above five.
fn radices(mut length: usize) -> Option<Vec<usize>> {
    let mut found = Vec::new();
    for radix in [5, 4, 3, 2] {
        while length > 1 && length.is_multiple_of(radix) {
            found.push(radix);
            length /= radix;
        }
    }
    (length == 1).then_some(found)
}

/// Approximate number of vector instructions per row for a transform of this length; `None` as for
/// [`LaneFft::new`].
pub(super) fn cost_per_row(length: usize) -> Option<f64> {
    let cost = |radix: usize| match radix {
        2 => 8.0,
        3 => 10.0,
        4 => 11.0,
        _ => 14.0,
    };
    Some(radices(length)?.into_iter().map(cost).sum())
}

impl LaneFft {
    /// A plan for `length` rows, or `None` if the length has a prime factor above five.
    pub(super) fn new(length: usize) -> Option<Self> {
        let mut left = length;
        let passes = radices(length)?.into_iter().map(|radix| {
            let sets = left / radix;
            let angle = -TAU / left as f64;
            let twiddle = |set: usize, j: usize| C::from_polar(1.0, angle * (set * j) as f64);
            let pass = Pass {
                radix,
                stride: length / left,
                sets,
                twiddles: (0..sets)
                    .flat_map(|set| (1..radix).map(move |j| twiddle(set, j)))
                    .collect(),
            };
            left = sets;
            pass
        });
        Some(Self {
            passes: passes.collect(),
        })
    }

    /// `X_k = sum_j x_j exp(-2 pi i j k / length)` of every column. The returned slice is one of
    /// the two work spaces.
    #[inline(always)]
    pub(super) fn transform<'w, R: Register>(
        &self,
        rows: &impl Rows<R>,
        mut to: &'w mut [Pair<R>],
        mut spare: &'w mut [Pair<R>],
    ) -> &'w [Pair<R>] {
        let Some((first, rest)) = self.passes.split_first() else {
            to[0] = rows.at(0);
            return to;
        };
        first.run(rows, to);
        for pass in rest {
            pass.run(&&*to, spare);
            (to, spare) = (spare, to);
        }
        to
    }
}

impl Pass {
    #[inline(always)]
    fn run<R: Register>(&self, rows: &impl Rows<R>, out: &mut [Pair<R>]) {
        match self.radix {
            2 => self.butterflies::<R, 2>(rows, out),
            3 => self.butterflies::<R, 3>(rows, out),
            4 => self.butterflies::<R, 4>(rows, out),
            _ => self.butterflies::<R, 5>(rows, out),
        }
    }

    #[inline(always)]
    fn butterflies<R: Register, const N: usize>(&self, rows: &impl Rows<R>, out: &mut [Pair<R>]) {
        let (sets, stride) = (self.sets, self.stride);
        for set in 0..sets {
            let mut turns = [Pair::zero(); N];
            for j in 1..N {
                turns[j] = Pair::splat(self.twiddles[set * (N - 1) + j - 1]);
            }
            let out = &mut out[set * N * stride..][..N * stride];
            for q in 0..stride {
                let mut x = [Pair::zero(); N];
                for j in 0..N {
                    x[j] = rows.at(q + stride * (set + sets * j));
                }
                butterfly(&mut x);
                out[q] = x[0];
                for j in 1..N {
                    // All twiddles of a single set are one.
                    out[q + stride * j] = if sets == 1 {
                        x[j]
                    } else {
                        x[j].times(turns[j])
                    };
                }
            }
        }
    }
}

/// The transform of `N` rows, in place.
#[inline(always)]
fn butterfly<R: Register, const N: usize>(x: &mut [Pair<R>; N]) {
    match N {
        2 => (x[0], x[1]) = (x[0].plus(x[1]), x[0].minus(x[1])),
        3 => {
            let (sum, difference) = (x[1].plus(x[2]), x[1].minus(x[2]));
            let turned = difference.scaled(R::splat(SIN_3));
            let centre = x[0].plus_scaled(R::splat(-0.5), sum);
            x[0] = x[0].plus(sum);
            x[1] = centre.minus_turned(turned);
            x[2] = centre.plus_turned(turned);
        }
        4 => {
            let (a, b) = (x[0].plus(x[2]), x[0].minus(x[2]));
            let (c, d) = (x[1].plus(x[3]), x[1].minus(x[3]));
            x[0] = a.plus(c);
            x[1] = b.minus_turned(d);
            x[2] = a.minus(c);
            x[3] = b.plus_turned(d);
        }
        _ => {
            let (a, b) = (x[1].plus(x[4]), x[2].plus(x[3]));
            let (c, d) = (x[1].minus(x[4]), x[2].minus(x[3]));
            let (cos, cos2) = (R::splat(COS_5), R::splat(COS2_5));
            let (sin, sin2) = (R::splat(SIN_5), R::splat(SIN2_5));
            let one = x[0].plus_scaled(cos, a).plus_scaled(cos2, b);
            let two = x[0].plus_scaled(cos2, a).plus_scaled(cos, b);
            let first = c.scaled(sin).plus_scaled(sin2, d);
            let second = c.scaled(sin2).plus_scaled(R::splat(-SIN_5), d);
            x[0] = x[0].plus(a).plus(b);
            x[1] = one.minus_turned(first);
            x[2] = two.minus_turned(second);
            x[3] = two.plus_turned(second);
            x[4] = one.plus_turned(first);
        }
    }
}

/// Sine of a third of a turn.
const SIN_3: f64 = 0.866_025_403_784_438_646_76;
/// Cosine and sine of a fifth of a turn, and of two fifths.
const COS_5: f64 = 0.309_016_994_374_947_424_10;
const COS2_5: f64 = -0.809_016_994_374_947_424_10;
const SIN_5: f64 = 0.951_056_516_295_153_572_12;
const SIN2_5: f64 = 0.587_785_252_292_473_129_17;
