//! Torque of a gravity balancer on the joint.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Joint, Kernel, Linear, Mark, ParameterInfo, Scales};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "gravity_compensation",
    summary: "a balancer (spring or counterweight) that the simulator lacks or has with wrong values",
    equation: "tau_j = a sin q + b cos q on the joint",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 7.3",
    acts: Acts::Joint,
    family: Family::Load,
    linear: Linear::Slope,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Own),
    parameters: &[
        ParameterInfo {
            name: "sine_nm",
            unit: "Nm (joint side)",
            lower: -1e6,
            upper: 1e6,
            typical: 1e3,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "cosine_nm",
            unit: "Nm (joint side)",
            lower: -1e6,
            upper: 1e6,
            typical: 1e3,
            marks: &[Mark::Optional],
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Balancer<S> {
    sine: S,
    cosine: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Balancer {
        sine: p[0],
        cosine: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Balancer<S> {
    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        let (s, c) = joint.angle.sin_cos();
        self.sine.fma(s, self.cosine * c)
    }
}
