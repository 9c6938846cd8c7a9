//! Transport delay between commanded and applied torque.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "input_delay",
    summary: "the drive applies the commanded torque late",
    equation: "tau(t) = u(t - T_d), any fraction of a sample",
    source: "Astrom, Wittenmark (1997), Computer-Controlled Systems, section 2.3",
    acts: Acts::TorquePath,
    family: Family::Timing,
    twins: &["sensor_delay"],
    linear: Linear::Path,
    shown_by: &[Experiment::WideBand],
    formula: Formula::LAG,
    twins_alone: true,
    parameters: &[ParameterInfo {
        name: "delay_s",
        unit: "s",
        lower: 0.0,
        upper: 0.05,
        typical: 1e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Delay<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Delay(p[0]))
}

impl<S: Scalar> Kernel<S> for Delay<S> {
    fn delay(&self) -> Option<S> {
        Some(self.0)
    }
}
