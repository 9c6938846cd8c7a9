//! Gear stiffness that changes with load.

use super::formulas::spring_torque;
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, Linear, ParameterInfo, Spring};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "nonlinear_stiffness",
    summary: "gear spring with a cubic term: stiffer (or softer) under load",
    equation: "tau_g = k_1 delta + k_3 delta^3",
    source: "Wernholt (2004), eq. (9.6)",
    acts: Acts::Transmission,
    family: Family::Transmission,
    linear: Linear::Slope,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Stiffness],
    shown_by: &[Experiment::Amplitudes],
    formula: Formula::LINEAR,
    law_of: Some(LawOf::Gear),
    parameters: &[ParameterInfo {
        name: "cubic_nm_rad3",
        unit: "Nm/rad^3",
        lower: -1e14,
        upper: 1e14,
        typical: 1e11,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Cubic<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Cubic(p[0]))
}

impl<S: Scalar> Kernel<S> for Cubic<S> {
    fn gear_torque(&self, spring: &Spring<'_, S>) -> S {
        spring_torque(S::zero(), self.0, spring.loaded)
    }
}
