//! Constant error of the torque that the drive reports.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, Linear, ParameterInfo, Role, Scope};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_sensor_offset",
    summary: "the drive reports a torque smaller than the one the motor gets by a constant",
    equation: "u_reported = u - o",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 5.4 (sensors)",
    scope: Scope::Axis,
    acts: Acts::Sensor,
    family: Family::TorquePath,
    contains: &[],
    parts: &[],
    usual: &[],
    twins: &["torque_offset"],
    stands_for: None,
    linear: Linear::Path,
    inverse_dynamics: false,
    stiff: false,
    absorbed_by: &[Absorber::TorqueOffset],
    shown_by: &[Experiment::Poses],
    parameters: &[ParameterInfo {
        name: "offset_nm",
        unit: "Nm",
        role: Role::Amplitude,
        neutral: 0.0,
        lower: -1e4,
        upper: 1e4,
        typical: 0.5,
    }],
};

struct Offset<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Offset(p[0]))
}

impl<S: Scalar> Kernel<S> for Offset<S> {
    /// Of a torque as it is reported, which is what logs hold.
    fn drive(&self, torque: S) -> S {
        torque + self.0
    }
    fn drive_inverse(&self, torque: S) -> S {
        torque - self.0
    }
}
