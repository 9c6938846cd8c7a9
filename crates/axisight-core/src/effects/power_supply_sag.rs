//! Supply voltage that sags under power, which lowers the drive's torque.

use super::{Acts, EffectInfo, Experiment, Family, Kernel, Motor, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "power_supply_sag",
    summary: "the supply voltage drops under load: the more power the drive draws, the less of its torque it delivers",
    equation: "tau = u (1 - x / (1 + c x)),  x = s max(u phi', 0);  a line at c = 0, 1 / (1 + x) at c = 1",
    source: "Siciliano et al. (2009), Robotics: Modelling, Planning and Control, section 5.2 (power supply and amplifier)",
    acts: Acts::Motor,
    family: Family::TorquePath,
    usual: &["torque_constant"],
    inverse_dynamics: false,
    shown_by: &[Experiment::Speeds],
    parameters: &[
        ParameterInfo {
            name: "sag_1_w",
            unit: "1/W",
            lower: 0.0,
            upper: 10.0,
            typical: 6e-3,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "curvature",
            unit: "1",
            role: Role::Shape,
            neutral: 0.5,
            lower: 0.0,
            upper: 1.0,
            typical: 0.5,
            prior: Prior::Uniform,
            sizes: "judgement: a supply with a droop, or one at its limit",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

/// Largest share of the torque that can be lost.
const MOST: f64 = 0.95;

struct Sag<S> {
    share: S,
    curvature: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Sag {
        share: p[0],
        curvature: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Sag<S> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        let power = motor.command * motor.speed;
        let sag = self.share * power.if_positive(power, S::zero());
        let lost = sag / self.curvature.fma(sag, S::one());
        let most = S::constant(MOST);
        -(motor.command * (most - lost).if_positive(lost, most))
    }

    fn uses_command(&self) -> bool {
        true
    }
}
