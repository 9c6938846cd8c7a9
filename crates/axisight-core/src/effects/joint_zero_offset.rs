//! Zero of a joint angle that differs from the simulator's, which turns the arm beyond the joint.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, PlantParameters, Scales};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "joint_zero_offset",
    summary: "the zero of a joint is not where it is modelled: its encoder was mounted or set differently",
    equation: "q + q_0 in M, c and g",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 2.11 (kinematic calibration)",
    acts: Acts::Arm,
    family: Family::Arm,
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::Links, Absorber::TorqueOffset],
    shown_by: &[Experiment::Poses],
    formula: Formula::CONSTANT,
    scales: Some(Scales::Every),
    parameters: &[ParameterInfo {
        name: "offset_rad",
        unit: "rad (joint side)",
        lower: -1.6,
        upper: 1.6,
        typical: 0.02,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Zero<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Zero(p[0]))
}

impl<S: Scalar> Kernel<S> for Zero<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(joint) = plant.joint() {
            joint.zero += self.0;
        }
    }
}
