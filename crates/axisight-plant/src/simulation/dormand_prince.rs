//! Dormand-Prince 5(4) pair (Dormand, Prince 1980, J. Comput. Appl. Math. 6(1)).

use super::method::{Interval, Stepper};
use super::torque_path::Line;
use axisight_scalar::Scalar;

/// Number of stages; the last one serves the error estimate only.
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

/// States below this size [rad, rad/s] have an absolute error bound.
pub(super) const SMALLEST_STATE: f64 = 1e-3;

/// One step of length `h` [s]; returns the largest local error relative to the state.
pub(super) fn step<S: Scalar>(
    interval: &Interval<'_, S>,
    x: &mut [S],
    h: f64,
    lines: &[Line<S>],
    stepper: &mut Stepper<S>,
) -> f64 {
    stepper.effort.steps += 1;
    let first = usize::from(reuse_last_stage(interval, lines, stepper));
    for stage in first..STAGES {
        stepper.probe.copy_from_slice(x);
        for (weight, k) in WEIGHT[stage][..stage.min(6)].iter().zip(&stepper.stages) {
            add(&mut stepper.probe, *weight * h, k);
        }
        stepper.stage(interval.plant, stage, NODE[stage], lines, interval.command);
    }
    stepper.reusable.clear();
    stepper.reusable.extend_from_slice(&stepper.applied);
    // The last probe is the fifth-order solution. Its memory then holds the error.
    x.copy_from_slice(&stepper.probe);
    stepper.probe.fill(S::zero());
    for (weight, k) in ERROR.iter().zip(&stepper.stages) {
        add(&mut stepper.probe, *weight * h, k);
    }
    largest_relative(&stepper.probe, x)
}

/// Reuse the last stage of the previous step as the first of this one, if only motor torques have
/// changed. Returns false if that is not possible.
#[inline(always)]
fn reuse_last_stage<S: Scalar>(
    interval: &Interval<'_, S>,
    lines: &[Line<S>],
    stepper: &mut Stepper<S>,
) -> bool {
    if stepper.reusable.is_empty() || !interval.plant.torque_acts_on_motors_alone() {
        return false;
    }
    for (a, line) in stepper.applied.iter_mut().zip(lines) {
        *a = line.at(0.0);
    }
    stepper.stages.swap(0, STAGES - 1);
    let slope = &mut stepper.stages[0];
    interval
        .plant
        .change_torque(&stepper.reusable, &stepper.applied, slope);
    true
}

/// `sum += weight * k`.
#[inline(always)]
fn add<S: Scalar>(sum: &mut [S], weight: f64, k: &[S]) {
    if weight != 0.0 {
        let weight = S::constant(weight);
        for (s, k) in sum.iter_mut().zip(k) {
            *s = k.fma(weight, *s);
        }
    }
}

/// Largest error relative to its state, over all lanes; NaN if any error is NaN.
pub(super) fn largest_relative<S: Scalar>(error: &[S], x: &[S]) -> f64 {
    let floor = S::constant(SMALLEST_STATE);
    let (mut worst, mut nan) = (S::zero(), S::zero());
    for (e, x) in error.iter().zip(x) {
        let size = x.abs();
        let relative = e.abs() / (size - floor).if_positive(size, floor);
        worst = (relative - worst).if_positive(relative, worst);
        // A comparison drops NaN, but a sum keeps it. Infinity times zero is NaN as well.
        nan = relative.fma(S::zero(), nan);
    }
    (0..S::LANES).fold(0.0, |largest: f64, lane| {
        if largest.is_nan() || nan.lane(lane).is_nan() {
            f64::NAN
        } else {
            largest.max(worst.lane(lane))
        }
    })
}

/// Boundary of the stability region on the negative real axis.
const STABLE: f64 = 3.25;
/// From this number of sub-steps on, an explicit sample costs more than an implicit one.
const DEAR: usize = 8;
/// Score at which the plant counts as stiff: stiff samples minus other samples.
const PATIENCE: u32 = 15;
/// Share of the stable step from which on stability counts as the limit. The number of sub-steps is
/// a power of two and may be twice the required number. If only accuracy limits them, steps are
/// much shorter.
const NEAR: f64 = 0.25;

/// Update the stiffness score after an accepted sample with sub-steps `h`.
///
/// The last two stages are at the same time. The ratio of their slope difference to their distance
/// estimates the dominant eigenvalue (Hairer, Wanner 1996, section IV.2).
pub(super) fn watch_stiffness<S: Scalar>(stepper: &mut Stepper<S>, h: f64) {
    if stepper.substeps < DEAR {
        stepper.stiff_score = stepper.stiff_score.saturating_sub(1);
        return;
    }
    let (mut slope, mut distance) = (0.0, 0.0);
    for i in 0..stepper.probe.len() {
        let mut apart = S::zero();
        for (j, k) in stepper.stages.iter().enumerate().take(6) {
            let sixth = WEIGHT[5].get(j).copied().unwrap_or(0.0);
            apart += k[i] * (h * (WEIGHT[6][j] - sixth));
        }
        let change = stepper.stages[6][i] - stepper.stages[5][i];
        slope += (0..S::LANES).map(|l| change.lane(l).powi(2)).sum::<f64>();
        distance += (0..S::LANES).map(|l| apart.lane(l).powi(2)).sum::<f64>();
    }
    let stiff = h * h * slope > (NEAR * STABLE).powi(2) * distance;
    stepper.stiff_score = if stiff {
        stepper.stiff_score + 1
    } else {
        stepper.stiff_score.saturating_sub(1)
    };
}

pub(super) fn is_stiff<S: Scalar>(stepper: &Stepper<S>) -> bool {
    stepper.has_jacobian() && stepper.stiff_score >= PATIENCE
}

pub(super) fn declare_stiff<S: Scalar>(stepper: &mut Stepper<S>) {
    stepper.stiff_score = PATIENCE;
}
