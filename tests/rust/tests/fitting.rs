//! Fits find what was put in, and say how well they know it.

use axisight_core::plant::equilibrium;
use axisight_core::robot::{EffectSetting, Parameter, RobotDescription};
use axisight_core::simulation::{Drive, Method, measurement_noise};
use axisight_identification::logs::{
    Column, Fit, FitOptions, FitParameter, Linearization, Loss, Problem, ProblemError, Record,
    SimulationErrorProblem, SimulationInput, SimulationOutput, Target, fit,
};
use axisight_tests::{
    ARM, PRESET, effect, flat, free, largest, plant, relative, robot, sines, trace,
};
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

const SIGMA: f64 = 1e-3;
const SAMPLES: usize = 800;
const METHOD: Method = Method::RungeKutta4 { substeps: 1 };
/// True values of the fitted parameters of the arm: stiffness, motor inertia, mass, Coulomb.
const TRUTH: [f64; 4] = [4e5, 0.004, 60.0, 0.4];
const SCALE: [f64; 4] = [1e4, 1e-4, 1.0, 0.1];

fn friction(level: f64) -> Vec<EffectSetting<f64>> {
    vec![effect("coulomb_friction", Some(0), &[level, 0.5, 0.0, 0.0])]
}

/// Torque that holds the arm plus sines.
fn torque(robot: &RobotDescription, n: usize, size: f64) -> Vec<f64> {
    let rest = equilibrium(&plant::<f64>(robot, &[]), &robot.operating_point).expect("rest");
    let holding = rest.motor_torque.iter().cycle();
    let sines = sines(n, robot.n_axes(), robot.sample_time, size);
    sines.iter().zip(holding).map(|(s, h)| s + h).collect()
}

/// Torque-driven logs of the arm with position noise `sigma`.
fn logs(robot: &RobotDescription, seed: u64, sigma: f64) -> Vec<Arc<Record>> {
    let plant = plant::<f64>(robot, &friction(TRUTH[3]));
    let log = |(run, size, n): (u64, f64, usize)| {
        let input = torque(robot, n, size);
        let noise = measurement_noise(seed, run, n, 1, sigma);
        let target = trace(&plant, robot, Drive::Torque(&[&input]), &[&noise], METHOD).measured;
        Arc::new(Record::new(input, target))
    };
    [(0, 2.0, SAMPLES), (1, -1.5, SAMPLES - 100)]
        .map(log)
        .into()
}

fn arm_parameters() -> Vec<FitParameter> {
    let targets = [
        Target::Robot(Parameter::Stiffness(0)),
        Target::Robot(Parameter::MotorInertia(0)),
        Target::Robot(Parameter::Mass(0)),
        Target::Effect(0, 0),
    ];
    let start = [1.1, 0.85, 1.05, 0.5];
    (0..4)
        .map(|i| free(targets[i], start[i] * TRUTH[i], SCALE[i]))
        .collect()
}

fn arm_problem(seed: u64, sigma: f64) -> SimulationErrorProblem {
    let robot = robot(ARM);
    SimulationErrorProblem {
        records: logs(&robot, seed, sigma),
        robot,
        effects: friction(0.0),
        parameters: arm_parameters(),
        input: SimulationInput::Torque,
        output: SimulationOutput::Position,
        weighting: vec![flat(1.0 / SIGMA)],
        sensed: Vec::new(),
        method: METHOD,
        block_s: 0.05,
        courses: None,
        cancel: None,
    }
}

fn solve(problem: &SimulationErrorProblem) -> Fit {
    solve_with(problem, FitOptions::default())
}

fn solve_with(problem: &SimulationErrorProblem, options: FitOptions) -> Fit {
    problem.validate().expect("valid");
    fit(problem, &problem.parameters, options, &[]).expect("fit")
}

/// Squared distance of `theta` from `from` in units of the reported covariance.
fn distance(fit: &Fit, theta: &[f64], from: &[f64]) -> f64 {
    let n = fit.free.len();
    let off = DVector::from_iterator(n, fit.free.iter().map(|i| theta[*i] - from[*i]));
    let information = DMatrix::from_column_slice(n, n, &fit.covariance)
        .try_inverse()
        .expect("regular");
    off.dot(&(information * &off))
}

fn settled(fit: &Fit) -> bool {
    fit.status.converged()
}

