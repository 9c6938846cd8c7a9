//! Joint encoder with an eccentric disc.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

const fn wave(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "rad (joint side)",
        lower: -0.5,
        upper: 0.5,
        typical: 2e-2,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "encoder_eccentricity",
    summary: "the encoder sits off centre on the joint: a position error once per turn of the joint",
    equation: "v_phi = (a (cos(q) - cos(q_0)) + b (sin(q) - sin(q_0))) / r,  q_0 where a log begins",
    source: "Heidenhain, Rotary Encoders catalogue: measuring error of eccentric mounting, e / R once a turn",
    acts: Acts::Sensor,
    family: Family::Periodic,
    inverse_dynamics: false,
    shown_by: &[Experiment::SlowTurns],
    parameters: &[wave("cosine_rad"), wave("sine_rad")],
    ..EffectInfo::PLAIN
};

struct Eccentric<S>([S; 2]);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Eccentric([p[0], p[1]]))
}

impl<S: Scalar> Kernel<S> for Eccentric<S> {
    fn joint_sensor(&self, angle: S) -> Option<S> {
        let (sine, cosine) = angle.sin_cos();
        Some(self.0[0].fma(cosine, self.0[1] * sine))
    }
}
