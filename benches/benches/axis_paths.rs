//! One axis with derivatives through the plant of the simulator and through the chain of the
//! axis fit: what the second path buys, and that both are one model.
//!
//! A motor and an arm behind an elastic gear with a cubic spring, Coulomb friction with a
//! smoothed sign, one Runge-Kutta step per sample; derivatives along the seven parameters of
//! thesis (9.9). The plant is timed with its derivatives in an array and in one register.
//! Then the time per sample of other chains, which only the fit has.
#![allow(clippy::panic)] // a bench that cannot start says so

use axisight_core::plant::assemble;
use axisight_core::robot::{EffectSetting, Parameter, Place, RobotDescription};
use axisight_core::robot_file::read_robot;
use axisight_core::simulation::{Drive, Method, Run, Status, Stepper, simulate};
use axisight_fit::axis::{AxisModel, AxisProblem, AxisSet, Hold, Layout, Output};
use axisight_scalar::{Dual, DualNumber, Lanes, Scalar};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const SAMPLES: usize = 8000;
const SAMPLE_TIME: f64 = 5e-4;
const RATIO: f64 = 1.0 / 224.3;
/// Width of the smoothed sign [rad/s].
const SMOOTHING: f64 = 2.0;
/// Motor inertia, arm inertia, stiffness, cubic stiffness, damping, viscous and Coulomb friction.
const TRUTH: [f64; 7] = [0.0121, 1130.0, 1.46e6, 3.72e10, 2630.0, 0.013, 0.644];
const NAMES: [&str; 7] = ["J_m", "J_a", "k1", "k3", "d", "F_v", "F_c"];
/// Runs of which the shortest counts.
const REPEATS: usize = 15;

/// The axis without effects; the arm has the inertia one, its scale is the inertia.
const ROBOT: &str = r#"schema = "axisight.robot/1"
name = "two masses"
gravity = [0, 0, 0]
sample_time = 5.0e-4
[[joint]]
name = "turn"
kind = "driven"
origin = [0, 0, 0]
axis = [0, 0, 1]
stiffness = 1.0
damping = 1.0
[joint.link]
mass = 1
com = [0, 0, 0]
inertia = [1, 1, 1, 0, 0, 0]
[joint.drive]
gear_ratio = 1.0
motor_inertia = 1.0
viscous_friction = 1.0
[controller]
kind = "none"
[sensor]
position_noise_std = 0
[operating_point]
joint_angle = [0]
"#;