/// 4 sigma fails once in 16,000 for a normal error; the loss is chi-square with as many
/// degrees of freedom as residuals less parameters, five of its deviations allowed.
#[test]
fn parameters_come_back_within_their_uncertainty() {
    let problem = arm_problem(1, SIGMA);
    let fit = solve(&problem);
    assert!(settled(&fit), "{:?}", fit.status);
    for i in 0..4 {
        let sigma = fit.covariance[i * 4 + i].sqrt();
        let error = (fit.theta[i] - TRUTH[i]).abs();
        assert!(error < 4.0 * sigma, "{i}: {error:.2e} {sigma:.2e}");
        assert!(
            sigma < 0.05 * TRUTH[i],
            "{i} is not determined: {sigma:.1e}"
        );
    }
    let freedom = (fit.n_residuals - 4) as f64;
    assert!(
        (fit.loss - freedom).abs() < 5.0 * (2.0 * freedom).sqrt(),
        "{} {freedom}",
        fit.loss
    );
    assert!(fit.initial_loss > 100.0 * fit.loss && fit.at_bound.is_empty());
}

/// The squared distance is chi-square(4) in each of 12 noise realizations, so the sum is
/// chi-square(48): between 17 and 97 in all but one in 20,000 on either side.
#[test]
fn covariance_describes_the_scatter() {
    let sum: f64 = (0..12)
        .map(|seed| {
            let fit = solve(&arm_problem(100 + seed, SIGMA));
            distance(&fit, &fit.theta, &TRUTH)
        })
        .sum();
    assert!((17.0..97.0).contains(&sum), "{sum}");
}

/// Blocks of 0.05 s of white residuals: their 15 gradients scatter as the covariance says, up to
/// chi-square(15) / 15, between 0.2 and 2.5 in all but one case in 1000 on either side.
#[test]
fn sandwich_agrees_with_the_covariance_for_white_noise() {
    let fit = solve(&arm_problem(2, SIGMA));
    assert_eq!(fit.blocks.len(), 8 + 7);
    for i in 0..4 {
        let ratio = fit.sandwich[i * 5] / fit.covariance[i * 5];
        assert!((0.2..2.5).contains(&ratio), "{i}: {ratio}");
    }
}

/// Without noise the residual vanishes at the truth: what is left is where the search stops,
/// a step of 1e-8 scales.
#[test]
fn three_axes_come_back_from_reference_driven_torque() {
    let robot = robot(PRESET);
    let plant = plant::<f64>(&robot, &[]);
    let input = sines(400, 3, robot.sample_time, 3.0);
    let target = trace(&plant, &robot, Drive::Reference(&[&input]), &[], METHOD).command;
    let stiffnesses = (0..7).map(Parameter::Stiffness);
    let inertias = [0, 1, 4].map(Parameter::MotorInertia);
    let all: Vec<Parameter> = stiffnesses.chain(inertias).collect();
    let truth: Vec<f64> = all.iter().map(|p| p.nominal(&robot)).collect();
    let parameters = all.iter().zip(&truth).enumerate().map(|(i, (p, x))| {
        let start = if i % 2 == 0 { 1.08 } else { 0.93 };
        free(Target::Robot(*p), start * x, 0.1 * x)
    });
    let problem = SimulationErrorProblem {
        parameters: parameters.collect(),
        records: vec![Arc::new(Record::new(input, target))],
        robot,
        effects: Vec::new(),
        input: SimulationInput::Reference,
        output: SimulationOutput::Torque,
        weighting: vec![flat(100.0); 3],
        sensed: Vec::new(),
        method: METHOD,
        block_s: 0.1,
        courses: None,
        cancel: None,
    };
    let fit = solve(&problem);
    for (got, want) in fit.theta.iter().zip(&truth) {
        assert!((got / want - 1.0).abs() < 1e-6, "{got} {want}");
    }
}

/// A log that ends early in a batch leaves its own residuals as they are alone, where the arm is
/// not linearised along the run: for few columns. `courses.rs` has it for many.
#[test]
fn logs_of_different_length_do_not_disturb_each_other() {
    let problem = arm_problem(3, SIGMA);
    let theta: Vec<f64> = problem.parameters.iter().map(|p| p.initial).collect();
    let together = problem.evaluate(&theta, &[0, 3]).expect("batch");
    let mut start = 0;
    for record in &problem.records {
        let alone = SimulationErrorProblem {
            records: vec![record.clone()],
            ..problem.clone()
        };
        let alone = alone.evaluate(&theta, &[0, 3]).expect("single");
        let range = start..start + alone.residual.len();
        assert_eq!(together.residual[range.clone()], alone.residual);
        for (a, b) in together.columns.iter().zip(&alone.columns) {
            assert_eq!(a[range.clone()], b[..]);
        }
        start = range.end;
    }
    assert_eq!(start, together.residual.len());
}

