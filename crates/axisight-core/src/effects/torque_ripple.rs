//! Motor torque ripple over the motor angle.

use super::harmonics::{Harmonics, harmonic_parameters};
use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, Motor, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_ripple",
    summary: "cogging: torque that repeats with the motor angle",
    equation: "v_tau = sum_i a_i cos(n_i phi) + b_i sin(n_i phi) + u (a_u cos(n_u phi) + b_u sin(n_u phi))",
    source: "Wernholt (2004), eq. (8.2a)",
    acts: Acts::Motor,
    family: Family::Periodic,
    linear: Linear::Waves { constant: 15, proportional: 3, reading: 0 },
    shown_by: &[Experiment::SlowTurns],
    // An order of zero switches a term off.
    formula: Formula::LINEAR,
    parameters: harmonic_parameters!(
        "Nm" 1e4 0.1 "order_1" "cosine_1_nm" "sine_1_nm" 1.0,
        "Nm" 1e4 0.1 "order_2" "cosine_2_nm" "sine_2_nm" 0.0,
        "Nm" 1e4 0.1 "order_3" "cosine_3_nm" "sine_3_nm" 0.0,
        "Nm" 1e4 0.1 "order_4" "cosine_4_nm" "sine_4_nm" 0.0,
        "Nm" 1e4 0.1 "order_5" "cosine_5_nm" "sine_5_nm" 0.0,
        "1" 1.0 0.02 "order_u" "cosine_u" "sine_u" 0.0,
    ),
    ..EffectInfo::PLAIN
};

struct Ripple<S> {
    constant: Harmonics<S>,
    proportional: Harmonics<S>,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let (constant, proportional) = p.split_at(15);
    Box::new(Ripple {
        constant: Harmonics::new(constant),
        proportional: Harmonics::new(proportional),
    })
}

impl<S: Scalar> Kernel<S> for Ripple<S> {
    fn uses_command(&self) -> bool {
        true
    }

    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        let constant = self.constant.evaluate(motor.angle);
        self.proportional
            .evaluate(motor.angle)
            .fma(motor.command, constant)
    }
}
