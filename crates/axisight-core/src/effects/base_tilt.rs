//! Tilt of the base, which changes the direction of gravity.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, Mark, ParameterInfo, PlantParameters, Scales, Scope};
use axisight_scalar::Scalar;

const fn angle(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "rad",
        lower: -1.6,
        upper: 1.6,
        typical: 0.02,
        marks: &[Mark::Optional],
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "base_tilt",
    summary: "the base is tilted, so gravity comes from another direction",
    equation: "g' = R_y(-b) R_x(-a) g",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 7.1 (gravity in the base frame)",
    scope: Scope::Arm,
    acts: Acts::Base,
    family: Family::Arm,
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links, Absorber::TorqueOffset],
    shown_by: &[Experiment::Poses],
    formula: Formula::CONSTANT,
    scales: Some(Scales::Every),
    parameters: &[angle("about_x_rad"), angle("about_y_rad")],
    ..EffectInfo::PLAIN
};

struct Tilt<S> {
    about_x: S,
    about_y: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Tilt {
        about_x: p[0],
        about_y: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Tilt<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        let [x, y, z] = plant.chain.gravity;
        let (sine, cosine) = self.about_x.sin_cos();
        let (y, z) = (cosine * y + sine * z, cosine * z - sine * y);
        let (sine, cosine) = self.about_y.sin_cos();
        plant.chain.gravity = [cosine * x - sine * z, y, cosine * z + sine * x];
    }
}
