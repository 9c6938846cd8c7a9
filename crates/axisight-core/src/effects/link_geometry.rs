//! Length of a link that differs from the simulator's, which displaces everything that the link
//! carries.

use super::{
    Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, PlantParameters,
    Scales, shift,
};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "link_geometry",
    summary: "the next axis is not where the model of this link has it: a length or an offset is wrong; the last axis has no next one",
    equation: "p + d, from this joint to the next",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 2.11 (kinematic calibration)",
    acts: Acts::Arm,
    family: Family::Load,
    usual: &["payload", "link_com"],
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Every),
    needs_chain: true,
    parameters: &[shift("x_m"), shift("y_m"), shift("z_m")],
    ..EffectInfo::PLAIN
};

struct Longer<S>([S; 3]);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Longer([p[0], p[1], p[2]]))
}

impl<S: Scalar> Kernel<S> for Longer<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(next) = plant.next_joint() {
            let before = next.shift.unwrap_or([S::zero(); 3]);
            next.shift = Some(std::array::from_fn(|i| before[i] + self.0[i]));
        }
    }
}
