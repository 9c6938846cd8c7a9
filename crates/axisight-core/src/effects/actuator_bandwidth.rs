//! Finite bandwidth of the current loop.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "actuator_bandwidth",
    summary: "the drive follows the commanded torque with a first-order lag",
    equation: "T_c tau' + tau = u,  bandwidth 1 / (2 pi T_c)",
    source: "Leonhard (2001), Control of Electrical Drives, section 7.2 (closed current loop)",
    acts: Acts::TorquePath,
    family: Family::Timing,
    linear: Linear::Path,
    shown_by: &[Experiment::WideBand],
    formula: Formula::LAG,
    parameters: &[ParameterInfo {
        name: "time_constant_s",
        unit: "s",
        lower: 0.0,
        upper: 0.1,
        typical: 1e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Lag<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Lag(p[0]))
}

impl<S: Scalar> Kernel<S> for Lag<S> {
    fn lag(&self) -> Option<S> {
        Some(self.0)
    }
}
