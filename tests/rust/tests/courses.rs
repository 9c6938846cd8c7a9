//! The arm linearised along runs: what models nearby do, by the equations of the run.
//!
//! A model at a distance `e` from the run is off by `a e + b e^2`. The second term is what the
//! linearisation leaves out; the first is what drawing its matrices as straight lines over 8 ms,
//! the forces of other masses over 2 samples and the arm's own spring back over one leaves out.

use axisight_core::plant::Plant;
use axisight_core::robot::{Course, Parameter, RobotDescription};
use axisight_core::simulation::{
    CourseOfAnother, Drive, Method, Run, SimulationError, Status, Stepper, simulate,
};
use axisight_identification::logs::{
    Courses, FitParameter, Problem, ProblemError, Record, SimulationErrorProblem, SimulationInput,
    SimulationOutput, Target,
};
use axisight_tests::{ARM, PRESET, effect, flat, free, plant, relative, robot, sines, trace};
use std::sync::Arc;

const METHOD: Method = Method::RungeKutta4 { substeps: 1 };
/// One more than run in lock-step, of different lengths and sizes.
const LOGS: [(usize, f64); 5] = [
    (500, 40.0),
    (420, 25.0),
    (500, -40.0),
    (260, 30.0),
    (330, -20.0),
];
/// Level and smoothing of the friction in the model; the level is a parameter.
const FRICTION: [f64; 4] = [0.5, 2.0, 0.0, 0.0];

/// A parameter, and a change of it that a search makes in one go.
const CHANGES: [(Target, f64); 6] = [
    (Target::Robot(Parameter::Mass(6)), 0.1),
    (Target::Robot(Parameter::Mass(3)), 0.1),
    (Target::Robot(Parameter::Stiffness(1)), 0.1),
    (Target::Robot(Parameter::Damping(1)), 0.1),
    (Target::Robot(Parameter::MotorInertia(1)), 0.1),
    (Target::Effect(0, 0), 0.5),
];

fn parameters(robot: &RobotDescription) -> Vec<FitParameter> {
    let parameter = |(target, _): &(Target, f64)| {
        let nominal = match target {
            Target::Robot(parameter) => parameter.nominal(robot),
            Target::Effect(..) => FRICTION[0],
        };
        free(*target, nominal, 0.01 * nominal)
    };
    CHANGES.iter().map(parameter).collect()
}

fn start(problem: &SimulationErrorProblem) -> Vec<f64> {
    problem.parameters.iter().map(|p| p.initial).collect()
}

/// Logs of the preset with all its parameters a little off, driven by `input`.
fn problem(input: SimulationInput) -> SimulationErrorProblem {
    let robot = robot(PRESET);
    let effects = vec![effect("coulomb_friction", Some(1), &FRICTION)];
    let machine = plant::<f64>(&robot, &effects);
    let record = |(samples, size): &(usize, f64)| {
        let reference = sines(*samples, 3, robot.sample_time, *size);
        let run = trace(
            &machine,
            &robot,
            Drive::Reference(&[&reference]),
            &[],
            METHOD,
        );
        let input = match input {
            SimulationInput::Tracking => run.measured,
            _ => reference,
        };
        Arc::new(Record::new(input, run.command))
    };
    let records = LOGS.iter().map(record).collect();
    let mut problem = SimulationErrorProblem {
        records,
        parameters: parameters(&robot),
        robot,
        effects,
        input,
        output: SimulationOutput::Torque,
        weighting: vec![flat(1.0); 3],
        sensed: Vec::new(),
        method: METHOD,
        block_s: 0.05,
        courses: None,
        cancel: None,
    };
    // Away from the truth: a residual of zero would be the same for every wrong reason.
    for (i, p) in problem.parameters.iter_mut().enumerate() {
        p.initial *= if i % 2 == 0 { 1.02 } else { 0.97 };
    }
    problem
}

fn with_courses(problem: &SimulationErrorProblem) -> SimulationErrorProblem {
    let courses = Courses::new(problem, &start(problem)).expect("holds");
    SimulationErrorProblem {
        courses: Some(Arc::new(courses.expect("compliant gears on the ground"))),
        ..problem.clone()
    }
}

