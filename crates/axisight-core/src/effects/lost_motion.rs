//! Gear that is soft around its middle: backlash that carries part of the torque.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, LawOf, ParameterInfo, Prior, Role, Spring, SpringChange};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "lost_motion",
    summary: "the gear is soft at small torques, where few teeth carry, and as stiff as modelled beyond",
    equation: "tau_g = k (delta - s m),  m = (hypot(delta + b, c) - hypot(delta - b, c)) hypot(1, rho) / 2,  c = rho b:  dm/ddelta = 1 at 0",
    source: "Nabtesco, RV series catalogue: lost motion, the torsion at 3 % of the rated torque",
    acts: Acts::Transmission,
    family: Family::Transmission,
    usual: &["backlash", "nonlinear_stiffness"],
    inverse_dynamics: false,
    shown_by: &[Experiment::Amplitudes],
    law_of: Some(LawOf::Gear),
    spring: Some(SpringChange { sums: &[&["softness"]], without_middle: "backlash" }),
    parameters: &[
        ParameterInfo {
            name: "softness",
            unit: "1",
            lower: 0.0,
            // At one the law is backlash, where this spring cannot carry a load at rest.
            upper: 0.98,
            typical: 0.5,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "half_width_rad",
            unit: "rad (joint side)",
            role: Role::Shape,
            neutral: 3e-4,
            lower: 1e-6,
            upper: 0.05,
            typical: 3e-4,
            prior: Prior::LogNormal { spread: 1.2 },
            sizes: "judgement: gears are soft over 0.1 to 10 minutes of arc",
            ..ParameterInfo::PLAIN
        },
        // Small if all teeth come into contact at once, large if they come into contact one after
        // another.
        ParameterInfo {
            name: "rounding",
            unit: "1",
            role: Role::Shape,
            neutral: 0.3,
            lower: 0.02,
            upper: 3.0,
            typical: 0.3,
            prior: Prior::LogNormal { spread: 1.0 },
            sizes: "judgement: teeth come into contact one after another, or all at once",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Soft<S> {
    softness: S,
    within: S,
    corner: S,
    /// Half of the factor that gives the middle a slope of one.
    scale: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Soft {
        softness: p[0],
        within: p[1],
        corner: p[1] * p[2],
        scale: p[2].fma(p[2], S::one()).sqrt() * 0.5,
    })
}

impl<S: Scalar> Kernel<S> for Soft<S> {
    fn gear_torque(&self, spring: &Spring<'_, S>) -> S {
        let hypot = |x: S| x.fma(x, self.corner.square()).sqrt();
        let middle = hypot(spring.loaded + self.within) - hypot(spring.loaded - self.within);
        -(spring.stiffness * self.softness * middle * self.scale)
    }
}
