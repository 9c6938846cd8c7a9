//! Inversion and division of many small complex matrices.
//!
//! Several matrices are computed in lock-step, one per lane of the widest registers that the
//! processor has. The result has the same bits at any width.
//!
//! The method is elimination with pivoting, see `lockstep_lu`. 3x3 inverses use cofactors where
//! these are as accurate, see `adjugate`.

use super::SmallSolver;
use super::adjugate;
use super::ahead::Ahead;
use super::lockstep_lu::Factors;
#[cfg(target_arch = "x86_64")]
use axisight_scalar::wide::{self, Wide};
use axisight_scalar::{Lanes, MOST_LANES, Register};
use nalgebra::Complex;
use rayon::prelude::*;

type C = Complex<f64>;

/// Registers that every supported processor has.
type Narrow = Lanes<4>;

/// Matrices of one parallel task: enough to hide the hand-over, few enough for the cache.
const TASK: usize = 512;

/// Largest size that has a kernel of its own.
const LARGEST: usize = 8;

/// The threads that compute a batch. The result does not depend on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Threads {
    /// The calling thread.
    This,
    /// The threads of the current pool.
    Pool,
}

/// Error: an argument has the wrong number of entries.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: expected {expected} numbers, got {got}")]
pub struct BatchShapeError {
    /// Name of the argument.
    pub field: &'static str,
    /// Expected number of entries.
    pub expected: usize,
    /// Actual number of entries.
    pub got: usize,
}

fn check(field: &'static str, got: usize, expected: usize) -> Result<(), BatchShapeError> {
    if got == expected {
        return Ok(());
    }
    Err(BatchShapeError {
        field,
        expected,
        got,
    })
}

/// Write the inverses of `count` row-major matrices of `n` rows into `out`.
///
/// Returns one flag a matrix: true if the matrix is singular to working precision or not finite.
/// The inverse of a flagged matrix is NaN.
///
/// A matrix is singular if a pivot is at most `4 n 2^-52` of the largest entry of its column, with
/// rows scaled to about one. The units of rows and columns therefore do not matter.
///
/// # Errors
/// [`BatchShapeError`] if `matrices` or `out` do not hold `count n n` numbers.
pub fn invert_batch(
    matrices: &[C],
    n: usize,
    count: usize,
    out: &mut [C],
    threads: Threads,
) -> Result<Vec<bool>, BatchShapeError> {
    check("matrices", matrices.len(), count * n * n)?;
    check("out", out.len(), count * n * n)?;
    let mut singular = vec![false; count];
    if n == 0 {
        return Ok(singular);
    }
    if threads == Threads::This {
        invert_task(n, matrices, out, &mut singular);
        return Ok(singular);
    }
    let task = TASK * n * n;
    out.par_chunks_mut(task)
        .zip(matrices.par_chunks(task))
        .zip(singular.par_chunks_mut(TASK))
        .for_each(|((out, a), singular)| invert_task(n, a, out, singular));
    Ok(singular)
}

fn invert_task(n: usize, a: &[C], out: &mut [C], singular: &mut [bool]) {
    match n {
        1 => invert_some::<1>(a, out, singular),
        2 => invert_some::<2>(a, out, singular),
        3 => invert_some::<3>(a, out, singular),
        4 => invert_some::<4>(a, out, singular),
        5 => invert_some::<5>(a, out, singular),
        6 => invert_some::<6>(a, out, singular),
        7 => invert_some::<7>(a, out, singular),
        LARGEST => invert_some::<LARGEST>(a, out, singular),
        _ => invert_large(n, a, out, singular),
    }
}

/// Write `Y U^-1` for `count` pairs into `out`, with `y` of shape `(count, rows, n)` and `u` of
/// shape `(count, n, n)`.
///
/// Returns flags as [`invert_batch`] does.
///
/// # Errors
/// [`BatchShapeError`] if `y`, `u` or `out` do not have these shapes.
pub fn right_divide_batch(
    y: &[C],
    u: &[C],
    (rows, n): (usize, usize),
    count: usize,
    out: &mut [C],
    threads: Threads,
) -> Result<Vec<bool>, BatchShapeError> {
    check("u", u.len(), count * n * n)?;
    check("y", y.len(), count * rows * n)?;
    check("out", out.len(), count * rows * n)?;
    let mut singular = vec![false; count];
    if n == 0 || rows == 0 {
        return Ok(singular);
    }
    if threads == Threads::This {
        divide_task(n, y, u, rows, out, &mut singular);
        return Ok(singular);
    }
    out.par_chunks_mut(TASK * rows * n)
        .zip(y.par_chunks(TASK * rows * n))
        .zip(u.par_chunks(TASK * n * n))
        .zip(singular.par_chunks_mut(TASK))
        .for_each(|(((out, y), u), singular)| divide_task(n, y, u, rows, out, singular));
    Ok(singular)
}

