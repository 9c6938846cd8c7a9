//! Clocks of controller and logger that drift apart.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, ParameterInfo, Scope};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "clock_drift",
    summary: "the clock of the machine and that of the logged references drift apart",
    equation: "phi_r'(t) -> phi_r'((1 + e) t)",
    source: "Eidson (2006), Measurement, Control and Communication Using IEEE 1588, chapter 2 (clock rates)",
    scope: Scope::Arm,
    acts: Acts::Controller,
    family: Family::Timing,
    inverse_dynamics: false,
    shown_by: &[Experiment::References],
    formula: Formula::LAG,
    parameters: &[ParameterInfo {
        name: "relative_rate",
        unit: "1",
        lower: -0.01,
        upper: 0.01,
        typical: 1e-3,
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Drift<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Drift(p[0]))
}

impl<S: Scalar> Kernel<S> for Drift<S> {
    fn clock_drift(&self) -> Option<S> {
        Some(self.0)
    }
}
