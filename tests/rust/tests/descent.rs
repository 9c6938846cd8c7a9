//! Searches whose end is known in closed form.

mod least_squares;

use axisight_numerics::descent::{
    Bounded, Damping, Limits, Normal, Progress, Reach, Rules, Status, search,
};
use least_squares::{Model, Rows, normal, run, wide};
use nalgebra::{DMatrix, DVector};

const CONSTANT: Damping = Damping::Constant {
    start: 1e-3,
    shrink: 0.2,
    grow: 8.0,
    least: 1e-12,
    failures: 8,
};

/// The rules of the axis fit, and those of the fit to logs.
const RULES: [Rules; 2] = [
    Rules {
        max_iterations: 100,
        loss_tolerance: 1e-14,
        progress: Progress::Promised,
        step_tolerance: 1e-10,
        rounding: 1e-28,
        settled: 1e-6,
        damping: Damping::KEPT,
    },
    Rules {
        max_iterations: 100,
        loss_tolerance: 1e-14,
        progress: Progress::Gained { always: false },
        step_tolerance: 1e-10,
        rounding: 1e-28,
        settled: 1e-6,
        damping: CONSTANT,
    },
];

// Residuals 10 (y - x^2) and 1 - x.
#[allow(clippy::unnecessary_wraps)] // a model may not hold
fn rosenbrock(t: &[f64]) -> Rows {
    let residual = vec![10.0 * (t[1] - t[0] * t[0]), 1.0 - t[0]];
    Some((residual, vec![vec![-20.0 * t[0], 10.0], vec![-1.0, 0.0]]))
}

/// Three points on a line that is none: closed form by Cramer's rule.
#[allow(clippy::unnecessary_wraps)]
fn line(t: &[f64]) -> Rows {
    let points = [(0.0, 1.0), (1.0, 2.0), (2.0, 5.0)];
    let residual = points.map(|(x, y)| t[0] + t[1] * x - y).to_vec();
    Some((residual, points.map(|(x, _)| vec![1.0, x]).to_vec()))
}

#[test]
fn rosenbrock_ends_in_its_valley() {
    for rules in &RULES {
        let start = [-1.2, 1.0];
        let mut model = Model::new(rosenbrock, &start);
        let (outcome, theta) = run(&mut model, &wide(2), rules, &start);
        assert!(outcome.status.converged(), "{:?}", outcome.status);
        assert!((theta[0] - 1.0).abs() < 1e-9 && (theta[1] - 1.0).abs() < 1e-9);
        assert_eq!(outcome.iterations + model.rejected, model.trials);
    }
}

/// With x held back at 1/2 the best y is 1/4; x presses on its bound and nothing else does. Steps
/// worth less than 1e-14 of the loss of 1/4 are not tried: with a curvature of 100 that is 5e-9.
#[test]
fn bound_holds_the_parameter_and_frees_the_others() {
    for rules in &RULES {
        let start = [-1.2, 1.0];
        let mut model = Model::new(rosenbrock, &start);
        let mut limits = wide(2);
        limits.upper[0] = 0.5;
        let (outcome, theta) = run(&mut model, &limits, rules, &start);
        assert!(outcome.status.converged(), "{:?}", outcome.status);
        assert_eq!((theta[0], limits.at_bound(&theta)), (0.5, vec![0]));
        assert!((theta[1] - 0.25).abs() < 1e-8 && (model.normal.loss - 0.25).abs() < 1e-12);
        let g = &model.normal.gradient;
        assert!(g[0] < -0.1 && g[1].abs() < 1e-6, "{g}");
    }
}

/// The line with its intercept kept at one and above: `slope = 9 / 5` by its own normal
/// equation. Projecting the free minimum (2/3, 2) would keep the slope of 2.
#[test]
fn active_bound_satisfies_the_optimality_conditions() {
    for rules in &RULES {
        let start = [1.0, 0.0];
        let mut model = Model::new(line, &start);
        let mut limits = wide(2);
        limits.lower[0] = 1.0;
        let (outcome, theta) = run(&mut model, &limits, rules, &start);
        assert!(outcome.status.converged(), "{:?}", outcome.status);
        assert!(
            theta[0] == 1.0 && (theta[1] - 1.8).abs() < 1e-7,
            "{theta:?}"
        );
        let g = &model.normal.gradient;
        assert!(g[0] > 0.1 && g[1].abs() < 1e-6, "{g}");
    }
}

