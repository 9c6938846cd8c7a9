//! Classical Runge-Kutta method of order 4 (Kutta 1901).

use super::method::{Interval, Stepper};
use super::torque_path::Line;
use crate::scalar::Scalar;

/// One step of length `h` [s].
pub(super) fn step<S: Scalar>(
    interval: &Interval<'_, S>,
    x: &mut [S],
    h: f64,
    lines: &[Line<S>],
    stepper: &mut Stepper<S>,
) {
    stepper.steps += 1;
    stepper.probe.copy_from_slice(x);
    stepper.stage(interval.plant, 0, 0.0, lines, interval.command);
    for (stage, at) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
        for i in 0..x.len() {
            stepper.probe[i] = x[i] + stepper.stages[stage - 1][i] * (h * at);
        }
        stepper.stage(interval.plant, stage, at, lines, interval.command);
    }
    let k = &stepper.stages;
    for i in 0..x.len() {
        x[i] += (k[0][i] + (k[1][i] + k[2][i]) * 2.0 + k[3][i]) * (h / 6.0);
    }
}
