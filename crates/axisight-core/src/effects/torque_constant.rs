//! Torque constant that differs from the drive's value.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_constant",
    summary: "the motor delivers more or less torque than commanded, in proportion",
    equation: "tau = (1 + e) u",
    source: "Gautier, Briot (2014), Global identification of joint drive gains, J. Dyn. Sys. 136(5)",
    acts: Acts::TorquePath,
    family: Family::TorquePath,
    linear: Linear::Path,
    absorbed_by: &[Absorber::Torque],
    shown_by: &[Experiment::Poses],
    formula: Formula::CONSTANT,
    parameters: &[ParameterInfo {
        name: "relative_error",
        unit: "1",
        lower: -0.8,
        upper: 2.0,
        typical: 0.05,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Gain<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Gain(p[0] + 1.0))
}

impl<S: Scalar> Kernel<S> for Gain<S> {
    fn drive(&self, torque: S) -> S {
        torque * self.0
    }
    fn drive_inverse(&self, torque: S) -> S {
        torque / self.0
    }
}
