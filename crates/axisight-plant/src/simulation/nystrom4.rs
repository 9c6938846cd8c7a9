//! Nyström's method of order 4 for second-order equations (Nyström 1925; Hairer, Norsett,
//! Wanner, *Solving Ordinary Differential Equations I*, section II.14).
//!
//! It has as many stages as the classical Runge-Kutta method. The two middle stages have the same
//! angles, so the inertia matrix and its factors are computed once for both. The phase of an
//! undamped oscillation is 8/3 times as accurate. States of effects are treated like rates.

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
    let (plant, command) = (interval.plant, interval.command);
    let n = plant.n_angles();
    let [half, full] = [0.5 * h, h].map(S::constant);
    let [eighth, sixth, half_square] = [h * h / 8.0, h * h / 6.0, h * h / 2.0].map(S::constant);
    stepper.effort.steps += 1;
    stepper.probe.copy_from_slice(x);
    stepper.stage(plant, 0, 0.0, lines, command);

    let Stepper { probe, stages, .. } = &mut *stepper;
    angles(probe, x, n, half, eighth, &stages[0]);
    rates(probe, x, n, half, &stages[0]);
    stepper.stage(plant, 1, 0.5, lines, command);

    let Stepper { probe, stages, .. } = &mut *stepper;
    rates(probe, x, n, half, &stages[1]);
    stepper.stage_in_place(plant, 2, 0.5, lines, command);

    let Stepper { probe, stages, .. } = &mut *stepper;
    angles(probe, x, n, full, half_square, &stages[2]);
    rates(probe, x, n, full, &stages[2]);
    stepper.stage(plant, 3, 1.0, lines, command);

    let [k1, k2, k3, k4, ..] = &mut stepper.stages[..] else {
        return;
    };
    // Computed before the rates change, because the angles need the old rates.
    for (((k1, k2), k3), k4) in k1[n..]
        .iter_mut()
        .zip(&k2[n..])
        .zip(&k3[n..])
        .zip(&mut k4[n..])
    {
        let middle = *k2 + *k3;
        *k4 += *k1 + middle + middle;
        *k1 += middle;
    }
    angles(&mut stepper.probe, x, n, full, sixth, k1);
    rates(&mut stepper.probe, x, n, S::constant(h / 6.0), k4);
    x.copy_from_slice(&stepper.probe);
}

/// Set the angles of `out` to `y + width y' + square k`, with `y` and `y'` from `x`.
#[inline(always)]
fn angles<S: Scalar>(out: &mut [S], x: &[S], n: usize, width: S, square: S, k: &[S]) {
    for i in 0..n {
        out[i] = k[n + i].fma(square, x[n + i].fma(width, x[i]));
    }
}

/// Set all other states of `out` to `y' + width k`, with `y'` from `x`.
#[inline(always)]
fn rates<S: Scalar>(out: &mut [S], x: &[S], n: usize, width: S, k: &[S]) {
    for ((out, x), k) in out[n..].iter_mut().zip(&x[n..]).zip(&k[n..]) {
        *out = k.fma(width, *x);
    }
}
