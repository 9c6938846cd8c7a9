//! Transport delay of the position that the controller reads.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, input_delay};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "sensor_delay",
    summary: "the controller reads and logs the position late",
    equation: "phi_measured(t) = phi(t - T_d)",
    source: "Astrom, Wittenmark (1997), Computer-Controlled Systems, section 2.3",
    acts: Acts::Sensor,
    family: Family::Timing,
    usual: &["input_delay"],
    twins: &["input_delay"],
    inverse_dynamics: false,
    shown_by: &[Experiment::WideBand],
    formula: Formula::LAG,
    twins_alone: true,
    parameters: input_delay::INFO.parameters,
    ..EffectInfo::PLAIN
};

struct Late<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Late(p[0]))
}

impl<S: Scalar> Kernel<S> for Late<S> {
    fn reading_delay(&self) -> Option<S> {
        Some(self.0)
    }
}
