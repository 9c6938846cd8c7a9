//! Torque limit of the drive.

use super::{Acts, EffectInfo, Family, Formula, Kernel, Linear, ParameterInfo, Prior};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "torque_saturation",
    summary: "the drive limits the torque",
    equation: "tau = clip(u, -L, L)",
    source: "Astrom, Wittenmark (1997), Computer-Controlled Systems, section 9.4",
    acts: Acts::TorquePath,
    family: Family::TorquePath,
    linear: Linear::Path,
    formula: Formula::LINEAR,
    parameters: &[ParameterInfo {
        name: "limit_nm",
        unit: "Nm",
        neutral: 1e6,
        lower: 1e-3,
        upper: 1e6,
        typical: 10.0,
        prior: Prior::LogNormal { spread: 1.2 },
        sizes: "judgement: limits of drives lie an order of magnitude either way of the torque that a motion needs",
        ..ParameterInfo::PLAIN
    }],
    ..EffectInfo::PLAIN
};

struct Limit<S>(S);

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Limit(p[0]))
}

impl<S: Scalar> Kernel<S> for Limit<S> {
    fn command(&self, torque: S) -> S {
        let low = (torque + self.0).if_positive(torque, -self.0);
        (self.0 - low).if_positive(low, self.0)
    }
}
