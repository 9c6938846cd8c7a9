//! Viscous friction in addition to the simulator's.

use super::{Absorber, Acts, Change, EffectInfo, Experiment, Family, Formula, Kernel, Linear, Motor, ParameterInfo, StandsFor};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "viscous_friction",
    summary: "friction proportional to speed, beyond what the simulator has",
    equation: "tau_f = F_v phi'",
    source: "Wernholt (2004), eq. (9.7)",
    acts: Acts::Motor,
    family: Family::Friction,
    stands_for: Some(StandsFor { quantity: "viscous_friction", change: Change::Absolute }),
    linear: Linear::Slope,
    absorbed_by: &[Absorber::ViscousFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula { value_error: Formula::LINEAR.value_error, of_each: false, ..Formula::FRICTION },
    parameters: &[ParameterInfo {
        name: "viscous_nm_s_rad",
        unit: "Nm s/rad",
        lower: -1e4,
        upper: 1e4,
        typical: 0.01,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Viscous<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Viscous(p[0]))
}

impl<S: Scalar> Kernel<S> for Viscous<S> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        -(self.0 * motor.speed)
    }
}
