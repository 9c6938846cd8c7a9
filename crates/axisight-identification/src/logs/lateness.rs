//! Inverse of delays and lags in the torque path: the commanded torque for an applied torque.
//!
//! The inverse of a delay takes later samples. The inverse of a lag of first or second order is a
//! sum of derivatives. Both act on series of samples, with derivatives along seeds.

use axisight_core::effects::Kernel;
use axisight_scalar::Scalar;
use std::sync::Arc;

/// Convert applied to commanded torque of one axis; `series` holds the value, then one series per
/// seed.
pub(super) fn commanded<S: Scalar>(
    kernels: &[Arc<dyn Kernel<S>>],
    step: f64,
    mut series: Vec<Vec<f64>>,
) -> Vec<Vec<f64>> {
    for kernel in kernels.iter().rev() {
        if let Some(delay) = kernel.delay() {
            series = earlier(&series, delay / S::constant(step));
        }
        if let Some(lag) = kernel.lag() {
            series = unfiltered(&series, lag / S::constant(step), S::zero());
        }
        if let Some((time, damping)) = kernel.current_loop() {
            let samples = time / S::constant(step);
            let (first, second) = (samples * damping * 2.0, samples * samples);
            series = unfiltered(&series, first, second);
        }
    }
    series
}

/// Series shifted to earlier times by `samples`. The last value is held.
fn earlier<S: Scalar>(series: &[Vec<f64>], samples: S) -> Vec<Vec<f64>> {
    let shifted: Vec<Vec<f64>> = series.iter().map(|x| between(x, samples.lane(0))).collect();
    with_partials(&shifted, &[(samples, slope(&shifted[0]))])
}

/// Series plus `first` times their first and `second` times their second derivatives over samples.
fn unfiltered<S: Scalar>(series: &[Vec<f64>], first: S, second: S) -> Vec<Vec<f64>> {
    let mut out = Vec::with_capacity(series.len());
    for x in series {
        let rate = slope(x);
        let curve = slope(&rate);
        let terms = x.iter().zip(rate.iter().zip(&curve));
        let sum = terms.map(|(x, (r, c))| x + first.lane(0) * r + second.lane(0) * c);
        out.push(sum.collect());
    }
    let rate = slope(&series[0]);
    let curve = slope(&rate);
    with_partials(&out, &[(first, rate), (second, curve)])
}

/// Add the derivatives of the factors in `terms` to the derivative series.
fn with_partials<S: Scalar>(series: &[Vec<f64>], terms: &[(S, Vec<f64>)]) -> Vec<Vec<f64>> {
    let mut out = series.to_vec();
    for (seed, target) in out[1..].iter_mut().enumerate() {
        for (factor, by) in terms {
            let change = factor.partial(seed, 0);
            if change != 0.0 {
                target
                    .iter_mut()
                    .zip(by)
                    .for_each(|(y, x)| *y += change * x);
            }
        }
    }
    out
}

/// A series shifted to earlier times by `samples`, with cubics through its samples (Catmull and
/// Rom, 1974).
fn between(x: &[f64], samples: f64) -> Vec<f64> {
    let n = x.len();
    let part = samples - samples.floor();
    let skipped = (0..n).take_while(|k| (*k as f64) < samples.floor()).count();
    // Before the series the first value is held, after it the last.
    let at = |k: usize| x[k.saturating_sub(1).min(n - 1)];
    (0..n)
        .map(|k| {
            let [before, from, to, after] = [0, 1, 2, 3].map(|i| at(k + skipped + i));
            let (begin, end) = (0.5 * (to - before), 0.5 * (after - from));
            let rise = to - from;
            let cubic = begin + end - 2.0 * rise;
            let square = 3.0 * rise - 2.0 * begin - end;
            ((cubic * part + square) * part + begin) * part + from
        })
        .collect()
}

/// Derivative over samples: central differences, one-sided at the ends.
fn slope(x: &[f64]) -> Vec<f64> {
    let last = x.len() - 1;
    (0..=last)
        .map(|k| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            (x[after] - x[before]) / (after - before).max(1) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(shift: f64) -> Vec<f64> {
        (0..200)
            .map(|k| (0.05 * (f64::from(k) + shift)).sin())
            .collect()
    }

    fn off(a: &[f64], b: &[f64]) -> f64 {
        let inner = 10..a.len() - 10;
        a[inner.clone()]
            .iter()
            .zip(&b[inner])
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn what_is_asked_for_late_was_asked_for_earlier() {
        // The error of a cubic through samples of a sine is at most w^4 / 128.
        for late in [0.0, 0.3, 1.0, 2.75] {
            let found = earlier::<f64>(&[wave(0.0)], late);
            assert!(off(&found[0], &wave(late)) < 0.05_f64.powi(3) / 20.0);
        }
    }

    #[test]
    fn a_lag_is_undone_by_its_derivatives() {
        // For sin: plus first w cos, minus second w^2 sin. Central differences have an error of a
        // sixth of w^2.
        let (first, second) = (3.0, 4.0);
        let found = unfiltered::<f64>(&[wave(0.0)], first, second);
        let cosine: Vec<f64> = (0..200).map(|k| (0.05 * f64::from(k)).cos()).collect();
        let exact: Vec<f64> = wave(0.0)
            .iter()
            .zip(&cosine)
            .map(|(s, c)| s + 0.05 * first * c - 0.0025 * second * s)
            .collect();
        assert!(off(&found[0], &exact) < 0.05_f64.powi(3) * (first / 6.0 + second));
    }
}
