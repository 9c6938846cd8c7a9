//! Fixed steps are shortened where sharp friction would make them unstable.

use axisight_core::plant::{Seeded, fastest_decay};
use axisight_core::robot::{EffectSetting, RobotDescription};
use axisight_core::simulation::{Drive, Method};
use axisight_identification::logs::{
    Linearization, Loss, Record, SimulationErrorProblem, SimulationInput, SimulationOutput, Target,
};
use axisight_scalar::Scalar;
use axisight_tests::{
    ARM, ROTOR, effect, flat, free, largest, plant, relative, robot, sines, trace,
};
use std::sync::Arc;

const METHOD: Method = Method::RungeKutta4 { substeps: 1 };
const LEVEL_NM: f64 = 0.4;
/// With the 0.004 kg m2 of the motor, speeds decay within 50 us; a sample lasts 500 us.
const SMOOTHING_RAD_S: f64 = 5e-3;

fn friction<S: Scalar>(level: f64, smoothing: f64) -> Vec<EffectSetting<S>> {
    let parameters = [level, smoothing, 0.0, 0.0];
    vec![effect("coulomb_friction", Some(0), &parameters)]
}

/// The slope of friction at standstill over the inertia of the rotor, 0.25 + 3 * 0.5^2 = 1 kg m2 at
/// the motor.
#[test]
fn friction_decays_at_its_slope_over_the_inertia() {
    let decay = |effects: &[EffectSetting<Seeded>]| fastest_decay(&plant(&robot(ROTOR), effects));
    let got = decay(&friction(2.0, 0.01));
    assert!((got / 200.0 - 1.0).abs() < 1e-12, "{got}");
    assert!(decay(&[]).abs() < 1e-9);
}

#[test]
fn steps_are_as_short_as_needed_and_never_longer_than_stated() {
    let steps = |decay| match METHOD.stable_at(decay, 1e-3) {
        Method::RungeKutta4 { substeps } => substeps,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        [0.0, 1999.0, 2001.0, 1e9, f64::NAN].map(steps),
        [1, 1, 2, 16, 1]
    );
    let stated = Method::Nystrom4 { substeps: 5 };
    assert_eq!(stated.stable_at(2001.0, 1e-3), stated);
    let controlled = Method::default();
    assert_eq!(controlled.stable_at(1e9, 1e-3), controlled);
}

/// A torque below the friction level: the motor stands.
fn standing(robot: &RobotDescription) -> Vec<f64> {
    sines(400, robot.n_axes(), robot.sample_time, 0.1 * LEVEL_NM)
}

fn problem(robot: &RobotDescription, target: Vec<f64>) -> SimulationErrorProblem {
    SimulationErrorProblem {
        records: vec![Arc::new(Record::new(standing(robot), target))],
        robot: robot.clone(),
        effects: friction(0.0, SMOOTHING_RAD_S),
        parameters: vec![free(Target::Effect(0, 0), LEVEL_NM, 0.1)],
        input: SimulationInput::Torque,
        output: SimulationOutput::Position,
        weighting: vec![flat(1.0)],
        sensed: Vec::new(),
        method: METHOD,
        block_s: 0.05,
        courses: None,
        cancel: None,
    }
}

/// The derivative with respect to the level, against the difference of two runs with error control
/// at levels 1 % apart: the second-order part of that difference is below 1 %.
#[test]
fn derivatives_of_a_standing_axis_are_those_of_the_motion() {
    let robot = robot(&ARM.replace("[0, 0, -9.81]", "[0, 0, 0]"));
    let positions = |level: f64| {
        let exact = Method::DormandPrince { tolerance: 1e-10 };
        let plant = plant::<f64>(&robot, &friction(level, SMOOTHING_RAD_S));
        let input = standing(&robot);
        trace(&plant, &robot, Drive::Torque(&[&input]), &[], exact).measured
    };
    let step = 0.01 * LEVEL_NM;
    let (above, below) = (
        positions(LEVEL_NM + step / 2.0),
        positions(LEVEL_NM - step / 2.0),
    );
    let want: Vec<f64> = above
        .iter()
        .zip(&below)
        .map(|(a, b)| (a - b) / step)
        .collect();
    let problem = problem(&robot, positions(LEVEL_NM));
    let at = Linearization::new(&problem, &problem.parameters, Loss::Squared, &[]).expect("a run");
    let error = relative(&at.columns[0], &want);
    assert!(error < 0.01, "{error:.1e} of {:.1e}", largest(&want));
}
