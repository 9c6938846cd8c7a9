//! Presliding friction: bristles that bend before the surfaces slip.

use super::formulas::stribeck_level;
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Later, LawOf, Mark, Motor, ParameterInfo, Plainer, Prior, Role, STRIBECK_SPEED, Shown};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "presliding_friction",
    summary: "friction that yields like a spring before it slips, and remembers its deflection",
    equation: "tau_f = F_c (z + T_b z'),  z' = (phi' - |phi'| z / g) / (delta + T_r |phi'|),  g = 1 + (s - 1) exp(-(phi' / v_s)^2)",
    source: "Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE TAC 40(3), eqs. (1)-(4) with sigma_0 = F_c / delta, sigma_1 = sigma_0 T_b",
    acts: Acts::Motor,
    family: Family::Friction,
    contains: &["coulomb_friction"],
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    law_of: Some(LawOf::DryFriction),
    // Laws of dry friction round the corner over speed or over a small travel. If the friction
    // really yields, the logs determine this travel.
    plainer: Some(Plainer {
        law: "coulomb_friction",
        adds: &["presliding_rad"],
        likelier: 10.0,
        shown: Shown::Sizes,
    }),
    // The fall of friction after breakaway shows only once the fit includes the yield before it.
    later: Some(Later {
        amplitude: "static_ratio",
        begin: 1.3,
        most: 5.0,
        shape: "stribeck_speed_rad_s",
        as_of: "stribeck_friction",
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
            name: "static_ratio",
            unit: "1",
            role: Role::Shape,
            neutral: 1.0,
            lower: 0.1,
            upper: 10.0,
            typical: 1.5,
            prior: Prior::LogNormal { spread: 0.4 },
            sizes: "judgement: contacts break away at one to three times what they slip with",
            ..ParameterInfo::PLAIN
        },
        STRIBECK_SPEED,
        ParameterInfo {
            name: "presliding_rad",
            unit: "rad (motor side)",
            role: Role::Shape,
            neutral: 1e-2,
            lower: 1e-9,
            upper: 10.0,
            typical: 1e-3,
            prior: Prior::LogNormal { spread: 1.5 },
            sizes: "Armstrong-Helouvry, Dupont, Canudas de Wit (1994), Automatica 30(7), table 1: 1 to 50 um at the contact, on radii a factor of ten apart",
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "bristle_time_s",
            unit: "s",
            role: Role::Shape,
            neutral: 1e-4,
            lower: 0.0,
            upper: 1.0,
            typical: 1e-4,
            prior: Prior::LogNormal { spread: 2.3 },
            sizes: "judgement: from a tenth to some hundred times the typical time",
            ..ParameterInfo::PLAIN
        },
        // T_r is not in the paper. It limits the speed of the bristles, so that a fixed step of
        // about this length can follow them.
        ParameterInfo {
            name: "relaxation_s",
            unit: "s",
            role: Role::Shape,
            lower: 0.0,
            upper: 1.0,
            typical: 1e-4,
            marks: &[Mark::FastestTime],
            prior: Prior::Uniform,
            sizes: "judgement: how somebody writes the law, not what a machine has",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Presliding<S> {
    coulomb: S,
    excess: S,
    inverse_speed: S,
    travel: S,
    bristle_time: S,
    relaxation: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Presliding {
        coulomb: p[0],
        excess: p[1] - 1.0,
        inverse_speed: p[2].recip(),
        travel: p[3],
        bristle_time: p[4],
        relaxation: p[5],
    })
}

impl<S: Scalar> Presliding<S> {
    /// Deflection of the bristles, relative to that at which they slip, and its rate.
    fn bristles(&self, motor: &Motor<'_, S>) -> (S, S) {
        let level = stribeck_level(S::one(), self.excess, self.inverse_speed, motor.speed);
        match motor.internal.first() {
            Some(z) => {
                let fast = motor.speed.abs();
                (*z, (motor.speed - fast * (*z / level)) / self.relaxation.fma(fast, self.travel))
            }
            // Without states (inverse dynamics) the bristles slip all the time.
            None => (motor.speed.if_positive(level, -level), S::zero()),
        }
    }
}

impl<S: Scalar> Kernel<S> for Presliding<S> {
    fn n_internal(&self) -> usize {
        1
    }

    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        let (z, rate) = self.bristles(motor);
        -(self.coulomb * self.bristle_time.fma(rate, z))
    }

    fn motor_rates(&self, motor: &Motor<'_, S>, rates: &mut [S]) {
        if let Some(out) = rates.first_mut() {
            *out = self.bristles(motor).1;
        }
    }
}
