//! Gear damping that differs from the simulator's.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, Linear, ParameterInfo, PlantParameters, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "joint_damping",
    summary: "gear damping off by more than its tolerance",
    equation: "d (1 + s)",
    source: "Wernholt (2004), eq. (9.4)",
    acts: Acts::Transmission,
    family: Family::Transmission,
    stands_for: Some(StandsFor { quantity: "damping", change: Change::Relative }),
    linear: Linear::Parameters,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Damping],
    shown_by: &[Experiment::Amplitudes],
    formula: Formula::LINEAR,
    law_of: Some(LawOf::Gear),
    parameters: &[ParameterInfo {
        name: "relative_change",
        unit: "1",
        lower: -1.0,
        upper: 100.0,
        typical: 1.0,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Damping<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Damping(p[0]))
}

impl<S: Scalar> Kernel<S> for Damping<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(damping) = plant.damping.as_deref_mut() {
            *damping = *damping * (self.0 + 1.0);
        }
    }
}
