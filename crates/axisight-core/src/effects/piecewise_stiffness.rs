//! Gear stiffness that takes one value at small loads and another at large ones.

use super::formulas::dead_zone;
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, LawOf, ParameterInfo, Plainer, Prior, Role, Shown, Spring, SpringChange};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "piecewise_stiffness",
    summary: "gear spring with a knee: stiffer (or softer) beyond some deflection",
    equation: "tau_g = k ((1 + a) delta + s D),  D = delta - clip(delta, -d, d), its corners rounded over d/20",
    source: "Harmonic Drive, engineering data: torsional stiffness K_1, K_2 with a knee at T_1",
    acts: Acts::Transmission,
    family: Family::Transmission,
    usual: &["backlash", "nonlinear_stiffness", "lost_motion"],
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Stiffness],
    shown_by: &[Experiment::Amplitudes],
    law_of: Some(LawOf::Gear),
    spring: Some(SpringChange { sums: &[&["within"], &["within", "step"]], without_middle: "backlash" }),
    // If no motion reaches the knee, or every motion passes it, the law is a linear spring.
    plainer: Some(Plainer {
        law: "joint_stiffness",
        adds: &["step", "knee_rad"],
        likelier: 10.0,
        shown: Shown::Sizes,
    }),
    parameters: &[
        ParameterInfo {
            name: "step",
            unit: "1",
            lower: -0.95,
            upper: 5.0,
            typical: 0.3,
            ..ParameterInfo::PLAIN
        },
        // Not zero if the stiffness was measured with large motions, or with motions other than the
        // robot's.
        ParameterInfo {
            name: "within",
            unit: "1",
            lower: -0.95,
            upper: 5.0,
            typical: 0.3,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "knee_rad",
            unit: "rad (joint side)",
            role: Role::Shape,
            neutral: 3e-4,
            lower: 1e-6,
            upper: 0.1,
            typical: 3e-4,
            prior: Prior::LogNormal { spread: 1.2 },
            sizes: "judgement: gears stiffen over 0.1 to 10 minutes of arc",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Knee<S> {
    step: S,
    within: S,
    at: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Knee {
        step: p[0],
        within: p[1],
        at: p[2],
    })
}

impl<S: Scalar> Kernel<S> for Knee<S> {
    fn gear_torque(&self, spring: &Spring<'_, S>) -> S {
        let (beyond, _) = dead_zone(spring.loaded, self.at);
        spring.stiffness * (self.step * beyond + self.within * spring.loaded)
    }
}
