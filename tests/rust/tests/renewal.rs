//! Columns are computed anew where that may lead further, and nowhere else.

use axisight_identification::logs::{
    Block, Column, Evaluation, Fit, FitOptions, FitParameter, Problem, ProblemError, Target, fit,
};
use axisight_numerics::descent::Status;
use axisight_tests::free;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The residual is the parameter, with a step up wherever that is not 2: all steps fail alike.
#[derive(Default)]
struct Rough {
    evaluations: AtomicUsize,
}

impl Problem for Rough {
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError> {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let at_start = (theta[0] - 2.0).abs() < f64::EPSILON;
        Ok(Evaluation::new(
            vec![theta[0], if at_start { 0.0 } else { 5.0 }],
            columns.iter().map(|_| vec![1.0, 0.0]).collect(),
        ))
    }

    fn blocks(&self) -> Vec<Block> {
        vec![Block {
            record: 0,
            axis: 0,
            start: 0,
            len: 2,
        }]
    }
}

fn fitted(warm: &[(usize, Column)], nuisance_refreshes: usize) -> (Fit, usize) {
    let parameters = [FitParameter {
        nuisance: true,
        ..free(Target::Effect(0, 0), 2.0, 1.0)
    }];
    let options = FitOptions {
        nuisance_refreshes,
        ..FitOptions::default()
    };
    let problem = Rough::default();
    let found = fit(&problem, &parameters, options, warm).expect("a fit");
    (found, problem.evaluations.into_inner())
}

/// The point with its columns, and two trials.
#[test]
fn columns_are_not_computed_twice_at_one_point() {
    let (found, evaluations) = fitted(&[], 3);
    assert_eq!((found.status, found.theta[0]), (Status::Stalled, 2.0));
    assert_eq!(evaluations, 3);
    assert!(found.up_to_date);
}

/// The same by a column from elsewhere, and again by one of its own.
#[test]
fn columns_from_elsewhere_are_renewed_once() {
    let (found, evaluations) = fitted(&[(0, Column::new(vec![1.0, 0.0]))], 3);
    assert_eq!((found.status, found.theta[0]), (Status::Stalled, 2.0));
    assert_eq!(evaluations, 6);
    assert!(found.up_to_date);
}

#[test]
fn columns_from_elsewhere_are_not_up_to_date() {
    let (found, _) = fitted(&[(0, Column::new(vec![1.0, 0.0]))], 0);
    assert!(!found.up_to_date);
}
