//! Recursive filters against their difference equation, sample by sample.

use axisight_numerics::recursion::{filter, states};

/// `y[t]` by the equation, from all earlier samples.
fn by_definition(above: &[f64], below: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y: Vec<f64> = Vec::new();
    for t in 0..x.len() {
        let lagged = |of: &[f64], from: usize, factors: &[f64]| -> f64 {
            let lags = from..factors.len().min(t + 1);
            lags.map(|lag| factors[lag] * of[t - lag]).sum()
        };
        let (right, left) = (lagged(x, 0, above), lagged(&y, 1, below));
        y.push((right - left) / below[0]);
    }
    y
}

#[test]
fn each_signal_solves_the_difference_equation() {
    let x: Vec<f64> = (0..60).map(|i| f64::from(i * 37 % 23) - 11.0).collect();
    let factors: [(&[f64], &[f64]); 4] = [
        (&[0.2, 0.4, 0.2], &[2.0, -1.1, 0.3]),
        (&[1.0], &[1.0, -0.9]),
        (&[0.5, -0.5, 0.25, 0.1], &[4.0]),
        (&[3.0], &[2.0]),
    ];
    for (above, below) in factors {
        let wanted = by_definition(above, below, &x);
        // Two signals side by side, the second reversed.
        let mut both: Vec<f64> = (0..60).flat_map(|t| [x[t], x[59 - t]]).collect();
        filter(above, below, &mut both, 2);
        let reversed: Vec<f64> = x.iter().rev().copied().collect();
        let other = by_definition(above, below, &reversed);
        for t in 0..60 {
            assert!((both[2 * t] - wanted[t]).abs() < 1e-12 * 60.0);
            assert!((both[2 * t + 1] - other[t]).abs() < 1e-12 * 60.0);
        }
    }
}

#[test]
fn states_are_those_of_each_step() {
    let a = [0.5, -0.3, 0.2, 0.9];
    let start = [1.0, 0.0, 2.0, -1.0, 0.5, 3.0];
    let drive: Vec<f64> = (0..60).map(|i| f64::from(i * 37 % 23) - 11.0).collect();
    let found = states(&a, &drive, &start, 2);
    assert_eq!(found.len(), 66);
    assert_eq!(found[..6], start);
    for t in 0..10 {
        for (state, row) in a.chunks(2).enumerate() {
            for column in 0..3 {
                let at = |sample: usize, i: usize| found[sample * 6 + i * 3 + column];
                let wanted =
                    drive[t * 6 + state * 3 + column] + row[0] * at(t, 0) + row[1] * at(t, 1);
                assert!((at(t + 1, state) - wanted).abs() < 1e-12 * 60.0);
            }
        }
    }
    assert_eq!(states(&[], &[], &[], 0), Vec::<f64>::new());
}