/// Its residuals and derivatives are those of the whole log less the lead, beside another log in
/// lock-step that has none; with few columns and, along a run of its own, with many.
#[test]
fn what_leads_to_a_log_is_simulated_and_not_compared() {
    let whole = arm_problem(3, SIGMA);
    let mut led = whole.clone();
    let lead = 150;
    Arc::make_mut(&mut led.records[0]).lead = lead;
    led.validate().expect("valid");
    let theta: Vec<f64> = whole.parameters.iter().map(|p| p.initial).collect();
    for columns in [&[0, 3][..], &[0, 1, 2, 3]] {
        let all = whole.evaluate(&theta, columns).expect("whole");
        let found = led.evaluate(&theta, columns).expect("led");
        assert_eq!(found.residual.len() + lead, all.residual.len());
        assert!(largest(&all.residual[..lead]) > 0.0);
        // Flat weights give a series back but for rounding.
        assert!(relative(&found.residual, &all.residual[lead..]) < 1e-12);
        for (a, b) in found.columns.iter().zip(&all.columns) {
            assert!(relative(a, &b[lead..]) < 1e-12);
        }
    }
    assert!(led.blocks().len() < whole.blocks().len());
}

/// Lanes that logs leave carry derivatives by other parameters: the same numbers, but for rounding.
#[test]
fn derivatives_do_not_depend_on_how_many_logs_share_the_lanes() {
    let mut problem = arm_problem(3, SIGMA);
    problem.records.extend(logs(&problem.robot, 7, SIGMA));
    let theta: Vec<f64> = problem.parameters.iter().map(|p| p.initial).collect();
    let columns = [0, 1, 2, 3];
    for logs in 1..4 {
        for count in 1..=4 {
            let fewer = SimulationErrorProblem {
                records: problem.records[..logs].to_vec(),
                ..problem.clone()
            };
            let found = fewer.evaluate(&theta, &columns[..count]).expect("fewer");
            let alike = problem.evaluate(&theta, &columns[..count]).expect("four");
            let end = found.residual.len();
            assert!(relative(&found.residual, &alike.residual[..end]) < 1e-12);
            for (a, b) in found.columns.iter().zip(&alike.columns) {
                assert!(relative(a, &b[..end]) < 1e-10, "{logs}, {count}");
            }
        }
    }
}

/// Central differences with relative step 1e-5: truncation 1e-10 of third derivatives,
/// rounding 1e-16 of a motor angle of 20 rad over a change of 1e-5 of it: below 1e-9. One column
/// at a time: for many, the arm is linearised along the run, as `courses.rs` has it.
#[test]
fn columns_are_derivatives_of_the_residuals() {
    let problem = arm_problem(4, SIGMA);
    let theta: Vec<f64> = problem.parameters.iter().map(|p| p.initial).collect();
    for i in [3, 0, 2] {
        let exact = problem.evaluate(&theta, &[i]).expect("column");
        let h = 1e-5 * theta[i];
        let at = |step: f64| {
            let mut theta = theta.clone();
            theta[i] += step;
            problem.evaluate(&theta, &[]).expect("residual").residual
        };
        let (high, low) = (at(h), at(-h));
        let slope: Vec<f64> = high
            .iter()
            .zip(&low)
            .map(|(a, b)| (a - b) / (2.0 * h))
            .collect();
        let error = relative(&exact.columns[0], &slope);
        assert!(error < 1e-5, "{i}: {error:.1e}");
    }
}

/// The truth lies outside: the fit stops on the bound, says so, and the others settle where
/// they do with the parameter held there.
#[test]
fn bound_is_kept_and_reported() {
    let mut problem = arm_problem(5, SIGMA);
    problem.parameters[2].upper = 59.8;
    problem.parameters[2].initial = 59.0;
    let bounded = solve(&problem);
    assert_eq!((bounded.theta[2], &bounded.at_bound[..]), (59.8, &[2][..]));
    assert!(settled(&bounded), "{:?}", bounded.status);
    problem.parameters[2].initial = 59.8;
    problem.parameters[2].frozen = true;
    let held = solve(&problem);
    assert!(held.at_bound.is_empty());
    // Both stop when the loss falls by less than 1e-10 of itself.
    let off = distance(&held, &bounded.theta, &held.theta);
    assert!(off < 1e-6 * held.loss, "{off:.1e} {}", held.loss);
}

