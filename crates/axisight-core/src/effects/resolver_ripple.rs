//! Resolver error over the motor angle.

use super::harmonics::{Harmonics, harmonic_parameters};
use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "resolver_ripple",
    summary: "position measurement error that repeats with the motor angle",
    equation: "v_phi = sum_i a_i cos(n_i phi) + b_i sin(n_i phi)",
    source: "Wernholt (2004), eq. (8.2b)",
    acts: Acts::Sensor,
    family: Family::Periodic,
    linear: Linear::Waves { constant: 0, proportional: 0, reading: 15 },
    inverse_dynamics: false,
    shown_by: &[Experiment::SlowTurns],
    // An order of zero switches a term off.
    formula: Formula::LINEAR,
    parameters: harmonic_parameters!(
        "rad" 0.5 1e-3 "order_1" "cosine_1_rad" "sine_1_rad" 1.0,
        "rad" 0.5 1e-3 "order_2" "cosine_2_rad" "sine_2_rad" 0.0,
        "rad" 0.5 1e-3 "order_3" "cosine_3_rad" "sine_3_rad" 0.0,
        "rad" 0.5 1e-3 "order_4" "cosine_4_rad" "sine_4_rad" 0.0,
        "rad" 0.5 1e-3 "order_5" "cosine_5_rad" "sine_5_rad" 0.0,
    ),
    ..EffectInfo::PLAIN
};

struct Resolver<S>(Harmonics<S>);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Resolver(Harmonics::new(p)))
}

impl<S: Scalar> Kernel<S> for Resolver<S> {
    fn sensor(&self, angle: S) -> S {
        self.0.evaluate(angle)
    }
}
