//! Stribeck friction: Coulomb friction with an excess at low speed.

use super::formulas::{smoothed_sign, stribeck_level};
use super::sides::{ARM_SHARE, Friction, on_sides};
use super::{Absorber, Acts, BegunFrom, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, ParameterInfo, Plainer, SMOOTHING, STRIBECK_SPEED, Shown};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "stribeck_friction",
    summary: "Coulomb friction that rises towards standstill",
    equation: "tau_f = (F_c + F_s exp(-(phi' / v_s)^2)) tanh(phi' / v_0), a share a of it behind the gear, there with q' / r for phi'",
    source: "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), eq. (5)",
    acts: Acts::Motor,
    family: Family::Friction,
    contains: &["coulomb_friction"],
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    law_of: Some(LawOf::DryFriction),
    // If the sign turns over a wider range of speeds than the excess, the excess never shows and
    // only describes how the corner is rounded.
    plainer: Some(Plainer {
        law: "coulomb_friction",
        adds: &["excess_nm", "stribeck_speed_rad_s"],
        likelier: 10.0,
        shown: Shown::Rise,
    }),
    begun_from: Some(BegunFrom {
        law: "coulomb_friction",
        takes: &[("coulomb_nm", "coulomb_nm"), ("smoothing_rad_s", "smoothing_rad_s"), ("arm_share", "arm_share")],
    }),
    parameters: &[
        ParameterInfo {
            name: "coulomb_nm",
            unit: "Nm",
            lower: 0.0,
            upper: 1e4,
            typical: 0.5,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "excess_nm",
            unit: "Nm",
            lower: 0.0,
            upper: 1e4,
            typical: 0.3,
            ..ParameterInfo::PLAIN
        },
        STRIBECK_SPEED,
        SMOOTHING,
        ARM_SHARE,
    ],
    ..EffectInfo::PLAIN
};

struct Stribeck<S> {
    coulomb: S,
    excess: S,
    inverse_speed: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let friction = Stribeck {
        coulomb: p[0],
        excess: p[1],
        inverse_speed: p[2].recip(),
        inverse_width: p[3].recip(),
    };
    on_sides(friction, p[4])
}

impl<S: Scalar> Friction<S> for Stribeck<S> {
    fn torque(&self, _angle: S, speed: S) -> S {
        let level = stribeck_level(self.coulomb, self.excess, self.inverse_speed, speed);
        -(level * smoothed_sign(speed, self.inverse_width))
    }
}