#[test]
fn frozen_parameter_stays() {
    let mut problem = arm_problem(6, SIGMA);
    problem.parameters[0].frozen = true;
    problem.parameters[0].initial = TRUTH[0];
    let fit = solve(&problem);
    assert_eq!(fit.theta[0].to_bits(), TRUTH[0].to_bits());
    assert_eq!(
        (fit.free.clone(), fit.covariance.len(), fit.columns.len()),
        (vec![1, 2, 3], 9, 3)
    );
    // Three free parameters: chi-square(3) exceeds 24 once in 40,000.
    assert!(distance(&fit, &fit.theta, &TRUTH) < 24.0);
}

/// A prior a thousand times sharper than the data decides; one a thousand times broader
/// does nothing (it moves the optimum by 1e-6 of the distance to its mean).
#[test]
fn prior_pulls_as_hard_as_it_is_sharp() {
    let mut problem = arm_problem(7, SIGMA);
    let without = solve(&problem);
    let sigma = without.covariance[10].sqrt();
    let mean = 62.0;
    problem.parameters[2].prior = Some((mean, 1e-3 * sigma));
    let sharp = solve(&problem);
    let pulled = (sharp.theta[2] - mean).abs();
    assert!(
        pulled < 1e-5 * (mean - without.theta[2]).abs() + 1e-4 * sigma,
        "{}",
        sharp.theta[2]
    );
    problem.parameters[2].prior = Some((mean, 1e3 * sigma));
    let broad = solve(&problem);
    let moved = (broad.theta[2] - without.theta[2]).abs();
    assert!(
        moved < 1e-5 * (mean - without.theta[2]).abs() + 1e-3 * sigma,
        "{moved:.1e} {sigma:.1e}"
    );
}

/// One sample in 30 off by 1000 sigma either way: least squares is thrown off by about
/// sqrt(1e6 / 30) = 180 sigma, a Huber loss by its lower efficiency only (1.3 at most here).
#[test]
fn robust_loss_resists_outliers() {
    let mut problem = arm_problem(8, SIGMA);
    for record in problem.records.iter_mut().map(Arc::make_mut) {
        for (k, y) in record
            .target
            .iter_mut()
            .enumerate()
            .filter(|(k, _)| k % 30 == 7)
        {
            *y += if k % 4 == 1 { 1.0 } else { -1.0 };
        }
    }
    let plain = solve(&problem);
    for loss in [Loss::Huber(1.5), Loss::SoftL1(1.5)] {
        let robust = solve_with(
            &problem,
            FitOptions {
                loss,
                ..FitOptions::default()
            },
        );
        assert!(settled(&robust), "{:?}", robust.status);
        let off = distance(&robust, &robust.theta, &TRUTH);
        // chi-square(4) exceeds 27 once in 50,000; times the efficiency squared.
        assert!(off < 27.0 * 1.7, "{loss:?}: {off}");
        assert!(
            distance(&robust, &plain.theta, &TRUTH) > 100.0 * off.max(4.0),
            "{loss:?}: no outliers?"
        );
    }
}

/// Lazy columns stop within 1e-4 of the loss: the loss differs by no more, and the
/// parameters by no more than that many squared deviations.
#[test]
fn nuisance_parameters_reach_the_same_optimum() {
    let mut problem = arm_problem(9, SIGMA);
    let full = solve(&problem);
    problem.parameters[1].nuisance = true;
    problem.parameters[3].nuisance = true;
    let lazy = solve(&problem);
    assert!(settled(&lazy), "{:?}", lazy.status);
    let allowed = 1e-4 * full.loss;
    assert!(
        lazy.loss - full.loss < allowed,
        "{} {}",
        lazy.loss,
        full.loss
    );
    let off = distance(&full, &lazy.theta, &full.theta);
    assert!(off < allowed, "{off}");
}

/// Columns of an earlier fit save their computation and lead to the same place.
#[test]
fn warm_columns_are_used_and_checked() {
    let mut problem = arm_problem(9, SIGMA);
    problem.parameters[3].nuisance = true;
    let cold = solve(&problem);
    let warm = [(3, cold.columns[3].clone())];
    let again = fit(&problem, &problem.parameters, FitOptions::default(), &warm).expect("fit");
    assert!(distance(&cold, &again.theta, &cold.theta) < 1e-4 * cold.loss);
    let short = [(3, Column::new(vec![0.0; 5]))];
    let error =
        fit(&problem, &problem.parameters, FitOptions::default(), &short).expect_err("short");
    assert!(matches!(error, ProblemError::Invalid { field, .. } if field == "warm"));
}