#[test]
fn undamped_linear_problem_takes_one_step() {
    let undamped = Damping::Constant {
        start: 0.0,
        shrink: 0.2,
        grow: 8.0,
        least: 0.0,
        failures: 8,
    };
    let rules = Rules {
        damping: undamped,
        ..RULES[0]
    };
    let start = [-7.0, 11.0];
    let mut model = Model::new(line, &start);
    let (outcome, theta) = run(&mut model, &wide(2), &rules, &start);
    assert_eq!((outcome.iterations, model.trials), (1, 1));
    assert_eq!(outcome.status, Status::LossConverged);
    assert!((theta[0] - 2.0 / 3.0).abs() < 1e-13 && (theta[1] - 2.0).abs() < 1e-13);
}

/// From 5 the step of ln x leads to 5 - 5 ln 5 = -3, where there is no logarithm.
#[test]
fn model_that_fails_at_a_trial_is_tried_closer() {
    for rules in &RULES {
        let start = [5.0];
        let log = |t: &[f64]| (t[0] > 0.0).then(|| (vec![t[0].ln()], vec![vec![1.0 / t[0]]]));
        let mut model = Model::new(log, &start);
        let (outcome, theta) = run(&mut model, &wide(1), rules, &start);
        assert!(outcome.status.converged(), "{:?}", outcome.status);
        assert!((theta[0] - 1.0).abs() < 1e-9);
        assert!(model.trials > outcome.iterations + model.rejected);
    }
}

/// A residual that is not a number is no lower loss.
#[test]
fn chaotic_trial_is_not_accepted() {
    for rules in &RULES {
        let start = [5.0];
        let mut model = Model::new(|t| Some((vec![t[0].ln()], vec![vec![1.0 / t[0]]])), &start);
        let (_, theta) = run(&mut model, &wide(1), rules, &start);
        assert!((theta[0] - 1.0).abs() < 1e-9);
    }
}

#[test]
fn cancelled_search_says_so_and_stays_where_it_was() {
    for rules in &RULES {
        let start = [-1.2, 1.0];
        let mut model = Model::new(rosenbrock, &start);
        model.cancel_at = 1;
        let limits = wide(2);
        let mut descent = Bounded::new(&mut model, &limits, start.to_vec());
        assert_eq!(search(&mut descent, rules), Err("cancelled"));
        assert_eq!(descent.into_theta(), start);
    }
}

/// Every step of a wrong slope leads uphill: given up after the failures of the rule, with the
/// memory of every trial handed back.
#[test]
fn wrong_slope_stalls() {
    // The seventh step of the rule that doubles its growth is lost in rounding.
    for (rules, failures) in RULES.iter().zip([7, 9]) {
        let rules = Rules {
            step_tolerance: 0.0,
            ..*rules
        };
        let start = [2.0];
        let mut model = Model::new(|t| Some((vec![t[0]], vec![vec![-1.0]])), &start);
        let (outcome, theta) = run(&mut model, &wide(1), &rules, &start);
        assert_eq!((outcome.status, theta[0]), (Status::Stalled, 2.0));
        assert_eq!((model.trials, model.rejected), (failures, failures));
        assert_eq!(outcome.iterations, 0);
    }
}

/// A step made short by damping is no minimum.
#[test]
fn short_steps_of_a_wrong_slope_are_not_taken_for_convergence() {
    for rules in &RULES {
        let rules = Rules {
            step_tolerance: 1e-3,
            ..*rules
        };
        let start = [2.0];
        let mut model = Model::new(|t| Some((vec![t[0]], vec![vec![-1.0]])), &start);
        let (outcome, _) = run(&mut model, &wide(1), &rules, &start);
        assert_eq!(outcome.status, Status::Stalled);
    }
}

