//! Scale of the torque that the drive reports.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_sensor_gain",
    summary: "the logged torque differs from the motor's torque by a constant factor",
    equation: "u_reported = (1 + e) u",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 5.4 (sensors)",
    acts: Acts::Sensor,
    family: Family::Sensor,
    inverse_dynamics: false,
    shown_by: &[Experiment::References],
    parameters: &[ParameterInfo {
        name: "relative_error",
        unit: "1",
        lower: -0.9,
        upper: 10.0,
        typical: 0.05,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Gain<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Gain(S::one() + p[0]))
}

impl<S: Scalar> Kernel<S> for Gain<S> {
    fn reported_share(&self) -> Option<S> {
        Some(self.0)
    }
}
