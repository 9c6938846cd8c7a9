//! Coulomb friction that differs between the two directions of motion.

use super::formulas::smoothed_sign;
use super::sides::{ARM_SHARE, Friction, on_sides};
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, ParameterInfo, SMOOTHING};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "asymmetric_friction",
    summary: "Coulomb friction of different size forward and backward",
    equation: "tau_f = t (F_+ (1 + t) + F_- (1 - t)) / 2,  t = tanh(phi' / v_0), a share a of it behind the gear, there with q' / r for phi'",
    source: "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), section 2",
    acts: Acts::Motor,
    family: Family::Friction,
    contains: &["coulomb_friction"],
    parts: &["coulomb_friction", "torque_offset"],
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    law_of: Some(LawOf::DryFriction),
    parameters: &[
        ParameterInfo {
            name: "forward_nm",
            unit: "Nm",
            lower: 0.0,
            upper: 1e4,
            typical: 0.5,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "backward_nm",
            unit: "Nm",
            lower: 0.0,
            upper: 1e4,
            typical: 0.5,
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
        ARM_SHARE,
    ],
    ..EffectInfo::PLAIN
};

struct Asymmetric<S> {
    mean: S,
    half_difference: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let friction = Asymmetric {
        mean: (p[0] + p[1]) * 0.5,
        half_difference: (p[0] - p[1]) * 0.5,
        inverse_width: p[2].recip(),
    };
    on_sides(friction, p[3])
}

impl<S: Scalar> Friction<S> for Asymmetric<S> {
    fn torque(&self, _angle: S, speed: S) -> S {
        let t = smoothed_sign(speed, self.inverse_width);
        -(t * self.half_difference.fma(t, self.mean))
    }
}