/// A loss that rises by a kink wherever one goes, although its slope promises a little.
#[test]
fn little_promise_that_nothing_keeps_is_settled() {
    for rules in &RULES {
        let rules = Rules {
            settled: 1e-3,
            step_tolerance: 0.0,
            ..*rules
        };
        let start = [1e-2];
        let kinked = |t: &[f64]| {
            let kink = if t[0] == 1e-2 { 0.0 } else { 1e-3 };
            Some((vec![t[0], 1.0 + kink], vec![vec![1.0], vec![0.0]]))
        };
        let mut model = Model::new(kinked, &start);
        let (outcome, _) = run(&mut model, &wide(1), &rules, &start);
        assert_eq!(outcome.status, Status::LossConverged);
    }
}

/// After a failure, a shorter step that would gain too little if it kept its promise is not tried.
#[test]
fn short_steps_that_promise_too_little_are_not_tried() {
    let rules = Rules {
        progress: Progress::Gained { always: false },
        loss_tolerance: 0.1,
        settled: 0.1,
        step_tolerance: 0.0,
        ..RULES[1]
    };
    // 1 + t^2 at 0.5 promises 0.25 (1 - (d / (1 + d))^2) at damping d: nearly as much at 0.001, 0.008,
    // 0.064 and 0.512, less than a tenth of the loss at 4.1.
    let start = [0.5];
    let kinked = |t: &[f64]| {
        let kink = if t[0] == 0.5 { 0.0 } else { 1.0 };
        Some((vec![t[0], 1.0 + kink], vec![vec![1.0], vec![0.0]]))
    };
    let mut model = Model::new(kinked, &start);
    let (outcome, theta) = run(&mut model, &wide(1), &rules, &start);
    assert_eq!((outcome.status, theta[0]), (Status::Stalled, 0.5));
    assert_eq!(model.trials, 1);
}

/// After a failure, what is tried next promises half as much at most: a hardly shorter step would fail
/// as the first did.
#[test]
fn step_like_one_that_failed_is_not_tried() {
    for rules in &RULES {
        let tried = std::cell::RefCell::new(Vec::new());
        let start = [2.0];
        // Downhill by half a unit only.
        let narrow = |t: &[f64]| {
            tried.borrow_mut().push(t[0]);
            let wall = if t[0] < 1.5 { 3.0 * (1.5 - t[0]) } else { 0.0 };
            Some((vec![t[0] + wall], vec![vec![1.0]]))
        };
        let mut model = Model::new(narrow, &start);
        let rules = Rules {
            max_iterations: 1,
            ..*rules
        };
        run(&mut model, &wide(1), &rules, &start);
        let tried = tried.into_inner();
        // By the linear model 4 - t^2.
        let promises: Vec<f64> = tried[1..].iter().map(|t| 4.0 - t * t).collect();
        assert!(promises.len() > 1, "one failed");
        assert!(
            promises.windows(2).all(|p| p[1] <= 0.5 * p[0]),
            "{promises:?}"
        );
    }
}

/// Where a step half as long fails by as much as the whole, the loss is rough, and the search is over.
#[test]
fn rough_ground_ends_the_search() {
    for rules in &RULES {
        let start = [2.0];
        let rough = |t: &[f64]| {
            let height = if t[0] == 2.0 { 0.0 } else { 5.0 };
            Some((vec![t[0], height], vec![vec![1.0], vec![0.0]]))
        };
        let mut model = Model::new(rough, &start);
        let (outcome, theta) = run(&mut model, &wide(1), rules, &start);
        assert_eq!((outcome.status, theta[0]), (Status::Stalled, 2.0));
        assert_eq!(model.trials, 2);
    }
}

/// The second parameter does nothing; the first arrives.
#[test]
fn parameter_without_influence_stays() {
    for rules in &RULES {
        let start = [3.0, 0.7];
        let cubic =
            |t: &[f64]| Some((vec![t[0].powi(3) - 1.0], vec![vec![3.0 * t[0] * t[0], 0.0]]));
        let mut model = Model::new(cubic, &start);
        let (_, theta) = run(&mut model, &wide(2), rules, &start);
        assert!((theta[0] - 1.0).abs() < 1e-9 && theta[1] == 0.7);
    }
}