fn divide_task(n: usize, y: &[C], u: &[C], rows: usize, out: &mut [C], singular: &mut [bool]) {
    match n {
        1 => divide_some::<1>(y, u, rows, out, singular),
        2 => divide_some::<2>(y, u, rows, out, singular),
        3 => divide_some::<3>(y, u, rows, out, singular),
        4 => divide_some::<4>(y, u, rows, out, singular),
        5 => divide_some::<5>(y, u, rows, out, singular),
        6 => divide_some::<6>(y, u, rows, out, singular),
        7 => divide_some::<7>(y, u, rows, out, singular),
        LARGEST => divide_some::<LARGEST>(y, u, rows, out, singular),
        _ => divide_large(n, y, u, rows, out, singular),
    }
}

const NAN: C = C::new(f64::NAN, f64::NAN);

fn invert_large(n: usize, a: &[C], out: &mut [C], singular: &mut [bool]) {
    let mut solver = SmallSolver::new(n);
    let matrices = a.chunks_exact(n * n).zip(out.chunks_exact_mut(n * n));
    for ((a, out), singular) in matrices.zip(singular) {
        *singular = !solver.invert(a, out);
        if *singular {
            out.fill(NAN);
        }
    }
}

fn divide_large(n: usize, y: &[C], u: &[C], rows: usize, out: &mut [C], singular: &mut [bool]) {
    let mut solver = SmallSolver::new(n);
    let (mut inverse, nothing) = (vec![C::default(); n * n], C::default());
    let matrices = u.chunks_exact(n * n).zip(y.chunks_exact(rows * n));
    let results = out.chunks_exact_mut(rows * n).zip(singular);
    for ((u, y), (out, singular)) in matrices.zip(results) {
        *singular = !solver.invert(u, &mut inverse);
        if *singular {
            out.fill(NAN);
            continue;
        }
        for (i, out) in out.iter_mut().enumerate() {
            let (row, column) = (i / n, i % n);
            *out = (0..n).fold(nothing, |sum, k| {
                sum + y[row * n + k] * inverse[k * n + column]
            });
        }
    }
}

