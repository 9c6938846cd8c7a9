//! Constant torque error.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_offset",
    summary: "a constant torque is added to the commanded one",
    equation: "tau = u + o",
    source: "Janot, Gautier, Brunot (2019), EMPS benchmark: offset of the force",
    acts: Acts::TorquePath,
    family: Family::TorquePath,
    twins: &["torque_sensor_offset"],
    linear: Linear::Path,
    absorbed_by: &[Absorber::TorqueOffset],
    shown_by: &[Experiment::Poses],
    formula: Formula::CONSTANT,
    parameters: &[ParameterInfo {
        name: "offset_nm",
        unit: "Nm",
        lower: -1e4,
        upper: 1e4,
        typical: 0.5,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Offset<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Offset(p[0]))
}

impl<S: Scalar> Kernel<S> for Offset<S> {
    fn drive(&self, torque: S) -> S {
        torque + self.0
    }
    fn drive_inverse(&self, torque: S) -> S {
        torque - self.0
    }
}
