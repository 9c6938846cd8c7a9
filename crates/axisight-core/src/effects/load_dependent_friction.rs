//! Coulomb friction in proportion to the gear load.

use super::formulas::smoothed_sign;
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Motor, ParameterInfo, SMOOTHING};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "load_dependent_friction",
    summary: "friction in proportion to the torque that the gear carries",
    equation: "tau_f = mu |tau_load| tanh(phi' / v_0)",
    source: "Hamon, Gautier, Garrec (2010), Dynamic identification of robots with a dry friction model depending on load and velocity, IROS",
    acts: Acts::Motor,
    family: Family::Friction,
    usual: &["coulomb_friction"],
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    parameters: &[
        ParameterInfo {
            name: "coefficient",
            unit: "1",
            lower: 0.0,
            upper: 2.0,
            typical: 0.05,
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
    ],
    ..EffectInfo::PLAIN
};

struct LoadFriction<S> {
    coefficient: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(LoadFriction {
        coefficient: p[0],
        inverse_width: p[1].recip(),
    })
}

impl<S: Scalar> Kernel<S> for LoadFriction<S> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        let sign = smoothed_sign(motor.speed, self.inverse_width);
        -(self.coefficient * motor.load.abs() * sign)
    }
}
