//! Viscous friction that changes while the gear warms up.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Motor, ParameterInfo, Plainer, Prior, Role, Shown};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "friction_warmup",
    summary: "viscous friction changes with the time since the log began, as grease warms up",
    equation: "tau_f = (F_0 + F_w (1 - e^(-t / T_w))) phi'",
    source: "Bittencourt and Gunnarsson (2012), Journal of Dynamic Systems, Measurement, and Control 134(5) (viscous friction falls with temperature)",
    acts: Acts::Motor,
    family: Family::Friction,
    contains: &["viscous_friction"],
    shown_by: &[Experiment::Speeds],
    formula: Formula::FRICTION,
    beside: &["viscous_friction"],
    plainer: Some(Plainer {
        law: "viscous_friction",
        adds: &["viscous_nm_s_rad"],
        likelier: 10.0,
        shown: Shown::Sizes,
    }),
    parameters: &[
        ParameterInfo {
            name: "viscous_nm_s_rad",
            unit: "Nm s/rad",
            lower: -1e4,
            upper: 1e4,
            typical: 0.05,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "time_constant_s",
            unit: "s",
            role: Role::Shape,
            neutral: 3.0,
            lower: 0.1,
            upper: 1e5,
            typical: 0.5,
            prior: Prior::LogNormal { spread: 2.5 },
            sizes: "judgement: from the length of a short log to the hour that a gear takes",
            ..ParameterInfo::PLAIN
        },
        // F_0: if the warm machine is modelled, the friction starts higher.
        ParameterInfo {
            name: "cold_nm_s_rad",
            unit: "Nm s/rad",
            lower: -1e4,
            upper: 1e4,
            typical: 0.05,
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Warmup<S> {
    viscous: S,
    time_constant: S,
    cold: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Warmup {
        viscous: p[0],
        time_constant: p[1],
        cold: p[2],
    })
}

impl<S: Scalar> Kernel<S> for Warmup<S> {
    fn n_internal(&self) -> usize {
        1
    }

    fn state_at(&self, time: S) -> Option<S> {
        Some(S::one() - (-(time / self.time_constant)).exp())
    }

    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        // Progress of the warm-up, 1 - e^(-t / T), which is the effect's own state.
        let done = motor.internal.first().map_or_else(S::zero, |z| *z);
        -(self.viscous.fma(done, self.cold) * motor.speed)
    }

    fn motor_rates(&self, motor: &Motor<'_, S>, rates: &mut [S]) {
        if let (Some(done), Some(out)) = (motor.internal.first(), rates.first_mut()) {
            *out = (S::one() - *done) / self.time_constant;
        }
    }
}