fn residual(problem: &SimulationErrorProblem, theta: &[f64]) -> Vec<f64> {
    problem.evaluate(theta, &[]).expect("holds").residual
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// `a * x + b * y`, entry by entry.
fn sum(a: f64, x: &[f64], b: f64, y: &[f64]) -> Vec<f64> {
    assert_eq!(x.len(), y.len());
    x.iter().zip(y).map(|(x, y)| a * x + b * y).collect()
}

/// Share of its effect by which the effect of a small change may be off. The fastest tone of the
/// excitation has 31 Hz, w = 195 rad/s. Forces of other masses are a straight line over h = 1 ms,
/// `(w h)^2 / 12 = 3e-3` too small on average, of accelerations that differences over twice
/// T = 0.5 ms make `(w T)^2 / 6 = 2e-3` too small. Anything else bends the arm at a gear spring,
/// 4e6 Nm/rad, against gravity of 1e4 Nm/rad that comes half a sample late: `1e4 / 4e6 w T / 2`,
/// 1e-4, which the resonance of the arm near 15 Hz makes a few times as large.
fn share(target: Target) -> f64 {
    match target {
        Target::Robot(Parameter::Mass(_)) => 5e-3,
        _ => 5e-4,
    }
}

/// What the linearised arm leaves out where it is is known, and put back: nothing but the rounding
/// of a torque of 100 Nm is left, 1e-14 of a residual of a few Nm.
#[test]
fn the_model_of_the_runs_is_as_exact() {
    for input in [SimulationInput::Tracking, SimulationInput::Reference] {
        let exact = problem(input);
        let theta = start(&exact);
        let [got, want] = [&with_courses(&exact), &exact].map(|p| residual(p, &theta));
        let error = relative(&got, &want);
        assert!(error < 1e-12, "{input:?}: {error:.1e}");
        assert!(norm(&want) > 1.0, "{input:?}: nothing to compare");
    }
}

/// Of what is left out in models up and down by the same change, the mean is `b e^2`: a quarter
/// at half of it, but for terms in `e^4`, a few `e^2 = 1e-2` of it. Half the difference is `a e`, at
/// the half change with hardly a term in `e^3`.
#[test]
fn what_is_left_out_is_of_second_order() {
    let methods = [
        METHOD,
        Method::RungeKutta4 { substeps: 2 },
        Method::Nystrom4 { substeps: 1 },
    ];
    for method in methods {
        let exact = SimulationErrorProblem {
            method,
            ..problem(SimulationInput::Tracking)
        };
        let (near, theta) = (with_courses(&exact), start(&exact));
        let base = residual(&exact, &theta);
        for (i, (target, change)) in CHANGES.iter().enumerate() {
            // Left out of a model at a distance, and how far its residual has moved.
            let left_out = |e: f64| {
                let mut theta = theta.clone();
                theta[i] *= 1.0 + e;
                let want = residual(&exact, &theta);
                let left = sum(1.0, &residual(&near, &theta), -1.0, &want);
                (left, norm(&sum(1.0, &want, -1.0, &base)))
            };
            let parts = |e: f64| {
                let ((up, moved), (down, _)) = (left_out(e), left_out(-e));
                let [odd, even] = [-0.5, 0.5].map(|b| norm(&sum(0.5, &up, b, &down)));
                (odd / moved, even)
            };
            let ((_, whole), (first, half)) = (parts(*change), parts(0.5 * change));
            let ratio = whole / half;
            let label = format!("{method:?} {target:?}");
            assert!((3.8..4.2).contains(&ratio), "{label}: {ratio:.3}");
            assert!(first < share(*target), "{label}: {first:.1e}");
        }
    }
}

/// Central differences of exact runs at steps of 1e-4: truncation 1e-8, and rounding 1e-14 Nm
/// over a change of 1e-3 Nm, both far below the tolerance.
#[test]
fn columns_along_a_run_are_derivatives_of_exact_runs() {
    let all: Vec<usize> = (0..CHANGES.len()).collect();
    for input in [SimulationInput::Tracking, SimulationInput::Reference] {
        let exact = problem(input);
        let theta = start(&exact);
        let own = exact.evaluate(&theta, &all).expect("columns");
        // Weighted in pairs, as real and imaginary parts of one transform: another partner, other
        // rounding.
        let error = relative(&own.residual, &residual(&exact, &theta));
        assert!(error < 1e-12, "{error:.1e}");
        let near = with_courses(&exact)
            .evaluate(&theta, &all)
            .expect("columns");
        for i in all.iter().copied() {
            let h = 1e-4 * theta[i];
            let at = |step: f64| {
                let mut theta = theta.clone();
                theta[i] += step;
                residual(&exact, &theta)
            };
            let slope = sum(0.5 / h, &at(h), -0.5 / h, &at(-h));
            for (along, columns) in [("its own", &own.columns), ("a given", &near.columns)] {
                let error = norm(&sum(1.0, &columns[i], -1.0, &slope)) / norm(&slope);
                let label = format!("{input:?} {:?} along {along} run", CHANGES[i].0);
                assert!(error < share(CHANGES[i].0), "{label}: {error:.1e}");
            }
        }
    }
}

/// Every thread and every lane of a batch does what it would alone. Where others run on after the
/// end of a log, the matrices of its last stretch of 8 ms are drawn across the end, not up to it.
/// They make some 1e-4 of a residual (`share`), and the stretch is a twentieth of a log.
#[test]
fn neither_threads_nor_company_change_a_run() {
    let exact = problem(SimulationInput::Tracking);
    let all: Vec<usize> = (0..CHANGES.len()).collect();
    // Away from the courses, so that nothing of them cancels.
    let theta: Vec<f64> = start(&exact).iter().map(|x| 1.01 * x).collect();
    let on = |threads: usize, problem: &SimulationErrorProblem| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let near = || with_courses(problem).evaluate(&theta, &all).expect("holds");
        pool.expect("threads").install(near)
    };
    let one = on(1, &exact);
    for threads in [2, 5] {
        let many = on(threads, &exact);
        assert!(many.residual == one.residual, "{threads} threads");
        assert!(many.columns == one.columns, "{threads} threads");
    }
    let mut first = 0;
    for (number, record) in exact.records.iter().enumerate() {
        let records = vec![record.clone()];
        let alone = on(
            1,
            &SimulationErrorProblem {
                records,
                ..exact.clone()
            },
        );
        let range = first..first + alone.residual.len();
        let series = [(&one.residual, &alone.residual)];
        let columns = one.columns.iter().zip(&alone.columns);
        for (together, alone) in series.into_iter().chain(columns) {
            let off = norm(&sum(1.0, &together[range.clone()], -1.0, alone)) / norm(alone);
            // Log 4 is the last batch; 0 and 2 are the longest of the other. One log in four copies
            // has fewer derivatives in each, which rounds otherwise.
            let allowed = if [1, 3].contains(&number) {
                1e-5
            } else {
                1e-13
            };
            assert!(off <= allowed, "log {number}: {off:.1e}");
        }
        first = range.end;
    }
    assert_eq!(first, one.residual.len());
}

