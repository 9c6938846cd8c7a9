//! Inputs of a run, of which each lane has an array.

use axisight_scalar::Scalar;

/// Entry `(k, axis)` of each lane's array; zero beyond its end, or if there are no arrays.
#[inline(always)]
pub fn lane_value<S: Scalar>(arrays: &[&[f64]], k: usize, axis: usize, n_axes: usize) -> S {
    S::from_lanes(|lane| {
        let array = arrays.get(lane).or_else(|| arrays.last());
        array
            .and_then(|a| a.get(k * n_axes + axis))
            .copied()
            .unwrap_or(0.0)
    })
}

/// Entry of each lane's array at sample `(1 + drift) k`, linearly interpolated. Outside of the
/// array it is the first or last entry.
pub(super) fn value_at<S: Scalar>(
    arrays: &[&[f64]],
    k: usize,
    drift: S,
    axis: usize,
    n_axes: usize,
) -> S {
    let late = drift * k as f64;
    let whole = S::from_lanes(|lane| late.lane(lane).floor());
    let at = |further: f64| {
        S::from_lanes(|lane| {
            let Some(array) = arrays.get(lane).or_else(|| arrays.last()) else {
                return 0.0;
            };
            let last = (array.len() / n_axes).saturating_sub(1);
            // The cast is safe: drifts are bounded, and runs have far fewer samples than a float
            // has digits.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let sample = (k as f64 + whole.lane(lane) + further).max(0.0) as usize;
            let entry = array.get(sample.min(last) * n_axes + axis);
            entry.copied().unwrap_or(0.0)
        })
    };
    let before = at(0.0);
    (late - whole).fma(at(1.0) - before, before)
}
