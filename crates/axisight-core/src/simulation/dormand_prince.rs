//! Dormand-Prince 5(4) pair (Dormand, Prince 1980, J. Comput. Appl. Math. 6(1)).

use super::method::{Interval, Stepper};
use super::torque_path::Line;
use crate::scalar::Scalar;

/// Stages, the last one for the error estimate only.
pub(super) const STAGES: usize = 7;

const NODE: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
const WEIGHT: [[f64; 6]; STAGES] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
/// Difference between the fifth- and fourth-order weights.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// States smaller than this [rad, rad/s] are held to an absolute error.
const SMALLEST_STATE: f64 = 1e-3;

/// One step of length `h` [s]; returns the largest local error relative to the state.
pub(super) fn step<S: Scalar>(
    interval: &Interval<'_, S>,
    x: &mut [S],
    h: f64,
    lines: &[Line<S>],
    stepper: &mut Stepper<S>,
) -> f64 {
    stepper.steps += 1;
    for stage in 0..STAGES {
        for i in 0..x.len() {
            let mut sum = x[i];
            for (j, weight) in WEIGHT[stage].iter().enumerate().take(stage) {
                if *weight != 0.0 {
                    sum += stepper.stages[j][i] * (weight * h);
                }
            }
            stepper.probe[i] = sum;
        }
        stepper.stage(interval.plant, stage, NODE[stage], lines, interval.command);
    }
    let mut worst: f64 = 0.0;
    for i in 0..x.len() {
        let mut error = S::zero();
        for (stage, weight) in stepper.stages.iter().zip(&ERROR) {
            if *weight != 0.0 {
                error += stage[i] * (weight * h);
            }
        }
        // The last probe is the fifth-order solution.
        x[i] = stepper.probe[i];
        for lane in 0..S::LANES {
            let size = x[i].lane(lane).abs().max(SMALLEST_STATE);
            let relative = error.lane(lane).abs() / size;
            worst = if relative.is_nan() {
                f64::NAN
            } else {
                worst.max(relative)
            };
            if worst.is_nan() {
                return worst;
            }
        }
    }
    worst
}
