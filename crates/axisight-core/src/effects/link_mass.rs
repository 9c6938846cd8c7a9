//! Mass of one link that differs from the simulator's.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, PlantParameters, Scales, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "link_mass",
    summary: "a link is heavier or lighter than modelled, by more than its tolerance",
    equation: "m (1 + s)",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 7.2 (the dynamic parameters of a link)",
    acts: Acts::Arm,
    family: Family::Load,
    usual: &["payload"],
    stands_for: Some(StandsFor { quantity: "mass", change: Change::Relative }),
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Carriers),
    parameters: &[ParameterInfo {
        name: "relative_change",
        unit: "1",
        lower: -0.95,
        upper: 20.0,
        typical: 0.1,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Mass<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Mass(p[0]))
}

impl<S: Scalar> Kernel<S> for Mass<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(body) = plant.body() {
            let factor = self.0 + 1.0;
            body.mass = body.mass * factor;
        }
    }
}