/// Courses of shorter logs, which end before the run does.
#[test]
fn courses_that_end_too_early_are_refused() {
    let exact = problem(SimulationInput::Tracking);
    let mut shorter = exact.clone();
    for record in shorter.records.iter_mut().map(Arc::make_mut) {
        record.input.truncate(3 * 200);
        record.target.truncate(3 * 200);
    }
    let courses = with_courses(&shorter).courses;
    let error = SimulationErrorProblem {
        courses,
        ..exact.clone()
    }
    .evaluate(&start(&exact), &[]);
    let Err(ProblemError::Misuse(text)) = error else {
        panic!("{error:?}")
    };
    // Of the logs in one batch or in the other, whichever is found first.
    assert!(text.starts_with("course: expected at least "), "{text}");
    assert!(text.contains("got 200 samples"), "{text}");
}

/// Courses of another arm, of more logs, or of a method without fixed steps serve nothing: the
/// arm stays as it is.
#[test]
fn courses_that_do_not_serve_are_left_alone() {
    let exact = problem(SimulationInput::Tracking);
    let theta = start(&exact);
    let want = residual(&exact, &theta);
    let arm = robot(ARM);
    let rows = exact.records.iter().map(|r| r.input.len() / 3);
    let other = SimulationErrorProblem {
        records: rows
            .map(|n| Arc::new(Record::new(vec![0.0; n], vec![0.0; n])))
            .collect(),
        weighting: vec![flat(1.0)],
        sensed: Vec::new(),
        parameters: Vec::new(),
        effects: Vec::new(),
        robot: arm,
        ..exact.clone()
    };
    let fewer = SimulationErrorProblem {
        records: exact.records[..4].to_vec(),
        ..exact.clone()
    };
    for from in [&other, &fewer] {
        let problem = SimulationErrorProblem {
            courses: with_courses(from).courses,
            ..exact.clone()
        };
        assert_eq!(residual(&problem, &theta), want);
    }
    let method = Method::DormandPrince { tolerance: 1e-7 };
    let adaptive = SimulationErrorProblem {
        method,
        ..exact.clone()
    };
    assert!(Courses::new(&adaptive, &theta).expect("holds").is_none());
    let courses = with_courses(&exact).courses;
    let problem = SimulationErrorProblem {
        courses,
        ..adaptive.clone()
    };
    assert_eq!(residual(&problem, &theta), residual(&adaptive, &theta));
}

