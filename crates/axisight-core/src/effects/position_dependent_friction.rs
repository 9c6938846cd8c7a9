//! Dry friction that changes with the position of the axis.

use super::sides::{ARM_SHARE, Friction, on_sides};
use super::{Absorber, Acts, BegunFrom, EffectInfo, Experiment, Family, Formula, Kernel, LawOf, Mark, ParameterInfo, Plainer, Prior, Role, SMOOTHING, Shown};
use axisight_scalar::Scalar;

const fn wave(name: &'static str) -> ParameterInfo {
    ParameterInfo {
        name,
        unit: "Nm",
        lower: -1e4,
        upper: 1e4,
        typical: 0.2,
        ..ParameterInfo::PLAIN
    }
}

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "position_dependent_friction",
    summary: "dry friction that changes with the angle",
    equation: "tau_f = (m + c cos(n phi) + s sin(n phi)) tanh(w / w_s),  n: r for once a turn of the joint; a share a of it behind the gear, there with q / r for phi",
    source: "Armstrong-Helouvry (1991), Control of Machines with Friction (joints of a PUMA 560 over their position); tanh form as coulomb_friction",
    acts: Acts::Motor,
    family: Family::Friction,
    contains: &["coulomb_friction"],
    usual: &["coulomb_friction"],
    absorbed_by: &[Absorber::DryFriction],
    shown_by: &[Experiment::Poses],
    formula: Formula::FRICTION,
    plainer: Some(Plainer {
        law: "coulomb_friction",
        adds: &["cosine_nm", "sine_nm"],
        likelier: 10.0,
        shown: Shown::Either,
    }),
    law_of: Some(LawOf::DryFriction),
    // This law contains uniform friction, so its fit must not leave a larger loss than that law.
    begun_from: Some(BegunFrom {
        law: "coulomb_friction",
        takes: &[("coulomb_nm", "mean_nm"), ("smoothing_rad_s", "smoothing_rad_s"), ("arm_share", "arm_share")],
    }),
    parameters: &[
        ParameterInfo { marks: &[Mark::Optional], ..wave("cosine_nm") },
        wave("sine_nm"),
        ParameterInfo {
            name: "order",
            unit: "1/motor turn",
            role: Role::Shape,
            neutral: 0.01,
            lower: 1e-4,
            upper: 100.0,
            typical: 0.01,
            prior: Prior::LogNormal { spread: 1.2 },
            sizes: "judgement: a turn of the joint behind gears of 10 to 1000",
            ..ParameterInfo::PLAIN
        },
        SMOOTHING,
        wave("mean_nm"),
        ARM_SHARE,
    ],
    ..EffectInfo::PLAIN
};

struct Uneven<S> {
    cosine: S,
    sine: S,
    order: S,
    smoothing: S,
    mean: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    let friction = Uneven {
        cosine: p[0],
        sine: p[1],
        order: p[2],
        smoothing: p[3],
        mean: p[4],
    };
    on_sides(friction, p[5])
}

impl<S: Scalar> Friction<S> for Uneven<S> {
    fn torque(&self, angle: S, speed: S) -> S {
        let (sine, cosine) = (self.order * angle).sin_cos();
        let level = self.cosine.fma(cosine, self.sine.fma(sine, self.mean));
        -(level * (speed / self.smoothing).tanh())
    }
}
