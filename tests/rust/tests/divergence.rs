//! A model that does not hold is an answer; misuse is none.

use axisight_core::effects::EffectError;
use axisight_core::robot::{EffectSetting, Parameter};
use axisight_core::simulation::Method;
use axisight_identification::logs::{
    Divergence, FitOptions, InverseDynamics, MotionRecord, Problem, ProblemError, Record,
    SimulationErrorProblem, SimulationInput, SimulationOutput, Target, fit,
};
use axisight_tests::{ARM, effect, flat, free, robot, sines};
use std::sync::Arc;

const SAMPLES: usize = 200;

/// Two torque-driven logs of the arm, with one parameter.
fn problem(effects: Vec<EffectSetting<f64>>, target: Target) -> SimulationErrorProblem {
    let robot = robot(ARM);
    let input = sines(SAMPLES, robot.n_axes(), robot.sample_time, 1.0);
    let record = Arc::new(Record::new(input.clone(), vec![0.0; input.len()]));
    SimulationErrorProblem {
        records: vec![record; 2],
        robot,
        effects,
        parameters: vec![free(target, 0.0, 1.0)],
        input: SimulationInput::Torque,
        output: SimulationOutput::Position,
        weighting: vec![flat(1.0)],
        sensed: Vec::new(),
        method: Method::RungeKutta4 { substeps: 1 },
        block_s: 0.05,
        courses: None,
        cancel: None,
    }
}

fn error(effects: Vec<EffectSetting<f64>>, target: Target, value: f64) -> ProblemError {
    let problem = problem(effects, target);
    problem
        .evaluate(&[value], &[])
        .expect_err("holds nowhere near")
}

fn divergence(error: ProblemError) -> Divergence {
    match error {
        ProblemError::Diverged(found) => found,
        other => panic!("{other:?}"),
    }
}

fn is_misuse(error: &ProblemError) -> bool {
    matches!(error, ProblemError::Misuse(_))
}

const STIFFNESS: Target = Target::Robot(Parameter::Stiffness(0));

#[test]
fn a_run_without_end_says_where_it_ended() {
    // Far beyond what a step of a sample can follow.
    let found = divergence(error(Vec::new(), STIFFNESS, 1e14));
    let sample = found.sample.expect("a run began");
    assert!(sample < SAMPLES);
    assert_eq!(found.records, vec![0, 1]);
    let text = format!("the simulation failed: diverged at sample {sample}");
    assert_eq!(found.to_string(), text);
}

#[test]
fn a_model_without_a_run_is_no_misuse() {
    let mass = Target::Robot(Parameter::Mass(0));
    let lags = vec![
        effect("actuator_bandwidth", Some(0), &[1e-3]),
        effect("current_loop", Some(0), &[1e-3, 0.7]),
    ];
    for (effects, target, value) in [(Vec::new(), mass, -1.0), (lags, STIFFNESS, 4e5)] {
        let found = divergence(error(effects, target, value));
        assert_eq!((found.records, found.sample), (Vec::new(), None));
    }
}

#[test]
fn misuse_of_effects_is_no_divergence() {
    let (friction, good) = ("coulomb_friction", [0.4, 0.5, 0.0, 0.0]);
    for misused in [
        effect(friction, Some(7), &good),
        effect(friction, None, &good),
        effect(friction, Some(0), &good[..1]),
        effect(friction, Some(0), &[-1.0, 0.5, 0.0]),
        effect("no_such_effect", Some(0), &good),
    ] {
        let found = error(vec![misused.clone()], STIFFNESS, 4e5);
        assert!(is_misuse(&found), "{misused:?}: {found:?}");
    }
}

#[test]
fn a_fit_tells_them_apart_where_it_begins() {
    let mut stiff = problem(Vec::new(), STIFFNESS);
    stiff.parameters[0].initial = 1e14;
    let begun = |p: &SimulationErrorProblem| fit(p, &p.parameters, FitOptions::default(), &[]);
    divergence(begun(&stiff).expect_err("diverges"));
    let misused = effect("coulomb_friction", Some(7), &[0.4, 0.5, 0.0, 0.0]);
    let mut misplaced = problem(vec![misused], STIFFNESS);
    misplaced.parameters[0].initial = 4e5;
    assert!(is_misuse(&begun(&misplaced).expect_err("misplaced")));
}

#[test]
fn predicted_torques_tell_them_apart() {
    let zeros = vec![0.0; SAMPLES];
    let predicted = |effects, mass| {
        let problem = InverseDynamics {
            robot: robot(ARM),
            effects,
            parameters: vec![free(Target::Robot(Parameter::Mass(0)), mass, 1.0)],
            records: vec![Arc::new(MotionRecord {
                position: zeros.clone(),
                velocity: zeros.clone(),
                acceleration: zeros.clone(),
                torque: zeros.clone(),
                certainty: vec![1.0; SAMPLES],
            })],
            weighting: vec![flat(1.0)],
            block_s: 0.05,
        };
        problem
            .evaluate(&[mass], &[])
            .expect_err("holds nowhere near")
    };
    divergence(predicted(Vec::new(), -1.0));
    let misplaced = effect("coulomb_friction", Some(7), &[0.4, 0.5, 0.0, 0.0]);
    assert!(is_misuse(&predicted(vec![misplaced], 60.0)));
}

/// What an axis lacks depends on the robot; a place that no robot has does not.
#[test]
fn what_an_effect_lacks_is_said_as_before() {
    let lacking = EffectError::Lacking {
        effect: "backlash",
        expected: "an axis with a compliant transmission".into(),
        got: "axis 1 (rigid)".into(),
    };
    let text =
        "effect `backlash`: expected an axis with a compliant transmission, got axis 1 (rigid)";
    assert_eq!(lacking.to_string(), text);
}
