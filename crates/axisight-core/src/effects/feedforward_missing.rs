//! Torque that the machine's controller feeds forward and the simulator's does not.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

const fn share(name: &'static str, unit: &'static str, typical: f64) -> ParameterInfo {
    ParameterInfo {
        name,
        unit,
        lower: -1e3,
        upper: 1e3,
        typical,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "feedforward_missing",
    summary: "the controller feeds forward torque for acceleration and speed",
    equation: "u = feedback + J_f dphi_r'/dt + F_f phi_r'",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 8.4 (feedforward compensation)",
    acts: Acts::Controller,
    family: Family::Controller,
    inverse_dynamics: false,
    shown_by: &[Experiment::References],
    parameters: &[
        share("acceleration_nm_s2_rad", "Nm s^2/rad", 0.01),
        share("speed_nm_s_rad", "Nm s/rad", 0.01),
    ],
    ..EffectInfo::PLAIN
};

struct Forward<S>([S; 2]);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Forward([p[0], p[1]]))
}

impl<S: Scalar> Kernel<S> for Forward<S> {
    fn feedforward(&self) -> Option<[S; 2]> {
        Some(self.0)
    }
}