/// A motor behind a rigid gear: a command makes its joint jump, which no run holds.
#[test]
fn a_rigid_gear_has_no_courses() {
    let mut rigid = problem(SimulationInput::Tracking);
    rigid.robot.joints[0].compliance = None;
    assert!(
        Courses::new(&rigid, &start(&rigid))
            .expect("holds")
            .is_none()
    );
}

/// By the simulation itself: a course that is too short, and a method whose steps are not fixed.
#[test]
fn a_course_that_does_not_fit_a_run_is_refused() {
    let robot = robot(ARM);
    let plant = plant::<f64>(&robot, &[]);
    let reference = sines(100, 1, robot.sample_time, 1.0);
    let run = trace(&plant, &robot, Drive::Reference(&[&reference]), &[], METHOD);
    let (joints, angles) = (plant.joint_slots(), plant.n_angles());
    let states = run.states.iter().flat_map(|x| {
        let rates = angles + joints.start..angles + joints.end;
        [&x[joints.clone()], &x[rates]].concat()
    });
    let states: Vec<f64> = states.collect();
    let along = |samples: usize, method: Method| {
        let course = Course::new(&plant.chain, robot.sample_time, &states[..4 * samples]);
        let run = Run {
            controller: &robot.controller,
            sample_time: robot.sample_time,
            start: &[&robot.operating_point],
            drive: Drive::Reference(&[&reference]),
            noise: &[],
            resolution: 0.0,
            disturbances: false,
            accelerometers: false,
            method,
            cancel: None,
        };
        let mut stepper = Stepper::along(&plant, &Arc::new(course)).expect("of this arm");
        simulate(&plant, &run, &mut stepper, &mut |_| {})
    };
    assert_eq!(along(100, METHOD), Ok(Status::Completed));
    let refused = |samples: usize, method: Method| {
        let error = SimulationError::Course {
            expected: 100,
            got: samples,
            method,
        };
        assert_eq!(along(samples, method), Err(error));
    };
    refused(99, METHOD);
    refused(1, METHOD);
    refused(0, METHOD);
    refused(100, Method::DormandPrince { tolerance: 1e-7 });
}

/// Of more joints and of fewer.
#[test]
fn a_course_of_another_arm_is_refused() {
    let [arm, preset] = [ARM, PRESET].map(|text| plant::<f64>(&robot(text), &[]));
    let course = |plant: &Plant<f64>| {
        let rest = vec![0.0; 2 * plant.chain.len() * 10];
        Arc::new(Course::new(&plant.chain, 1e-3, &rest))
    };
    for (of, on) in [(&arm, &preset), (&preset, &arm)] {
        let (got, expected) = (of.chain.len(), on.chain.len());
        let outcome = Stepper::along(on, &course(of)).err();
        let error = CourseOfAnother { expected, got };
        assert_eq!(outcome, Some(error));
    }
}
