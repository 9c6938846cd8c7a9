//! Helpers shared by the benches.
#![allow(clippy::panic)] // a bench that cannot start says so

pub mod linear_loop;

use axisight_core::robot::{EffectSetting, Place, RobotDescription};
use axisight_core::robot_file::read_robot;

/// The preset robot: three driven axes, four elastic joints, 20 states.
pub fn preset() -> RobotDescription {
    let text = include_str!("../../python/axisight/robot/presets/irb6600_like.toml");
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

/// Torque and resolver ripple of every axis (thesis, Table 8.1).
pub fn table_8_1(n_axes: usize) -> Vec<EffectSetting<f64>> {
    // An effect takes five waves: an order of zero switches one off.
    const NONE: (f64, f64, f64) = (0.0, 0.0, 0.0);
    let torque = [
        (3.0, 0.06, 1.45),
        (36.0, 0.11, 0.90),
        (72.0, 0.08, 0.20),
        NONE,
        NONE,
        (18.0, 0.04, 0.0),
    ];
    let resolver = [
        (2.0, 0.4e-3, -1.84),
        (10.0, 0.2e-3, 0.81),
        (12.0, 0.22e-3, 2.94),
        (48.0, 0.18e-3, 2.94),
        NONE,
    ];
    // `a sin(n phi + p)` as order, cosine and sine amplitude.
    let terms = |table: &[(f64, f64, f64)]| -> Vec<f64> {
        let triples = table
            .iter()
            .map(|(n, a, p): &(f64, f64, f64)| [*n, a * p.sin(), a * p.cos()]);
        triples.flatten().collect()
    };
    let setting = |axis, name: &str, parameters| EffectSetting {
        name: name.to_owned(),
        place: Place::Axis(axis),
        parameters,
    };
    let both = |axis| {
        [
            setting(axis, "torque_ripple", terms(&torque)),
            setting(axis, "resolver_ripple", terms(&resolver)),
        ]
    };
    (0..n_axes).flat_map(both).collect()
}
