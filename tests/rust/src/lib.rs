//! Helpers shared by the integration tests.
// A helper that cannot go on is a failed test.
#![allow(clippy::panic, missing_docs)]

use axisight_core::effects::{Scope, info};
use axisight_core::plant::{Plant, assemble};
use axisight_core::robot::{EffectSetting, Place, RobotDescription};
use axisight_core::robot_file::read_robot;
use axisight_core::simulation::{Drive, Method, Run, Sample, Status, Stepper, simulate};
use axisight_identification::logs::{FitParameter, Target};
use axisight_numerics::Weighting;
use axisight_scalar::Scalar;

/// The preset robot: three driven axes, four elastic joints, 20 states.
pub const PRESET: &str = include_str!("../../../python/axisight/robot/presets/irb6600_like.toml");

/// A horizontal arm under gravity: one compliant axis with an elastic joint behind it.
pub const ARM: &str = r#"schema = "axisight.robot/1"
name = "arm"
gravity = [0, 0, -9.81]
sample_time = 5.0e-4
[[joint]]
name = "shoulder"
kind = "driven"
origin = [0, 0, 0.5]
axis = [0, 1, 0]
stiffness = 4.0e5
damping = 300.0
[joint.link]
mass = 60
com = [0.4, 0.0, 0.1]
inertia = [4, 5, 3, 0, 0, 0]
[joint.drive]
gear_ratio = 0.01
motor_inertia = 0.004
viscous_friction = 0.01
[[joint]]
name = "bend"
kind = "elastic"
origin = [0.8, 0, 0]
axis = [0, 1, 0]
stiffness = 1.0e5
damping = 80.0
[joint.link]
mass = 20
com = [0.3, 0, 0]
inertia = [0.4, 0.5, 0.5, 0, 0, 0]
[controller]
kind = "pi_velocity"
kp = [2.0]
ki = [40.0]
[sensor]
position_noise_std = 1.0e-5
[operating_point]
joint_angle = [0.2]
"#;

/// A rotor with a flywheel on a rigid gear, axis along gravity: `J phi'' = tau`.
pub const ROTOR: &str = r#"schema = "axisight.robot/1"
name = "rotor"
gravity = [0, 0, -9.81]
sample_time = 1.0e-3
[[joint]]
name = "turn"
kind = "driven"
origin = [0, 0, 0]
axis = [0, 0, 1]
[joint.link]
mass = 2
com = [0, 0, 0]
inertia = [1, 1, 3, 0, 0, 0]
[joint.drive]
gear_ratio = 0.5
motor_inertia = 0.25
viscous_friction = 0
[controller]
kind = "none"
[sensor]
position_noise_std = 0
[operating_point]
joint_angle = [0]
"#;

/// Read a description that must be good.
pub fn robot(text: &str) -> RobotDescription {
    read_robot(text).unwrap_or_else(|error| panic!("{error}"))
}

/// The plant of `robot` with `settings` that must be good.
pub fn plant<S: Scalar>(robot: &RobotDescription, settings: &[EffectSetting<S>]) -> Plant<S> {
    assemble(robot, &[], settings).unwrap_or_else(|error| panic!("{error}"))
}

/// One effect at constant parameters; one between axes acts between `axis` and the next.
pub fn effect<S: Scalar>(name: &str, axis: Option<usize>, parameters: &[f64]) -> EffectSetting<S> {
    let between = info(name).is_ok_and(|info| info.scope == Scope::Axes);
    let place = match axis {
        None => Place::Arm,
        Some(axis) if between => Place::Axes(axis, axis + 1),
        Some(axis) => Place::Axis(axis),
    };
    EffectSetting {
        name: name.to_owned(),
        place,
        parameters: parameters.iter().map(|p| S::constant(*p)).collect(),
    }
}

/// A parameter to fit, without bounds.
pub fn free(target: Target, initial: f64, scale: f64) -> FitParameter {
    FitParameter {
        target,
        initial,
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        scale,
        prior: None,
        frozen: false,
        amplitude: None,
        nuisance: false,
        logarithmic: false,
    }
}

/// The same weight at all frequencies.
pub fn flat(weight: f64) -> Weighting {
    Weighting {
        weight: vec![weight],
        ..Weighting::flat()
    }
}

/// Reproducible numbers (splitmix64; Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    /// Uniform between `-size` and `size`.
    pub fn within(&mut self, size: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
        size * (2.0 * unit - 1.0)
    }

    /// `n` numbers between `-size` and `size`.
    pub fn vector(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.within(size)).collect()
    }
}

/// A smooth excitation `(n_samples, n_axes)`: three sines per axis, starting at zero.
pub fn sines(n_samples: usize, n_axes: usize, sample_time: f64, size: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(n_samples * n_axes);
    for k in 0..n_samples {
        let t = k as f64 * sample_time;
        for axis in 0..n_axes {
            let shift = axis as f64;
            let tone = |f: f64, a: f64| a * (std::f64::consts::TAU * f * t).sin();
            let sum =
                tone(2.3 + shift, 1.0) + tone(9.1 + 1.7 * shift, 0.5) + tone(31.0 - shift, 0.3);
            out.push(size * sum);
        }
    }
    out
}

/// Everything a run shows, sample by sample.
#[derive(Debug, Clone)]
pub struct Trace<S> {
    pub command: Vec<S>,
    pub measured: Vec<S>,
    pub states: Vec<Vec<S>>,
    pub status: Status,
    pub evaluations: u64,
}

impl<S: Scalar> Trace<S> {
    /// State at the last sample.
    pub fn last(&self) -> &[S] {
        self.states.last().map_or(&[], |x| x)
    }
}

/// Simulate and keep everything; misuse is a failed test.
pub fn trace<S: Scalar>(
    plant: &Plant<S>,
    robot: &RobotDescription,
    drive: Drive<'_>,
    noise: &[&[f64]],
    method: Method,
) -> Trace<S> {
    let run = Run {
        controller: &robot.controller,
        sample_time: robot.sample_time,
        start: &[&robot.operating_point],
        drive,
        noise,
        resolution: 0.0,
        disturbances: true,
        accelerometers: false,
        method,
        cancel: None,
    };
    let mut out = Trace {
        command: Vec::new(),
        measured: Vec::new(),
        states: Vec::new(),
        status: Status::Completed,
        evaluations: 0,
    };
    let mut stepper = Stepper::new(plant);
    let mut observe = |sample: &Sample<'_, S>| {
        out.command.extend(sample.command);
        out.measured.extend(sample.measured);
        out.states.push(sample.state.to_vec());
    };
    let status = simulate(plant, &run, &mut stepper, &mut observe);
    out.status = status.unwrap_or_else(|error| panic!("{error}"));
    out.evaluations = stepper.effort.evaluations;
    out
}

/// Largest absolute value.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, b| {
        if b.is_nan() {
            f64::NAN
        } else {
            f64::max(a, b.abs())
        }
    })
}

/// Largest difference of two series, over the largest value of the second.
pub fn relative(got: &[f64], want: &[f64]) -> f64 {
    assert_eq!(got.len(), want.len());
    let difference: Vec<f64> = got.iter().zip(want).map(|(a, b)| a - b).collect();
    if difference.iter().any(|d| d.is_nan()) {
        return f64::NAN;
    }
    largest(&difference) / largest(want)
}