/// Two columns that are the same: without damping there is no step, so more is needed, and no
/// trial is spent on finding out.
#[test]
fn singular_matrix_is_damped_until_it_can_be_solved() {
    let rules = Rules {
        damping: Damping::Constant {
            start: 1e-17,
            shrink: 0.2,
            grow: 1e4,
            least: 1e-17,
            failures: 8,
        },
        ..RULES[1]
    };
    let start = [2.0, 3.0];
    let sum = |t: &[f64]| Some((vec![t[0] + t[1] - 1.0], vec![vec![1.0, 1.0]]));
    let mut model = Model::new(sum, &start);
    let (outcome, theta) = run(&mut model, &wide(2), &rules, &start);
    assert!(outcome.status.converged(), "{:?}", outcome.status);
    assert!((theta[0] + theta[1] - 1.0).abs() < 1e-12);
    assert!((theta[0] - theta[1] + 1.0).abs() < 1e-2, "shared alike");
    assert_eq!(model.rejected, 0);
}

#[test]
fn iterations_and_exact_residuals_end_the_search() {
    for rules in &RULES {
        for (most, status) in [(0, Status::MaxIterations), (1, Status::MaxIterations)] {
            let rules = Rules {
                max_iterations: most,
                ..*rules
            };
            let start = [-1.2, 1.0];
            let mut model = Model::new(rosenbrock, &start);
            let (outcome, _) = run(&mut model, &wide(2), &rules, &start);
            assert_eq!((outcome.status, outcome.iterations), (status, most));
            assert!(most > 0 || model.trials == 0);
        }
        let mut model = Model::new(rosenbrock, &[1.0, 1.0]);
        let (outcome, _) = run(&mut model, &wide(2), rules, &[1.0, 1.0]);
        assert_eq!((outcome.status, model.trials), (Status::Exact, 0));
    }
}

/// Nothing to search for is no error.
#[test]
fn no_parameters_are_at_rest() {
    for rules in &RULES {
        let mut model = Model::new(|_| Some((vec![2.0], vec![vec![]])), &[]);
        let (outcome, _) = run(&mut model, &wide(0), rules, &[]);
        assert!(outcome.status.converged(), "{:?}", outcome.status);
        assert_eq!(model.trials, 0);
    }
}

/// The step of 1 - exp(-x) from 4 is `1 - e^4`, 53 long.
#[test]
fn reach_shortens_a_step() {
    let first = |reach: Reach, lower: f64| {
        let rules = Rules {
            max_iterations: 1,
            ..RULES[0]
        };
        let flat = |t: &[f64]| Some((vec![1.0 - (-t[0]).exp()], vec![vec![(-t[0]).exp()]]));
        let mut model = Model::new(flat, &[4.0]);
        let limits = Limits {
            lower: vec![lower],
            scale: vec![0.5],
            reach,
            ..wide(1)
        };
        run(&mut model, &limits, &rules, &[4.0]).1[0]
    };
    assert_eq!(
        first(Reach::Scales(1.0), -100.0).to_bits(),
        3.5_f64.to_bits()
    );
    assert_eq!(first(Reach::Factor(5.0), 0.0).to_bits(), 0.8_f64.to_bits());
    // A parameter that may be negative is not held back by a factor.
    let free = first(Reach::Bounds, -100.0).to_bits();
    assert_eq!(first(Reach::Factor(5.0), -100.0).to_bits(), free);
}

#[test]
fn prior_counts_as_one_more_residual() {
    let mut with = Normal::zero(1);
    with.add_prior(0, 0.6, 0.5);
    let prior = normal((vec![0.6 / 0.5], vec![vec![1.0 / 0.5]]), 1);
    assert!((with.loss - prior.loss).abs() < 1e-15);
    assert!((with.gradient[0] - prior.gradient[0]).abs() < 1e-15);
    assert!((with.matrix[(0, 0)] - prior.matrix[(0, 0)]).abs() < 1e-15);
    // To the mean, all of it.
    assert!((with.promise(&[-0.6]) - prior.loss).abs() < 1e-15);
    let sum = Normal {
        loss: 2.0 * prior.loss,
        gradient: &prior.gradient * 2.0,
        matrix: &prior.matrix * 2.0,
    };
    with.add(&prior);
    assert!((with.promise(&[0.3]) - sum.promise(&[0.3])).abs() < 1e-14);
}

