//! Centre of mass of one link that differs from the simulator's.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, PlantParameters, Scales, shift};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "link_com",
    summary: "the centre of mass of a link is not where it is modelled",
    equation: "c + d",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 7.2 (the dynamic parameters of a link)",
    acts: Acts::Arm,
    family: Family::Load,
    usual: &["payload"],
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Carriers),
    parameters: &[shift("x_m"), shift("y_m"), shift("z_m")],
    ..EffectInfo::PLAIN
};

struct Shift<S>([S; 3]);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Shift([p[0], p[1], p[2]]))
}

impl<S: Scalar> Kernel<S> for Shift<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(body) = plant.body() {
            body.com = std::array::from_fn(|i| body.com[i] + self.0[i]);
        }
    }
}
