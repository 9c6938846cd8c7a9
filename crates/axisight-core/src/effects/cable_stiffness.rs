//! Stiffness of cables and hoses along the joint.

use super::{Acts, EffectInfo, Experiment, Family, Joint, Kernel, Linear, ParameterInfo, Role, Scope};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "cable_stiffness",
    summary: "cables and hoses pull the joint back in proportion to its angle",
    equation: "tau_j = -k q on the joint",
    source: "Hooke's law on the joint angle",
    scope: Scope::Axis,
    acts: Acts::Joint,
    family: Family::Load,
    contains: &[],
    parts: &[],
    usual: &[],
    twins: &[],
    stands_for: None,
    linear: Linear::Slope,
    inverse_dynamics: true,
    absorbed_by: &[],
    shown_by: &[Experiment::Poses],
    parameters: &[ParameterInfo {
        name: "stiffness_nm_rad",
        unit: "Nm/rad (joint side)",
        role: Role::Amplitude,
        neutral: 0.0,
        lower: -1e7,
        upper: 1e7,
        typical: 500.0,
    }],
};

struct Cable<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Cable(p[0]))
}

impl<S: Scalar> Kernel<S> for Cable<S> {
    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        -(self.0 * joint.angle)
    }
}
