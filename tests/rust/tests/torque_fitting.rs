//! Fits of the torque that a measured motion takes find what was put in.

use axisight_core::robot::{EffectSetting, Parameter, RigidBody, RobotDescription};
use axisight_core::simulation::measurement_noise;
use axisight_identification::logs::{
    FitOptions, InverseDynamics, Linearization, Loss, MotionRecord, Target, fit,
};
use axisight_tests::{ARM, effect, flat, free, largest, robot};
use std::sync::Arc;

const SAMPLES: usize = 800;
/// Dry friction of the machine.
const COULOMB_NM: f64 = 0.4;

fn friction(level: f64) -> Vec<EffectSetting<f64>> {
    vec![effect("coulomb_friction", Some(0), &[level, 0.5, 0.0, 0.0])]
}

/// A motion of the arm known in closed form, and the torque it takes.
fn motion(robot: &RobotDescription, seed: u64, sigma: f64) -> MotionRecord {
    let body = RigidBody::new(robot);
    let drive = robot.joints[0].drive.as_ref().expect("drive");
    let noise = measurement_noise(seed, 0, SAMPLES, 1, sigma);
    let mut record = MotionRecord {
        position: vec![],
        velocity: vec![],
        acceleration: vec![],
        torque: vec![],
        certainty: vec![1.0; SAMPLES],
    };
    for k in 0..SAMPLES {
        let t = k as f64 * robot.sample_time;
        let (w1, w2) = (7.0, 19.0);
        let (x, v, a) = (
            60.0 * (w1 * t).sin() + 10.0 * (w2 * t).cos(),
            60.0 * w1 * (w1 * t).cos() - 10.0 * w2 * (w2 * t).sin(),
            -60.0 * w1 * w1 * (w1 * t).sin() - 10.0 * w2 * w2 * (w2 * t).cos(),
        );
        let r = drive.gear_ratio;
        let joint = body
            .inverse_dynamics(&[r * x, 0.0], &[r * v, 0.0], &[r * a, 0.0])
            .expect("torque");
        let friction = drive.viscous_friction * v + COULOMB_NM * (v / 0.5).tanh();
        record.position.push(x);
        record.velocity.push(v);
        record.acceleration.push(a);
        record
            .torque
            .push(r * joint[0] + drive.motor_inertia * a + friction + noise[k]);
    }
    record
}

#[test]
fn inverse_dynamics_finds_mass_centre_and_friction() {
    let robot = robot(ARM);
    let sigma = 0.02;
    let truth = [60.0, 0.4, 0.01, COULOMB_NM];
    let parameters = vec![
        free(Target::Robot(Parameter::Mass(0)), 40.0, 1.0),
        free(Target::Robot(Parameter::Com(0, 0)), 0.3, 0.01),
        free(Target::Robot(Parameter::ViscousFriction(0)), 0.0, 1e-3),
        free(Target::Effect(0, 0), 0.0, 0.1),
    ];
    for (noise, seed) in [(0.0, 1), (sigma, 2), (sigma, 3)] {
        let problem = InverseDynamics {
            records: vec![
                Arc::new(motion(&robot, seed, noise)),
                Arc::new(motion(&robot, seed + 10, noise)),
            ],
            robot: robot.clone(),
            effects: friction(0.0),
            parameters: parameters.clone(),
            weighting: vec![flat(1.0 / sigma)],
            block_s: 0.1,
        };
        problem.validate().expect("valid");
        let fit = fit(&problem, &problem.parameters, FitOptions::default(), &[]).expect("fit");
        for i in 0..4 {
            let deviation = fit.covariance[i * 5].sqrt();
            let error = (fit.theta[i] - truth[i]).abs();
            // Without noise the search stops within 1e-5 of the residual it could still remove.
            let allowed = if noise > 0.0 {
                4.0 * deviation
            } else {
                1e-3 * deviation
            };
            assert!(error < allowed, "{i}: {error:.1e} {deviation:.1e}");
            assert!(deviation < 0.1 * truth[i], "{i}: {deviation:.1e}");
        }
        assert!(largest(&fit.residual) < if noise > 0.0 { 6.0 } else { 1e-3 });
    }
}

/// Samples of no certainty may be any torque; those of half count a quarter of a square each.
#[test]
fn uncertain_samples_count_for_less() {
    let robot = robot(ARM);
    let mut record = motion(&robot, 1, 0.0);
    for k in 0..SAMPLES {
        if k % 3 == 0 {
            record.torque[k] += 5.0;
            record.certainty[k] = 0.0;
        }
    }
    let mut problem = InverseDynamics {
        records: vec![Arc::new(record)],
        robot: robot.clone(),
        effects: friction(COULOMB_NM),
        parameters: vec![free(Target::Robot(Parameter::Mass(0)), 40.0, 1.0)],
        weighting: vec![flat(1.0)],
        block_s: 0.1,
    };
    let found = fit(&problem, &problem.parameters, FitOptions::default(), &[]).expect("fit");
    // The mass of the machine, as if the wrong samples were not there.
    assert!((found.theta[0] - 60.0).abs() < 1e-3, "{:?}", found.theta);
    problem.parameters[0].initial = 50.0;
    let start =
        Linearization::new(&problem, &problem.parameters, Loss::Squared, &[]).expect("model");
    let first = Arc::make_mut(&mut problem.records[0]);
    first.certainty.iter_mut().for_each(|c| *c *= 0.5);
    let half =
        Linearization::new(&problem, &problem.parameters, Loss::Squared, &[]).expect("model");
    assert!((half.loss - 0.25 * start.loss).abs() < 1e-9 * start.loss);
    let slope = |at: &Linearization| at.columns[0].to_vec();
    let (a, b) = (slope(&start), slope(&half));
    assert!(
        a.iter()
            .zip(&b)
            .all(|(x, y)| (0.5 * x - y).abs() < 1e-12 + 1e-9 * x.abs())
    );
}