/// Two entries to one kernel: one compiled for wide registers, one for narrow registers.
macro_rules! widest {
    ($name:ident, $wide:ident, $kernel:ident, ($($argument:ident: $type:ty),+)) => {
        fn $name<const N: usize>($($argument: $type),+) {
            #[cfg(target_arch = "x86_64")]
            if wide::available() {
                // SAFETY: `available` has checked that the processor has the instructions.
                #[allow(unsafe_code)]
                return unsafe { $wide::<N>($($argument),+) };
            }
            $kernel::<Narrow, N>($($argument),+);
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx512dq")]
        fn $wide<const N: usize>($($argument: $type),+) {
            $kernel::<Wide, N>($($argument),+);
        }
    };
}
widest!(
    invert_some,
    invert_wide,
    invert_lanes,
    (a: &[C], out: &mut [C], singular: &mut [bool])
);
widest!(
    divide_some,
    divide_wide,
    divide_lanes,
    (y: &[C], u: &[C], rows: usize, out: &mut [C], singular: &mut [bool])
);

#[inline(always)]
fn invert_lanes<R: Register, const N: usize>(a: &[C], out: &mut [C], singular: &mut [bool]) {
    let size = N * N;
    let group = R::LANES * size;
    let mut factors = Factors::<R, N>::new();
    let mut later = Vec::new();
    let mut left = (a, &mut *out);
    for g in 0..singular.len() / R::LANES {
        let (a, from) = left.0.split_at(group);
        let (out, to) = left.1.split_at_mut(group);
        let first = g * R::LANES;
        if N == 3 {
            // A group takes so little time that the prefetch must be two groups ahead.
            let skipped = (2 * group).min(from.len());
            let next = skipped + group.min(from.len() - skipped);
            Ahead::new(&from[skipped..next], &to[skipped..next]).ask(group);
            adjugate::leave(adjugate::invert::<R>(a, out), first, &mut later);
        } else {
            let next = group.min(from.len());
            let bad = factors.invert(a, out, Ahead::new(&from[..next], &to[..next]));
            finish(bad, size, out, &mut singular[first..]);
        }
        left = (from, to);
    }
    let (mut from, mut to) = (vec![C::default(); group], vec![C::default(); group]);
    let whole = singular.len() / R::LANES * R::LANES;
    if N == 3 && whole < singular.len() {
        // The rest takes the same path as a whole group, so that neighbours never change a result.
        let tail = &a[whole * size..];
        from[..tail.len()].copy_from_slice(tail);
        let good = adjugate::invert::<R>(&from, &mut to);
        out[whole * size..].copy_from_slice(&to[..tail.len()]);
        adjugate::leave(good, whole, &mut later);
        later.retain(|place| *place < singular.len());
    } else {
        later.extend(whole..singular.len());
    }
    let mut flags = [false; MOST_LANES];
    for places in later.chunks(R::LANES) {
        for (from, place) in from.chunks_exact_mut(size).zip(places) {
            from.copy_from_slice(&a[place * size..][..size]);
        }
        let bad = factors.invert(&from, &mut to, Ahead::nothing());
        finish(bad, size, &mut to, &mut flags);
        for ((to, flag), place) in to.chunks_exact(size).zip(flags).zip(places) {
            out[place * size..][..size].copy_from_slice(to);
            singular[*place] = flag;
        }
    }
}

#[inline(always)]
fn divide_lanes<R: Register, const N: usize>(
    y: &[C],
    u: &[C],
    rows: usize,
    out: &mut [C],
    singular: &mut [bool],
) {
    let (size, wide) = (N * N, rows * N);
    let (lanes, mut factors) = (R::LANES, Factors::<R, N>::new());
    let groups = u.chunks(lanes * size).zip(y.chunks(lanes * wide));
    let results = out.chunks_mut(lanes * wide).zip(singular.chunks_mut(lanes));
    for ((u, y), (out, singular)) in groups.zip(results) {
        if singular.len() == lanes {
            let bad = factors.right_divide(y, u, rows, out);
            finish(bad, wide, out, singular);
            continue;
        }
        let filled = |x: &[C], size: usize| {
            let mut all = x.to_vec();
            all.resize(lanes * size, C::default());
            all
        };
        let (u, y, mut all) = (filled(u, size), filled(y, wide), filled(out, wide));
        let bad = factors.right_divide(&y, &u, rows, &mut all);
        out.copy_from_slice(&all[..out.len()]);
        finish(bad, wide, out, singular);
    }
}

/// Flag the lanes above zero in `bad` and set their results to NaN.
#[inline(always)]
fn finish<R: Register>(bad: R, size: usize, out: &mut [C], singular: &mut [bool]) {
    let mut lanes = [0.0; MOST_LANES];
    bad.store(&mut lanes);
    let flags = singular.iter_mut().zip(&lanes[..R::LANES]);
    for ((singular, bad), out) in flags.zip(out.chunks_exact_mut(size)) {
        *singular = *bad > 0.0;
        if *singular {
            out.fill(NAN);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reproducible pseudo-random matrices, some of them singular or badly scaled.
    fn matrices(n: usize, count: usize) -> Vec<C> {
        let entry = |i: usize| C::new((i as f64 * 0.7).sin(), (i as f64 * 1.3).cos());
        let mut all: Vec<C> = (0..count * n * n).map(|i| entry(i * i)).collect();
        all[..n * n].fill(C::default());
        all[2 * n * n..][..n].fill(C::new(1e-9, 0.0));
        all
    }

    fn bits(x: &[C]) -> Vec<(u64, u64)> {
        // All NaNs count as equal, whatever their bits.
        let bits = |x: f64| if x.is_nan() { 0 } else { x.to_bits() };
        x.iter().map(|c| (bits(c.re), bits(c.im))).collect()
    }

    fn same_bits<const N: usize>() {
        for count in [3, 8, 21] {
            let a = matrices(N, count);
            let (mut one, mut other) = (a.clone(), a.clone());
            let (mut flags, mut others) = (vec![false; count], vec![false; count]);
            invert_some::<N>(&a, &mut one, &mut flags);
            invert_lanes::<Narrow, N>(&a, &mut other, &mut others);
            assert_eq!(flags, others);
            assert_eq!(bits(&one), bits(&other), "{count} of {N}");
            divide_some::<N>(&one, &a, N, &mut other, &mut flags);
            let mut narrow = one.clone();
            divide_lanes::<Narrow, N>(&one, &a, N, &mut narrow, &mut others);
            assert_eq!(flags, others);
            assert_eq!(bits(&narrow), bits(&other), "{count} of {N}");
        }
    }

    #[test]
    fn the_width_of_the_registers_changes_no_bit() {
        same_bits::<2>();
        same_bits::<3>();
        same_bits::<6>();
    }

    /// The neighbours of a matrix in the batch do not change its inverse.
    #[test]
    fn neighbours_do_not_matter() {
        let a = matrices(3, 24);
        let mut all = a.clone();
        invert_batch(&a, 3, 24, &mut all, Threads::This).ok();
        for (a, expected) in a.chunks_exact(9).zip(all.chunks_exact(9)) {
            // With eight copies, every matrix takes the path of a whole group.
            let eight = a.repeat(8);
            let mut out = eight.clone();
            invert_batch(&eight, 3, 8, &mut out, Threads::This).ok();
            assert_eq!(bits(&out[..9]), bits(expected));
        }
    }
}
