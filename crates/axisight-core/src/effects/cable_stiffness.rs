//! Stiffness of cables and hoses along the joint.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Joint, Kernel, Linear, Mark, ParameterInfo, Plainer, Shown};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "cable_stiffness",
    summary: "cables and hoses pull the joint back to their rest angle, like a spring",
    equation: "tau_j = p - k q on the joint, at rest where q = p / k",
    source: "Hooke's law on the angle from rest",
    acts: Acts::Joint,
    family: Family::Load,
    linear: Linear::Slope,
    shown_by: &[Experiment::Poses],
    formula: Formula::LINEAR,
    // A soft cable with a distant rest angle pulls like a constant torque.
    plainer: Some(Plainer {
        law: "torque_offset",
        adds: &["stiffness_nm_rad"],
        likelier: 50.0,
        shown: Shown::Sizes,
    }),
    parameters: &[
        ParameterInfo {
            name: "stiffness_nm_rad",
            unit: "Nm/rad (joint side)",
            lower: -1e7,
            upper: 1e7,
            typical: 500.0,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "at_zero_nm",
            unit: "Nm (joint side)",
            lower: -1e7,
            upper: 1e7,
            typical: 100.0,
            marks: &[Mark::Optional],
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Cable<S> {
    stiffness: S,
    at_zero: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Cable {
        stiffness: p[0],
        at_zero: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Cable<S> {
    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        self.at_zero - self.stiffness * joint.angle
    }
}