/// A fit that may take no step ends where the problem is linearized.
#[test]
fn linearization_is_the_fit_before_its_first_step() {
    let mut problem = arm_problem(10, SIGMA);
    problem.parameters[1].frozen = true;
    problem.parameters[2].upper = problem.parameters[2].initial;
    for loss in [Loss::Squared, Loss::Huber(1.5)] {
        let options = FitOptions {
            max_iterations: 0,
            loss,
            ..FitOptions::default()
        };
        let fit = solve_with(&problem, options);
        let at = Linearization::new(&problem, &problem.parameters, loss, &[]).expect("holds");
        assert_eq!((fit.status.name(), fit.evaluations), ("max_iterations", 1));
        assert_eq!((at.theta, at.free), (fit.theta, fit.free));
        assert_eq!((at.residual, at.columns), (fit.residual, fit.columns));
        assert_eq!((at.at_bound, fit.at_bound), (vec![2], vec![2]));
        assert_eq!(at.loss.to_bits(), fit.loss.to_bits());
        for (a, b) in at.blocks.iter().zip(&fit.blocks) {
            assert_eq!((&a.matrix, &a.gradient), (&b.matrix, &b.gradient));
        }
    }
}

/// A column that is handed over is neither computed nor changed.
#[test]
fn linearization_takes_warm_columns_over() {
    let problem = arm_problem(10, SIGMA);
    let parameters = &problem.parameters;
    let cold = Linearization::new(&problem, parameters, Loss::Squared, &[]).expect("holds");
    let other = Column::new(vec![7.0; cold.residual.len()]);
    let warm = [(2, other.clone())];
    let at = Linearization::new(&problem, parameters, Loss::Squared, &warm).expect("holds");
    assert_eq!(at.columns[2], other);
    // Weighted in pairs, as real and imaginary parts of one transform: another partner, other
    // rounding, some 1e-16 of the largest entry of either.
    let change = relative(&at.columns[3], &cold.columns[3]);
    assert!(change < 1e-12, "{change:.1e}");
    let short = [(2, Column::new(vec![7.0; 5]))];
    let error = Linearization::new(&problem, parameters, Loss::Squared, &short).expect_err("short");
    assert!(matches!(error, ProblemError::Invalid { field, .. } if field == "warm"));
}

#[test]
fn misuse_names_the_field() {
    let good = arm_problem(1, SIGMA);
    let field = |problem: &SimulationErrorProblem| match problem.validate() {
        Err(ProblemError::Invalid { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    assert_eq!(
        field(&SimulationErrorProblem {
            records: vec![],
            ..good.clone()
        }),
        "records"
    );
    assert_eq!(
        field(&SimulationErrorProblem {
            weighting: vec![],
            ..good.clone()
        }),
        "weighting"
    );
    let mut bad = good.clone();
    Arc::make_mut(&mut bad.records[1]).target[7] = f64::NAN;
    assert_eq!(field(&bad), "records[1]");
    Arc::make_mut(&mut bad.records[1]).target.pop();
    assert_eq!(field(&bad), "records[1]");
    let mut bad = good.clone();
    Arc::make_mut(&mut bad.records[0]).lead = SAMPLES;
    assert_eq!(field(&bad), "records[0].lead");
    let first = Arc::make_mut(&mut bad.records[0]);
    first.lead = 10;
    first.certainty = Some(vec![1.0; SAMPLES]);
    assert_eq!(field(&bad), "records[0].certainty");
    let mut bad = good.clone();
    bad.parameters[2].scale = 0.0;
    let error = fit(&good, &bad.parameters, FitOptions::default(), &[]).expect_err("scale");
    assert!(matches!(error, ProblemError::Invalid { field, .. } if field == "parameters[2]"));
}

#[test]
fn cancelled_fit_stops() {
    let mut problem = arm_problem(1, SIGMA);
    problem.cancel = Some(Arc::new(std::sync::atomic::AtomicBool::new(true)));
    let outcome = fit(&problem, &problem.parameters, FitOptions::default(), &[]);
    assert!(matches!(outcome, Err(ProblemError::Cancelled)));
}
