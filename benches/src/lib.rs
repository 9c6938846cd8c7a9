//! Helpers shared by the benches.
#![allow(clippy::panic)] // a bench that cannot start says so

use axisight_core::robot::{RobotDescription, read_robot};

/// The preset robot: three driven axes, four elastic joints, 20 states.
pub fn preset() -> RobotDescription {
    let text = include_str!("../../python/axisight/presets/irb6600_like.toml");
    read_robot(text).unwrap_or_else(|error| panic!("{error}"))
}

/// A smooth velocity reference `(n_samples, n_axes)` [rad/s].
pub fn reference(n_samples: usize, n_axes: usize, sample_time: f64) -> Vec<f64> {
    let tone = |t: f64, f: f64| (std::f64::consts::TAU * f * t).sin();
    (0..n_samples * n_axes)
        .map(|i| {
            let (t, axis) = ((i / n_axes) as f64 * sample_time, (i % n_axes) as f64);
            tone(t, 2.3 + axis) + 0.5 * tone(t, 9.1 + 1.7 * axis) + 0.3 * tone(t, 31.0 - axis)
        })
        .collect()
}
