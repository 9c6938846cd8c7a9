//! Controller gains of the machine that differ from the stated gains.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, Mark, ParameterInfo};
use axisight_scalar::Scalar;

const fn change(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "1",
        lower: -0.95,
        upper: 10.0,
        typical: 0.2,
        marks: &[Mark::Optional],
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "controller_gain",
    summary: "the controller has gains other than the stated ones",
    equation: "k_p' = k_p (1 + e_p),  k_i' = k_i (1 + e_i),  k_v' = k_v (1 + e_v)",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 8.3 (decentralized control)",
    acts: Acts::Controller,
    family: Family::Controller,
    inverse_dynamics: false,
    shown_by: &[Experiment::References],
    parameters: &[
        change("relative_proportional"),
        change("relative_integral"),
        // Gain of the position loop of a cascade; other controllers do not have it.
        change("relative_position"),
    ],
    ..EffectInfo::PLAIN
};

struct Gains<S>([S; 3]);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let [proportional, integral, position] = [p[0], p[1], p[2]].map(|change| S::one() + change);
    Box::new(Gains([proportional, integral, position]))
}

impl<S: Scalar> Kernel<S> for Gains<S> {
    fn controller_gains(&self) -> Option<[S; 3]> {
        Some(self.0)
    }
}
