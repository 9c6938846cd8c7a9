//! Coulomb friction.

use super::formulas::smoothed_sign;
use super::lead::{LEAD, ahead, has_lead};
use super::sides::{ARM_SHARE, Friction, on_sides};
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, ParameterInfo, SMOOTHING};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "coulomb_friction",
    summary: "constant friction against the direction of motion",
    equation: "tau_f = F_c tanh(phi' / v_0), a share a of it behind the gear, there with q' / r for phi'; with a lead T: F_c clip((phi' + T phi_0'') / v_0, -1, 1), phi_0'' the acceleration without it",
    source: "Wernholt (2004), eq. (9.7), sign smoothed over the width v_0; with a lead the friction loss of MuJoCo, a soft constraint on speed and acceleration",
    acts: Acts::Motor,
    family: Family::Friction,
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    law_of: Some(LawOf::DryFriction),
    parameters: &[
        ParameterInfo {
            name: "coulomb_nm",
            unit: "Nm",
            lower: 0.0,
            upper: 1e4,
            typical: 0.5,
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
        ARM_SHARE,
        LEAD,
    ],
    ..EffectInfo::PLAIN
};

struct Coulomb<S> {
    level: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let (level, inverse_width) = (p[0], p[1].recip());
    if has_lead(p[3]) {
        let friction = Clipped {
            level,
            inverse_width,
        };
        return ahead(on_sides(friction, p[2]), p[3]);
    }
    let friction = Coulomb {
        level,
        inverse_width,
    };
    on_sides(friction, p[2])
}

impl<S: Scalar> Friction<S> for Coulomb<S> {
    fn torque(&self, _angle: S, speed: S) -> S {
        -(self.level * smoothed_sign(speed, self.inverse_width))
    }
}

/// A friction that is exactly its level beyond the width.
struct Clipped<S> {
    level: S,
    inverse_width: S,
}

impl<S: Scalar> Friction<S> for Clipped<S> {
    fn torque(&self, _angle: S, speed: S) -> S {
        let one = S::one();
        let sign = speed * self.inverse_width;
        let below = (sign - one).if_positive(one, sign);
        -(self.level * (-one - sign).if_positive(-one, below))
    }
}
