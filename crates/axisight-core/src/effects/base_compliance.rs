//! Compliant base: the arm rocks on springs.
//!
//! Twist about the first axis is not included. It equals the spring of that axis' gear, because
//! nothing moves between the two.

use super::{Acts, BaseJoint, EffectInfo, Experiment, Family, Kernel, ParameterInfo, Prior, Role, Scope};
use crate::robot::Motion;
use axisight_scalar::Scalar;

const fn compliance(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "rad/Nm",
        lower: 0.0,
        upper: 1e-3,
        typical: 2e-7,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "base_compliance",
    summary: "the base yields and rocks under the arm",
    equation: "tau = q_b / c + (T_d / c) q_b',  below the first joint about x and y of the base",
    source: "Moberg (2010), Modeling and Control of Flexible Manipulators (extended flexible joint model)",
    scope: Scope::Arm,
    acts: Acts::Base,
    family: Family::Arm,
    inverse_dynamics: false,
    shown_by: &[Experiment::WideBand],
    parameters: &[
        compliance("about_x_rad_nm"),
        compliance("about_y_rad_nm"),
        ParameterInfo {
            name: "damping_s",
            unit: "s (damping over stiffness)",
            role: Role::Shape,
            neutral: 2e-3,
            lower: 0.0,
            upper: 0.1,
            typical: 2e-3,
            prior: Prior::LogNormal { spread: 1.0 },
            sizes: "judgement: damping of structures, a factor of seven either way (95 %)",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Compliance<S> {
    about: [S; 2],
    damping: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Compliance {
        about: [p[0], p[1]],
        damping: p[2],
    })
}

impl<S: Scalar> Kernel<S> for Compliance<S> {
    fn base_joints(&self) -> Vec<BaseJoint<S>> {
        let gives_way = |(_, c): &(usize, &S)| (0..S::LANES).any(|lane| c.lane(lane) > 0.0);
        let joint = |(i, compliance): (usize, &S)| {
            let stiffness = compliance.recip();
            BaseJoint {
                motion: Motion::Revolute,
                axis: std::array::from_fn(|k| f64::from(u8::from(k == i))),
                stiffness,
                damping: stiffness * self.damping,
                body: None,
            }
        };
        let each = self.about.iter().enumerate();
        each.filter(gives_way).map(joint).collect()
    }
}
