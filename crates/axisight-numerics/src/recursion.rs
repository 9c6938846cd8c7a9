//! Linear difference equations, also known as recursive filters.

/// Filters `columns` signals side by side, `signals` in the order `(sample, signal)`, in place.
///
/// `below[0] y[t] + below[1] y[t - 1] + ... = above[0] x[t] + above[1] x[t - 1] + ...`, with zeros
/// before the first sample. `below[0]` must not be zero.
///
/// The transposed direct form II keeps one state per lag and signal; a step costs a multiplication
/// and an addition for each factor.
pub fn filter(above: &[f64], below: &[f64], signals: &mut [f64], columns: usize) {
    let lags = above.len().max(below.len()).saturating_sub(1);
    let factor = |of: &[f64], lag: usize| of.get(lag).map_or(0.0, |x| x / below[0]);
    let above: Vec<f64> = (0..=lags).map(|lag| factor(above, lag)).collect();
    let below: Vec<f64> = (0..=lags).map(|lag| factor(below, lag)).collect();
    // One row more than lags, which stays zero.
    let mut states = vec![0.0; (lags + 1) * columns];
    for sample in signals.chunks_exact_mut(columns) {
        for (signal, value) in sample.iter_mut().enumerate() {
            let x = *value;
            let y = above[0] * x + states[signal];
            for lag in 1..=lags {
                let later = states[lag * columns + signal];
                states[(lag - 1) * columns + signal] = above[lag] * x - below[lag] * y + later;
            }
            *value = y;
        }
    }
}

/// States of a linear model at every sample: `x(t + 1) = A x(t) + v(t)`.
///
/// `a` is row-major `(n, n)`, `drive` is v in the order `(sample, state, column)`, and `start` is
/// x(0) in the order `(state, column)`; every column is a separate motion. Returns x(0) to
/// x(samples) in the order of `drive`. A sample costs n² multiplications and additions a column.
#[must_use]
pub fn states(a: &[f64], drive: &[f64], start: &[f64], n: usize) -> Vec<f64> {
    let size = start.len();
    let mut out = Vec::with_capacity(drive.len() + size);
    out.extend_from_slice(start);
    out.extend_from_slice(drive);
    if n == 0 || size == 0 {
        return out;
    }
    let columns = size / n;
    let (mut before, mut rest) = out.split_at_mut(size);
    while rest.len() >= size {
        let (next, later) = rest.split_at_mut(size);
        for (row, factors) in next.chunks_exact_mut(columns).zip(a.chunks_exact(n)) {
            for (factor, state) in factors.iter().zip(before.chunks_exact(columns)) {
                for (x, of) in row.iter_mut().zip(state) {
                    *x += factor * of;
                }
            }
        }
        (before, rest) = (next, later);
    }
    out
}