/// Velocity at the samples, and its derivatives, one vector per parameter.
struct Response {
    velocity: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

fn torque() -> Vec<f64> {
    let tone = |t: f64, f: f64| (std::f64::consts::TAU * f * t).sin();
    let at = |k: usize| k as f64 * SAMPLE_TIME;
    let sum = |t: f64| 3.0 * tone(t, 1.3) + 2.0 * tone(t, 5.7) + 1.5 * tone(t, 13.1);
    (0..SAMPLES).map(|k| sum(at(k))).collect()
}

/// Shortest of several runs [ns per sample], and what the last one gave.
fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut shortest = f64::INFINITY;
    let mut last = None;
    for _ in 0..REPEATS {
        let start = Instant::now();
        last = Some(run());
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    let last = last.unwrap_or_else(|| panic!("no run"));
    (shortest / SAMPLES as f64 * 1e9, last)
}

fn through_plant<S: Scalar>(robot: &RobotDescription, torque: &[f64]) -> Response {
    let value = |i: usize| S::constant(TRUTH[i]).seeded(i);
    let overrides = [
        (Parameter::MotorInertia(0), value(0)),
        (Parameter::InertiaScale(0), value(1)),
        (Parameter::Stiffness(0), value(2)),
        (Parameter::Damping(0), value(4)),
        (Parameter::ViscousFriction(0), value(5)),
    ];
    let effect = |name: &str, parameters: Vec<S>| EffectSetting {
        name: name.to_owned(),
        place: Place::Axis(0),
        parameters,
    };
    let friction = [value(6), S::constant(SMOOTHING), S::zero(), S::zero()].to_vec();
    let settings = [
        effect("nonlinear_stiffness", vec![value(3)]),
        effect("coulomb_friction", friction),
    ];
    let plant =
        assemble::<S>(robot, &overrides, &settings).unwrap_or_else(|error| panic!("{error}"));
    let inputs = [torque];
    let run = Run {
        controller: &robot.controller,
        sample_time: SAMPLE_TIME,
        start: &[&robot.operating_point],
        drive: Drive::Torque(&inputs),
        noise: &[],
        resolution: 0.0,
        disturbances: false,
        accelerometers: false,
        method: Method::RungeKutta4 { substeps: 1 },
        cancel: None,
    };
    let mut out = Response {
        velocity: Vec::with_capacity(SAMPLES),
        columns: vec![Vec::with_capacity(SAMPLES); S::PARTIALS.min(TRUTH.len())],
    };
    let speed = plant.n_angles();
    let status = simulate(&plant, &run, &mut Stepper::new(&plant), &mut |sample| {
        let v = sample.state[speed];
        out.velocity.push(v.lane(0));
        for (i, column) in out.columns.iter_mut().enumerate() {
            column.push(v.partial(i, 0));
        }
    });
    assert_eq!(status, Ok(Status::Completed));
    out
}

/// A chain with everything it can have switched off.
fn chain(masses: usize, smoothing: f64) -> AxisModel {
    AxisModel {
        masses,
        output: Output::Velocity,
        hold: Hold::Zero,
        smoothing,
        ripple_orders: Vec::new(),
        substeps: 1,
    }
}

fn record(torque: &[f64]) -> AxisSet {
    AxisSet {
        number: 0,
        torque: torque.to_vec(),
        output: vec![0.0; torque.len()],
        sample_time: SAMPLE_TIME,
        weight: 1.0,
        block: 100,
    }
}

fn problem<'a>(model: &AxisModel, torque: &[f64], cancel: &'a AtomicBool) -> AxisProblem<'a> {
    AxisProblem::new(
        model.clone(),
        vec![record(torque)],
        Vec::new(),
        false,
        cancel,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

/// Parameters of a chain with the arm's inertia shared by its masses, and the places of the
/// seven that are differentiated.
fn parameters(layout: Layout) -> (Vec<f64>, Vec<usize>) {
    let mut theta = vec![0.0; layout.len(1)];
    let arm = layout.masses - 1;
    theta[layout.inertia(0)] = TRUTH[0];
    for i in 0..arm {
        theta[layout.inertia(i + 1)] = TRUTH[1] / arm as f64;
        theta[layout.linear(i)] = TRUTH[2] * arm as f64;
        theta[layout.damping(i)] = TRUTH[4];
    }
    theta[layout.cubic(0)] = TRUTH[3];
    theta[layout.viscous()] = TRUTH[5];
    theta[layout.coulomb()] = TRUTH[6];
    theta[layout.ratio()] = RATIO;
    theta[layout.stribeck_speed()] = 3.0;
    let free = vec![
        layout.inertia(0),
        layout.inertia(1),
        layout.linear(0),
        layout.cubic(0),
        layout.damping(0),
        layout.viscous(),
        layout.coulomb(),
    ];
    (theta, free)
}

fn through_chain(problem: &AxisProblem<'_>, theta: &[f64], free: &[usize]) -> Response {
    let found = problem
        .linearize(theta, free)
        .unwrap_or_else(|error| panic!("{error}"));
    Response {
        velocity: found.residual,
        columns: found.columns,
    }
}

/// Largest difference over the largest size.
fn deviation(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let difference = a.iter().zip(b).map(|(x, y)| (x - y).abs());
    difference.fold(0.0, f64::max) / size
}

fn compare(torque: &[f64]) {
    let mut robot = read_robot(ROBOT).unwrap_or_else(|error| panic!("{error}"));
    if let Some(drive) = robot.joints[0].drive.as_mut() {
        drive.gear_ratio = RATIO;
    }
    let cancel = AtomicBool::new(false);
    let axis = problem(&chain(2, SMOOTHING), torque, &cancel);
    let (theta, free) = parameters(axis.layout());
    let (own, found) = timed(|| through_chain(&axis, &theta, &free));
    let (array, plant) = timed(|| through_plant::<Dual<f64, 8>>(&robot, torque));
    let (register, _) = timed(|| through_plant::<DualNumber<f64, Lanes<8>>>(&robot, torque));
    println!("two masses, smoothed sign, derivatives along seven parameters [ns per sample]");
    println!("  chain of the fit       {own:8.0}");
    println!(
        "  plant, array           {array:8.0}  {:.1} times",
        array / own
    );
    println!(
        "  plant, register        {register:8.0}  {:.1} times",
        register / own
    );
    let (own, run) = timed(|| axis.trajectory(&theta, 0));
    let (plain, _) = timed(|| through_plant::<f64>(&robot, torque));
    let run = run.unwrap_or_else(|error| panic!("{error}"));
    println!("without derivatives [ns per sample]");
    println!("  chain of the fit       {own:8.0}");
    println!(
        "  plant                  {plain:8.0}  {:.1} times",
        plain / own
    );
    println!("largest deviation between the two, as a share of the largest value");
    let same = deviation(&plant.velocity, &run.output);
    println!("  velocity {same:.1e}");
    for ((name, a), b) in NAMES.iter().zip(&plant.columns).zip(&found.columns) {
        println!("  its derivative along {name:4} {:.1e}", deviation(a, b));
    }
}

fn others(torque: &[f64]) {
    println!("chains of the fit, derivatives along seven parameters [ns per sample]");
    let cancel = AtomicBool::new(false);
    for masses in [2, 3, 4] {
        for (label, smoothing, extended) in [
            ("sign", 0.0, false),
            ("smoothed sign", SMOOTHING, false),
            ("sign, ripple, backlash, Stribeck", 0.0, true),
        ] {
            let mut model = chain(masses, smoothing);
            if extended {
                model.ripple_orders = vec![1.0];
            }
            let axis = problem(&model, torque, &cancel);
            let layout = axis.layout();
            let (mut theta, free) = parameters(layout);
            if extended {
                theta[layout.ripple(0)] = 0.05;
                theta[layout.backlash()] = 1e-4;
                theta[layout.excess()] = 0.2;
            }
            let (time, _) = timed(|| through_chain(&axis, &theta, &free));
            println!("  {masses} masses, {label:34}{time:8.0}");
        }
    }
}

fn main() {
    let torque = torque();
    compare(&torque);
    others(&torque);
}
