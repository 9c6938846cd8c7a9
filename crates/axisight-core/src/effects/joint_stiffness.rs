//! Gear stiffness that differs from the simulator's.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, Linear, Mark, ParameterInfo, PlantParameters, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "joint_stiffness",
    summary: "gear stiffness off by more than its tolerance",
    equation: "k = k_1 (1 + s)",
    source: "Wernholt (2004), eq. (9.6) with k_3 = 0",
    acts: Acts::Transmission,
    family: Family::Transmission,
    stands_for: Some(StandsFor { quantity: "stiffness", change: Change::Relative }),
    linear: Linear::Parameters,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Stiffness],
    shown_by: &[Experiment::Amplitudes],
    formula: Formula::LINEAR,
    law_of: Some(LawOf::Gear),
    parameters: &[ParameterInfo {
        name: "relative_change",
        unit: "1",
        lower: -0.9,
        upper: 5.0,
        typical: 0.2,
        marks: &[Mark::ShowsInverse],
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Stiffness<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Stiffness(p[0]))
}

impl<S: Scalar> Kernel<S> for Stiffness<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(k) = plant.stiffness.as_deref_mut() {
            *k = *k * (self.0 + 1.0);
        }
    }
}
