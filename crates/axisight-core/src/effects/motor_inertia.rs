//! Motor inertia that differs from the simulator's.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, PlantParameters, Scales, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "motor_inertia",
    summary: "motor inertia off by more than its tolerance",
    equation: "J_m (1 + s)",
    source: "Wernholt (2004), eq. (9.4)",
    acts: Acts::Motor,
    family: Family::Load,
    stands_for: Some(StandsFor { quantity: "motor_inertia", change: Change::Relative }),
    linear: Linear::Parameters,
    absorbed_by: &[Absorber::MotorInertia],
    shown_by: &[Experiment::Poses],
    formula: Formula::RIGID_BODY,
    scales: Some(Scales::Own),
    parameters: &[ParameterInfo {
        name: "relative_change",
        unit: "1",
        lower: -0.9,
        upper: 10.0,
        typical: 0.2,
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
            *inertia = *inertia * (self.0 + 1.0);
        }
    }
}
