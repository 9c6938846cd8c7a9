//! Backlash: a dead zone between motor and joint.

use super::formulas::{dead_zone, dead_zone_inverse};
use super::{Absorber, Acts, Deflected, EffectInfo, Experiment, Family, Kernel, LawOf, Mark, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "backlash",
    summary: "play in the gear: no torque until the gap is crossed",
    equation: "tau_g = k D + d (D' + g (delta' - D')),  D = delta - clip(delta, -b, b), its corners rounded over b/20",
    source: "Nordin, Gutman (2002), Automatica 38(10), dead-zone model",
    acts: Acts::Transmission,
    family: Family::Transmission,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Backlash],
    shown_by: &[Experiment::Amplitudes],
    law_of: Some(LawOf::Gear),
    parameters: &[
        ParameterInfo {
            name: "half_width_rad",
            unit: "rad (joint side)",
            lower: 0.0,
            upper: 0.05,
            typical: 3e-4,
            ..ParameterInfo::PLAIN
        },
        // Teeth damp only in contact; grease and seals also damp inside the gap.
        ParameterInfo {
            name: "damped",
            unit: "1",
            role: Role::Shape,
            lower: 0.0,
            upper: 1.0,
            typical: 0.5,
            marks: &[Mark::HeldFirst],
            prior: Prior::Uniform,
            sizes: "judgement: teeth that damp in contact only, or grease that damps all the way",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Backlash<S> {
    half_width: S,
    damped: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Backlash {
        half_width: p[0],
        damped: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Backlash<S> {
    fn deflection(&self, delta: S) -> Deflected<S> {
        let (loaded, slope) = dead_zone(delta, self.half_width);
        let damped = self.damped.fma(S::one() - slope, slope);
        Deflected { loaded, slope, damped }
    }

    fn deflection_inverse(&self, loaded: S) -> S {
        dead_zone_inverse(loaded, self.half_width)
    }
}
