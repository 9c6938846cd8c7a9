//! Deadband of the drive.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_deadband",
    summary: "the drive delivers nothing for small commands, and too little for all others",
    equation: "tau = u - clip(u, -d, d)",
    source: "Tao, Kokotovic (1996), Adaptive Control of Systems with Actuator and Sensor Nonlinearities, chapter 2 (dead zones)",
    acts: Acts::TorquePath,
    family: Family::TorquePath,
    usual: &["torque_offset"],
    inverse_dynamics: false,
    absorbed_by: &[Absorber::DryFriction, Absorber::TorqueOffset],
    shown_by: &[Experiment::Amplitudes],
    parameters: &[ParameterInfo {
        name: "width_nm",
        unit: "Nm",
        lower: 0.0,
        upper: 1e4,
        typical: 0.3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Deadband<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Deadband(p[0]))
}

impl<S: Scalar> Kernel<S> for Deadband<S> {
    fn command(&self, torque: S) -> S {
        let none = S::zero();
        let below = (torque + self.0).if_positive(none, torque + self.0);
        (torque - self.0).if_positive(torque - self.0, below)
    }
}
