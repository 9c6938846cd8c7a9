//! Encoder with few lines, so that positions come in steps.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "position_quantization",
    summary: "the measured position comes in steps, as from a coarse encoder",
    equation: "phi_m = s round(phi / s)",
    source: "Widrow, Kollar (2008), Quantization Noise, chapter 1",
    acts: Acts::Sensor,
    family: Family::Sensor,
    inverse_dynamics: false,
    shown_by: &[Experiment::SlowTurns],
    unrepeatable: true,
    parameters: &[ParameterInfo {
        name: "increment_rad",
        unit: "rad",
        lower: 0.0,
        upper: 1.0,
        typical: 1.5e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Steps<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Steps(p[0]))
}

impl<S: Scalar> Kernel<S> for Steps<S> {
    fn resolution(&self) -> Option<S> {
        Some(self.0)
    }
}
