//! Classical Runge-Kutta method of order 4 (Kutta 1901).

use super::method::{Interval, Stepper};
use super::torque_path::Line;
use axisight_scalar::Scalar;

/// One step of length `h` [s].
pub(super) fn step<S: Scalar>(
    interval: &Interval<'_, S>,
    x: &mut [S],
    h: f64,
    lines: &[Line<S>],
    stepper: &mut Stepper<S>,
) {
    stepper.effort.steps += 1;
    stepper.probe.copy_from_slice(x);
    stepper.stage(interval.plant, 0, 0.0, lines, interval.command);
    for (stage, at) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
        let slopes = &stepper.stages[stage - 1];
        let width = S::constant(h * at);
        for ((p, x), k) in stepper.probe.iter_mut().zip(&*x).zip(slopes) {
            *p = k.fma(width, *x);
        }
        stepper.stage(interval.plant, stage, at, lines, interval.command);
    }
    let [k1, k2, k3, k4, ..] = &stepper.stages[..] else {
        return;
    };
    let (two, sixth) = (S::constant(2.0), S::constant(h / 6.0));
    for ((((x, k1), k2), k3), k4) in x.iter_mut().zip(k1).zip(k2).zip(k3).zip(k4) {
        let sum = (*k2 + *k3).fma(two, *k1 + *k4);
        *x = sum.fma(sixth, *x);
    }
}
