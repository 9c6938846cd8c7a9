//! Motors whose inertia the simulator leaves out.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, PlantParameters, Scales, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "rotor_inertia",
    summary: "inertia of motor and gear that the simulator leaves out, as most model files of arms do",
    equation: "J_m + dJ",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 7.1 (rotors in the kinetic energy)",
    acts: Acts::Motor,
    family: Family::Load,
    usual: &["link_mass"],
    stands_for: Some(StandsFor { quantity: "motor_inertia", change: Change::Absolute }),
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::MotorInertia],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Carriers),
    parameters: &[ParameterInfo {
        name: "inertia_kg_m2",
        unit: "kg m^2",
        lower: 0.0,
        upper: 1e5,
        typical: 0.01,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Inertia<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Inertia(p[0]))
}

impl<S: Scalar> Kernel<S> for Inertia<S> {
    fn prepare(&self, plant: &mut PlantParameters<'_, S>) {
        if let Some(inertia) = plant.motor_inertia.as_deref_mut() {
            *inertia += self.0;
        }
    }
}
