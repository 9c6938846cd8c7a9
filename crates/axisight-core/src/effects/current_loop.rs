//! A current loop of second order.

use super::{Acts, EffectInfo, Experiment, Family, Formula, Kernel, Linear, ParameterInfo, Prior, Resembles, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "current_loop",
    summary: "the drive follows the commanded torque with a lag of second order, and may overshoot",
    equation: "T^2 tau'' + 2 D T tau' + tau = u,  natural frequency 1 / (2 pi T)",
    source: "Leonhard (2001), Control of Electrical Drives, section 7.2 (closed current loop)",
    acts: Acts::TorquePath,
    family: Family::Timing,
    contains: &["actuator_bandwidth"],
    linear: Linear::Path,
    shown_by: &[Experiment::WideBand],
    formula: Formula::LAG,
    // With good damping it equals a delay of 2 D T up to the third power of frequency. Current
    // loops are as common as delays, and half of them have this damping.
    resembles: Some(Resembles {
        law: "input_delay",
        size: "time_constant_s",
        ratio: std::f64::consts::SQRT_2,
        shape: &[("damping", std::f64::consts::FRAC_1_SQRT_2)],
        rarer: 2.0,
    }),
    parameters: &[
        ParameterInfo {
            name: "time_constant_s",
            unit: "s",
            lower: 0.0,
            upper: 0.1,
            typical: 1e-3,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "damping",
            unit: "1",
            role: Role::Shape,
            neutral: 0.7,
            lower: 0.1,
            upper: 0.95,
            typical: 0.7,
            prior: Prior::LogNormal { spread: 0.3 },
            sizes: "Leonhard (2001), Control of Electrical Drives, section 7.2: loops are tuned to a damping of 0.7",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Loop<S> {
    time_constant: S,
    damping: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Loop {
        time_constant: p[0],
        damping: p[1],
    })
}

impl<S: Scalar> Kernel<S> for Loop<S> {
    fn current_loop(&self) -> Option<(S, S)> {
        Some((self.time_constant, self.damping))
    }
}
