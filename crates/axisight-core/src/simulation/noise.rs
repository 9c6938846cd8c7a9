//! Measurement noise as a function of (seed, run, axis).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// White Gaussian position noise of standard deviation `std` [rad], row-major
/// `(n_samples, n_axes)`.
///
/// Each axis has its own stream, so its noise does not depend on the number of axes. All runs below
/// 2^48 have different noise.
pub fn measurement_noise(
    seed: u64,
    run: u64,
    n_samples: usize,
    n_axes: usize,
    std: f64,
) -> Vec<f64> {
    let mut out = vec![0.0; n_samples * n_axes];
    for axis in 0..n_axes {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // The stream number separates runs and axes; no robot has 2^16 axes.
        rng.set_stream((run << 16) | axis as u64);
        for sample in 0..n_samples {
            let e: f64 = StandardNormal.sample(&mut rng);
            out[sample * n_axes + axis] = std * e;
        }
    }
    out
}

/// Gaussian position noise of standard deviation `std` [rad] with a first-order spectrum, row-major
/// `(n_samples, n_axes)`.
///
/// The spectrum is flat up to about `cutoff_hz`. The noise is that of [`measurement_noise`] through
/// a discrete low-pass, stationary from the first sample.
pub fn coloured_noise(
    seed: u64,
    run: u64,
    n_samples: usize,
    n_axes: usize,
    std: f64,
    cutoff_hz: f64,
    sample_time: f64,
) -> Vec<f64> {
    let mut out = measurement_noise(seed, run, n_samples, n_axes, std);
    let keep = (-std::f64::consts::TAU * cutoff_hz * sample_time).exp();
    // With these weights, keep * old + fresh * new has the same variance as old and new.
    let fresh = (1.0 - keep * keep).sqrt();
    for k in n_axes..out.len() {
        out[k] = keep * out[k - n_axes] + fresh * out[k];
    }
    out
}
