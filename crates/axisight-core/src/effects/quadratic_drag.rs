//! Drag that grows with the square of the speed.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Motor, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "quadratic_drag",
    summary: "friction that grows with the square of the speed",
    equation: "tau_f = c phi' |phi'|",
    source: "Bona, Indri (2005), Friction compensation in robotics: an overview, IEEE CDC",
    acts: Acts::Motor,
    family: Family::Friction,
    usual: &["viscous_friction"],
    absorbed_by: &[Absorber::ViscousFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    parameters: &[ParameterInfo {
        name: "drag_nm_s2_rad2",
        unit: "Nm s^2/rad^2",
        lower: -1e3,
        upper: 1e3,
        typical: 1e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Drag<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Drag(p[0]))
}

impl<S: Scalar> Kernel<S> for Drag<S> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        -(self.0 * motor.speed * motor.speed.abs())
    }
}
