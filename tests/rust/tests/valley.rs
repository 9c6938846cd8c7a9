//! A size and a shape that make up for each other: the valley is followed, not crept along.

use axisight_identification::logs::{
    Block, Evaluation, Fit, FitOptions, FitParameter, Problem, ProblemError, Target, fit,
};
use axisight_tests::free;

/// A mass `m` at `x`: its moment `m x` is known well, the mass itself a thousand times worse.
struct Load;

const TRUTH: [f64; 2] = [140.0, 0.95];
const KNOWN: [f64; 2] = [1e-3, 1.0];

impl Problem for Load {
    fn evaluate(&self, theta: &[f64], columns: &[usize]) -> Result<Evaluation, ProblemError> {
        let [m, x] = [theta[0], theta[1]];
        let residual = vec![
            KNOWN[0] * (m - TRUTH[0]),
            KNOWN[1] * (m * x - TRUTH[0] * TRUTH[1]),
        ];
        let all = [vec![KNOWN[0], KNOWN[1] * x], vec![0.0, KNOWN[1] * m]];
        let columns = columns.iter().map(|i| all[*i].clone()).collect();
        Ok(Evaluation::new(residual, columns))
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

fn fitted(amplitude: Option<usize>) -> Fit {
    let start = [50.0, TRUTH[0] * TRUTH[1] / 50.0];
    let place = FitParameter {
        amplitude,
        ..free(Target::Effect(0, 1), start[1], 0.5)
    };
    let parameters = [free(Target::Effect(0, 0), start[0], 30.0), place];
    fit(&Load, &parameters, FitOptions::default(), &[]).expect("a fit")
}

#[test]
fn a_shape_that_knows_its_size_follows_the_valley() {
    let (known, unknown) = (fitted(Some(0)), fitted(None));
    for (got, want) in known.theta.iter().zip(TRUTH) {
        assert!((got - want).abs() < 1e-6 * want, "{got} {want}");
    }
    // In moments the problem is linear, so that damping alone makes more than one step of it: it
    // falls by five each from a thousandth to the square of what the mass is known worse by.
    assert!(known.evaluations <= 15, "{}", known.evaluations);
    // Without, bending steps end short of it.
    assert!(
        (unknown.theta[0] - TRUTH[0]).abs() > 1.0,
        "{:?}",
        unknown.theta
    );
}
