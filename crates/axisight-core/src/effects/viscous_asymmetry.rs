//! Viscous friction that differs between the two directions of motion.

use super::formulas::smoothed_sign;
use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Kernel, Motor, ParameterInfo, SMOOTHING};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "viscous_asymmetry",
    summary: "viscous friction of different size forward and backward: half the difference",
    equation: "tau_f = D phi' tanh(phi' / v_0),  D = (F_v+ - F_v-) / 2: with F_v = (F_v+ + F_v-) / 2 beside it F_v+ phi' forward and F_v- phi' backward",
    source: "Armstrong-Helouvry (1991), Control of Machines with Friction (viscous friction of a PUMA 560 by direction)",
    acts: Acts::Motor,
    family: Family::Friction,
    // At one speed in both directions it is a constant torque.
    absorbed_by: &[Absorber::TorqueOffset],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    parameters: &[
        ParameterInfo {
            name: "half_difference_nm_s_rad",
            unit: "Nm s/rad",
            lower: -1e4,
            upper: 1e4,
            typical: 0.01,
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
    ],
    ..EffectInfo::PLAIN
};

struct Asymmetry<S> {
    half_difference: S,
    inverse_width: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Asymmetry {
        half_difference: p[0],
        inverse_width: p[1].recip(),
    })
}

impl<S: Scalar> Kernel<S> for Asymmetry<S> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        let size = motor.speed * smoothed_sign(motor.speed, self.inverse_width);
        -(self.half_difference * size)
    }
}
