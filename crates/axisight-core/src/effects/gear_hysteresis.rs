//! Gear hysteresis: a spring beside the gear's own slips, and remembers.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Kernel, Linear, ParameterInfo, Role, Scope, Spring};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "gear_hysteresis",
    summary: "a loop of torque over deflection: a spring beside the gear's slips, or part of it",
    equation: "tau_g = k (1 - b a) delta + a k D z,  z' = (delta' - (|delta'| z + delta' |z|) / 2) / D",
    source: "Bouc-Wen model: Wen (1976), J. Eng. Mech. Div. 102(2), with A = n = 1, beta = gamma = 1/2; beside the spring as in Dhaouadi, Ghorbel, Gandhi (2003), IEEE Trans. Ind. Electron. 50(6)",
    scope: Scope::Axis,
    acts: Acts::Transmission,
    family: Family::Transmission,
    contains: &[],
    parts: &[],
    usual: &[],
    twins: &[],
    stands_for: None,
    linear: Linear::No,
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Stiffness, Absorber::Damping],
    shown_by: &[Experiment::Amplitudes],
    parameters: &[
        ParameterInfo {
            name: "share",
            unit: "1",
            role: Role::Amplitude,
            neutral: 0.0,
            lower: 0.0,
            upper: 10.0,
            typical: 0.3,
        },
        ParameterInfo {
            name: "deflection_rad",
            unit: "rad (joint side)",
            role: Role::Shape,
            neutral: 3e-4,
            lower: 1e-6,
            upper: 1.0,
            typical: 3e-4,
        },
        // Of a stiffness measured with small motions all, of one measured with large ones nothing.
        ParameterInfo {
            name: "included",
            unit: "1",
            role: Role::Shape,
            neutral: 0.0,
            lower: -0.5,
            upper: 1.5,
            typical: 0.5,
        },
    ],
};

struct Hysteresis<S> {
    share: S,
    deflection: S,
    included: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Hysteresis {
        share: p[0],
        deflection: p[1],
        included: p[2],
    })
}

impl<S: Scalar> Kernel<S> for Hysteresis<S> {
    fn n_internal(&self) -> usize {
        1
    }

    fn gear_torque(&self, spring: &Spring<'_, S>) -> S {
        // It starts relaxed, whatever the load at rest.
        let slipping = spring.internal.first().map_or_else(S::zero, |z| *z);
        let taken = self.included * spring.loaded;
        self.share * spring.stiffness * (self.deflection * slipping - taken)
    }

    fn gear_rates(&self, spring: &Spring<'_, S>, rates: &mut [S]) {
        if let (Some(z), Some(out)) = (spring.internal.first(), rates.first_mut()) {
            let slip = (spring.rate.abs() * *z + spring.rate * z.abs()) * 0.5;
            *out = (spring.rate - slip) / self.deflection;
        }
    }
}
