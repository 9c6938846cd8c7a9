//! Responses of the linearized robot by poles and by lines, and their derivatives.

use axisight_core::plant::{linearize, zoh_frequency_response};
use axisight_core::robot::{Parameter, RobotDescription};
use axisight_identification::frequency::{Columns, Hold, Linearizer, evaluate};
use axisight_tests::{PRESET, robot};
use nalgebra::{Complex, DMatrix};
use std::f64::consts::TAU;

type C = Complex<f64>;

const POSE: [f64; 3] = [0.3, -0.4, 0.5];

fn frequencies() -> Vec<f64> {
    (0..40).map(|k| 0.5 * 1.18_f64.powi(k)).collect()
}

fn values(robot: &RobotDescription) -> Vec<(Parameter, f64)> {
    let all = Parameter::all(robot).into_iter();
    all.map(|p| (p, p.nominal(robot))).collect()
}

fn columns(
    robot: &RobotDescription,
    values: &[(Parameter, f64)],
    seeds: &[usize],
    frequency_hz: &[f64],
    hold: Hold,
) -> Columns {
    let linearizer = Linearizer::new(robot, &[], values, seeds).expect("linear");
    let (model, derivatives) = linearizer.at(&POSE).expect("settles");
    evaluate(&model, &derivatives, frequency_hz, hold).expect("positive inertia")
}

fn at(columns: &Columns, p: usize, line: usize) -> DMatrix<C> {
    DMatrix::from_fn(3, 3, |i, j| {
        let (re, im) = columns.parts(p, i, j);
        C::new(re[line], im[line])
    })
}

/// The robot as it is, and variations whose poles coincide: without friction axis 1 has two
/// poles at zero in one Jordan block, without gravity all axes have a pole at zero.
fn variations() -> Vec<(&'static str, RobotDescription)> {
    let nominal = robot(PRESET);
    let mut free = nominal.clone();
    for joint in &mut free.joints {
        if let Some(drive) = &mut joint.drive {
            drive.viscous_friction = 0.0;
        }
    }
    let mut weightless = nominal.clone();
    weightless.gravity = [0.0; 3];
    vec![
        ("nominal", nominal),
        ("frictionless", free),
        ("weightless", weightless),
    ]
}

/// The core linearizes the equations of motion with duals and solves every line; both round
/// to about 1e-16 times the condition of `z I - A_d`, 1e5 at half a hertz.
#[test]
fn sampled_response_is_that_of_the_core() {
    for (name, robot) in variations() {
        let f = frequencies();
        let found = columns(&robot, &[], &[], &f, Hold::ZeroOrder(robot.sample_time));
        let linear = linearize(&robot, &[], &POSE).expect("linear");
        for (line, wanted) in zoh_frequency_response(&linear, robot.sample_time, &f)
            .into_iter()
            .enumerate()
        {
            let wanted = wanted.expect("no pole");
            let error = (at(&found, 0, line) - &wanted).norm() / wanted.norm();
            assert!(error < 1e-10, "{name}: {error:.1e} at {} Hz", f[line]);
        }
    }
}

#[test]
fn continuous_response_is_that_of_the_state_space_model() {
    for (name, robot) in variations() {
        let f = frequencies();
        let found = columns(&robot, &[], &[], &f, Hold::Continuous);
        let linear = linearize(&robot, &[], &POSE).expect("linear");
        let lift = |m: &DMatrix<f64>| m.map(|x| C::new(x, 0.0));
        for (line, f) in f.iter().enumerate() {
            let s = DMatrix::from_diagonal_element(20, 20, C::new(0.0, TAU * f));
            let x = (s - lift(&linear.a))
                .lu()
                .solve(&lift(&linear.b))
                .expect("no pole");
            let wanted = lift(&linear.c) * x;
            let error = (at(&found, 0, line) - &wanted).norm() / wanted.norm();
            assert!(error < 1e-10, "{name}: {error:.1e} at {f} Hz");
        }
    }
}

/// Central differences of fourth order with relative steps h of 1e-3: truncation about h^4;
/// rounding 3/2 of that of a response over h. Responses are a sum over poles, some of which
/// nearly coincide without gravity: they round to some 1e-10, the differences to some 1e-7
/// (smaller steps give more, in proportion). A step of elastic stiffness or mass moves the
/// equilibrium.
#[test]
fn derivatives_agree_with_finite_differences() {
    for (name, robot) in variations() {
        let values = values(&robot);
        let f: Vec<f64> = frequencies().into_iter().step_by(3).collect();
        let seeds: Vec<usize> = (0..values.len()).collect();
        for hold in [Hold::ZeroOrder(robot.sample_time), Hold::Continuous] {
            let found = columns(&robot, &values, &seeds, &f, hold);
            for i in 0..values.len() {
                let size = values[i].1.abs().max(0.01);
                let h = 1e-3 * size;
                let moved = |steps: f64| {
                    let mut moved = values.clone();
                    moved[i].1 += steps * h;
                    columns(&robot, &moved, &[], &f, hold)
                };
                let around = [-2.0, -1.0, 1.0, 2.0].map(moved);
                for line in 0..f.len() {
                    let g = around.each_ref().map(|c| at(c, 0, line));
                    let slope = ((&g[2] - &g[1]) * C::new(8.0, 0.0) - (&g[3] - &g[0]))
                        / C::new(12.0 * h, 0.0);
                    let exact = at(&found, i + 1, line);
                    let error = (exact - slope).norm() * size / at(&found, 0, line).norm();
                    let parameter = values[i].0.name(&robot);
                    assert!(
                        error < 1e-6,
                        "{name} {hold:?} {parameter} {}: {error:.1e}",
                        f[line]
                    );
                }
            }
        }
    }
}
