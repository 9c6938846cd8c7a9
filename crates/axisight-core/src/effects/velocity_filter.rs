//! A filter of the speed in the controller.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, ParameterInfo};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "velocity_filter",
    summary: "the controller low-passes the measured speed",
    equation: "w_k = w_(k-1) + T / (T + T_v) (v_k - w_(k-1))",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 8.3 (decentralized control; the speed from positions)",
    acts: Acts::Controller,
    family: Family::Controller,
    inverse_dynamics: false,
    shown_by: &[Experiment::References],
    parameters: &[ParameterInfo {
        name: "time_constant_s",
        unit: "s",
        lower: 0.0,
        upper: 0.1,
        typical: 2e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Filter<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Filter(p[0]))
}

impl<S: Scalar> Kernel<S> for Filter<S> {
    fn speed_filter(&self) -> Option<S> {
        Some(self.0)
    }
}