#[test]
fn advice_is_for_searches_that_did_not_arrive() {
    let advised = Status::ALL.iter().filter(|s| !s.converged());
    let names: Vec<&str> = advised.map(|s| s.name()).collect();
    assert_eq!(names, ["max_iterations", "stalled"]);
}

/// A valley that leads far beyond a bound: the constrained minimum is one step away, where what
/// makes up for the parameter on the bound is found anew. Cut to the bound, the step of both is uphill.
#[test]
fn step_beyond_a_bound_is_found_anew_on_it() {
    let rows = |t: &[f64]| {
        let (x, y) = (t[0], t[1]);
        let residual = vec![x + y - 10.0, 0.1 * (y - 100.0)];
        Some((residual, vec![vec![1.0, 1.0], vec![0.0, 0.1]]))
    };
    let limits = Limits {
        upper: vec![f64::INFINITY, 2.0],
        ..wide(2)
    };
    for rules in &RULES {
        let start = [8.2, 1.8];
        let mut model = Model::new(rows, &start);
        let (outcome, theta) = run(&mut model, &limits, rules, &start);
        assert!((theta[0] - 8.0).abs() < 1e-4, "{theta:?}");
        assert_eq!(theta[1], 2.0);
        assert!(outcome.iterations <= 4, "{outcome:?}");
    }
}

/// Least loss of a linear problem within bounds, by every set of parameters that may lie on one.
fn least_within(jacobian: &DMatrix<f64>, target: &DVector<f64>, bound: f64) -> f64 {
    let n = jacobian.ncols();
    let sets = 3_usize.pow(u32::try_from(n).expect("few"));
    let losses = (0..sets).filter_map(|set| {
        // Digit 0: free; 1, 2: on the lower or the upper bound.
        let digit = |i: usize| set / 3_usize.pow(u32::try_from(i).expect("few")) % 3;
        let held = DVector::from_fn(n, |i, _| [0.0, -bound, bound][digit(i)]);
        let free: Vec<usize> = (0..n).filter(|i| digit(*i) == 0).collect();
        let columns = jacobian.select_columns(&free);
        let left = target - jacobian * &held;
        let mut theta = held;
        if !free.is_empty() {
            let found =
                (columns.transpose() * &columns).try_inverse()? * columns.transpose() * left;
            free.iter()
                .zip(found.iter())
                .for_each(|(i, x)| theta[*i] = *x);
        }
        let inside = theta.iter().all(|x| x.abs() <= bound + 1e-9);
        inside.then(|| (jacobian * theta - target).norm_squared())
    });
    losses.fold(f64::INFINITY, f64::min)
}

/// Columns that look alike push one another over their bounds and back: one step ends where the
/// loss is least within them. Where what is held once is held for good more is left.
#[test]
fn a_step_of_a_linear_problem_ends_at_the_least_within_bounds() {
    let mut x = 0.3_f64;
    let mut random = || {
        x = (9301.0 * x + 0.49297).fract();
        x - 0.5
    };
    for _ in 0..50 {
        let common: Vec<f64> = (0..12).map(|_| random()).collect();
        let jacobian = DMatrix::from_fn(12, 5, |i, _| common[i] + 0.3 * random());
        let target = DVector::from_fn(12, |i, _| common[i] + random());
        let rows = |t: &[f64]| {
            let residual = &jacobian * DVector::from_column_slice(t) - &target;
            let rows = jacobian.row_iter().map(|r| r.iter().copied().collect());
            Some((residual.as_slice().to_vec(), rows.collect()))
        };
        let limits = Limits {
            lower: vec![-0.4; 5],
            upper: vec![0.4; 5],
            ..wide(5)
        };
        let rules = Rules {
            max_iterations: 1,
            damping: Damping::Constant {
                start: 1e-12,
                shrink: 0.2,
                grow: 8.0,
                least: 1e-12,
                failures: 0,
            },
            ..RULES[1]
        };
        let start = [0.0; 5];
        let mut model = Model::new(rows, &start);
        let (_, theta) = run(&mut model, &limits, &rules, &start);
        let (residual, _) = rows(&theta).expect("always holds");
        let loss: f64 = residual.iter().map(|r| r * r).sum();
        let least = least_within(&jacobian, &target, 0.4);
        assert!(loss <= least * (1.0 + 1e-9), "{loss} {least}");
    }
}

