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
