//! Transport delay of the position that the controller reads.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, Linear, ParameterInfo, Role, Scope};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "sensor_delay",
    summary: "the controller reads and logs the position late: to the logs a delay of the drive",
    equation: "phi_measured(t) = phi(t - T_d)",
    source: "Astrom, Wittenmark (1997), Computer-Controlled Systems, section 2.3",
    scope: Scope::Axis,
    acts: Acts::Sensor,
    family: Family::Timing,
    contains: &[],
    parts: &[],
    usual: &[],
    twins: &["input_delay"],
    stands_for: None,
    linear: Linear::Path,
    inverse_dynamics: false,
    stiff: false,
    absorbed_by: &[],
    shown_by: &[Experiment::WideBand],
    parameters: &[ParameterInfo {
        name: "delay_s",
        unit: "s",
        role: Role::Amplitude,
        neutral: 0.0,
        lower: 0.0,
        upper: 0.05,
        typical: 1e-3,
    }],
};

struct Delay<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Delay(p[0]))
}

impl<S: Scalar> Kernel<S> for Delay<S> {
    /// The machine does not know the time: driven late it is where one read late seems to be.
    fn delay(&self) -> Option<S> {
        Some(self.0)
    }
}