/// A step that promises less than it would have to gain is not tried.
#[test]
fn what_promises_too_little_costs_no_trial() {
    let start = [0.0, 1.0];
    let mut model = Model::new(line, &start);
    let rules = Rules {
        loss_tolerance: 0.1,
        ..RULES[1]
    };
    let (outcome, theta) = run(&mut model, &wide(2), &rules, &start);
    // One step takes a linear problem to its end.
    assert_eq!(outcome.iterations, 1);
    assert_eq!(model.trials, 1, "{theta:?}");
    let (again, _) = run(&mut model, &wide(2), &rules, &theta);
    assert_eq!(again.iterations, 0);
    assert_eq!(model.trials, 1);
    assert!(again.status.converged());
}

/// A sum that is known a thousand times better than the difference: damping in units of the
/// curvature holds the difference back, and what is left of a step promises next to nothing.
#[test]
fn damping_is_not_taken_for_a_minimum() {
    #[allow(clippy::unnecessary_wraps)]
    fn valley(t: &[f64]) -> Rows {
        let residual = vec![1e3 * (t[0] + t[1] - 2.0), t[0] - t[1] - 1.0, 30.0];
        let rows = vec![vec![1e3, 1e3], vec![1.0, -1.0], vec![0.0, 0.0]];
        Some((residual, rows))
    }
    let start = [1.0, 1.0];
    let rules = Rules {
        loss_tolerance: 1e-5,
        ..RULES[1]
    };
    let mut model = Model::new(valley, &start);
    let (outcome, theta) = run(&mut model, &wide(2), &rules, &start);
    assert!(outcome.status.converged(), "{:?}", outcome.status);
    // A step has to be worth 1e-5 of a loss of 901: a tenth of the difference.
    assert!((theta[0] - theta[1] - 1.0).abs() < 0.1, "{theta:?}");
}

/// A resonance `w = sqrt(k / m)` [rad/s] is known, and `m` a hundred times worse. In logarithms the
/// problem is linear, so that the search ends at the minimum from any positive start. Starts that are
/// wrong by the factor `f` need at least `log2 f` steps, as no step changes a parameter by more than
/// two.
#[test]
fn logarithms_end_at_the_minimum_from_afar_and_never_step_further_than_a_factor_of_two() {
    #[allow(clippy::unnecessary_wraps)]
    fn resonance(t: &[f64]) -> Rows {
        let [k, m] = [t[0], t[1]];
        let residual = vec![100.0 * (k / m / 4.0).ln(), (m / 0.5).ln()];
        Some((
            residual,
            vec![vec![100.0 / k, -100.0 / m], vec![0.0, 1.0 / m]],
        ))
    }
    let limits = Limits {
        lower: vec![1e-9; 2],
        logarithmic: vec![true; 2],
        ..wide(2)
    };
    for damping in [CONSTANT, Damping::Kept { start: 1.0 }] {
        for start in [[200.0, 0.5], [0.02, 30.0], [1e-3, 1e-3]] {
            let rules = Rules {
                damping,
                ..RULES[1]
            };
            let mut model = Model::new(resonance, &start);
            let (outcome, theta) = run(&mut model, &limits, &rules, &start);
            assert!(outcome.status.converged(), "{:?}", outcome.status);
            assert!(
                (theta[0] - 2.0).abs() < 1e-5 && (theta[1] - 0.5).abs() < 1e-6,
                "{theta:?}"
            );
            let far = (start[0] / 2.0_f64).log2().abs();
            assert!(
                outcome.iterations as f64 >= far,
                "{} {far}",
                outcome.iterations
            );
        }
    }
}
