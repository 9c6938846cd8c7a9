//! Transport delay of the position that the controller reads.

use super::{Acts, EffectInfo, Experiment, Family, Linear, Scope, input_delay};

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
    parameters: input_delay::INFO.parameters,
};

/// The machine does not know the time: driven late it is where one read late seems to be.
pub(super) use super::input_delay::kernel;
