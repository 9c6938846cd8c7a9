//! Kinematic error of the gear over the motor angle.

use super::formulas::harmonic_slope;
use super::{Acts, EffectInfo, Experiment, Family, GearError, Kernel, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

const fn wave(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "rad (joint side)",
        lower: -0.1,
        upper: 0.1,
        typical: 2e-4,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "transmission_error",
    summary: "the gear leads and lags periodically with the motor angle",
    equation: "delta = r phi + e - q, e = a cos(n phi) + b sin(n phi) + a_2 cos(m n phi) + b_2 sin(m n phi); tau_motor = (r + c de/dphi) tau_gear",
    source: "Tuttle, Seering (1996), A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics Autom. 12(3)",
    acts: Acts::Transmission,
    family: Family::Periodic,
    inverse_dynamics: false,
    shown_by: &[Experiment::SlowTurns, Experiment::Amplitudes],
    parameters: &[
        ParameterInfo {
            name: "order",
            unit: "1",
            role: Role::Shape,
            neutral: 2.0,
            lower: 0.0,
            upper: 500.0,
            typical: 1.0,
            prior: Prior::Uniform,
            sizes: "judgement: data show it by themselves",
            ..ParameterInfo::PLAIN
        },
        wave("cosine_rad"),
        wave("sine_rad"),
        // One if the gear conserves power. Zero if the torque passes at the nominal ratio, as in
        // many simulators and possibly in lossy gears.
        ParameterInfo {
            name: "returned",
            unit: "1",
            role: Role::Shape,
            neutral: 1.0,
            lower: -1.0,
            upper: 2.0,
            typical: 1.0,
            ..ParameterInfo::PLAIN
        },
        wave("second_cosine_rad"),
        wave("second_sine_rad"),
        // m: a second wave at twice the order gives the error a shape of its own.
        ParameterInfo {
            name: "second_ratio",
            unit: "1",
            role: Role::Shape,
            neutral: 2.0,
            lower: 0.0,
            upper: 500.0,
            typical: 1.0,
            prior: Prior::Uniform,
            sizes: "judgement: data show it by themselves",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct TransmissionError<S> {
    order: S,
    cosine: S,
    sine: S,
    returned: S,
    second: [S; 2],
    ratio: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(TransmissionError {
        order: p[0],
        cosine: p[1],
        sine: p[2],
        returned: p[3],
        second: [p[4], p[5]],
        ratio: p[6],
    })
}

impl<S: Scalar> Kernel<S> for TransmissionError<S> {
    fn transmission_error(&self, angle: S) -> Option<GearError<S>> {
        let at = self.order * angle;
        let (first, slope) = harmonic_slope(at, self.cosine, self.sine);
        let (second, steeper) = harmonic_slope(at * self.ratio, self.second[0], self.second[1]);
        let slope = self.order * (slope + steeper * self.ratio);
        Some(GearError {
            ahead: first + second,
            slope,
            returned: self.returned * slope,
        })
    }
}
