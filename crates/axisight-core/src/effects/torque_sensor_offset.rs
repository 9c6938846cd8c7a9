//! Constant error of the torque that the drive reports.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Formula, Linear, torque_offset};

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_sensor_offset",
    summary: "the logged torque is too small by a constant",
    equation: "u_reported = u - o",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 5.4 (sensors)",
    acts: Acts::Sensor,
    family: Family::TorquePath,
    twins: &["torque_offset"],
    linear: Linear::Path,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::TorqueOffset],
    shown_by: &[Experiment::Poses],
    formula: Formula::LINEAR,
    parameters: torque_offset::INFO.parameters,
    ..EffectInfo::PLAIN
};

/// The kernel of a torque offset, here of the reported torque, which is the torque in logs.
pub(super) use super::torque_offset::kernel;
