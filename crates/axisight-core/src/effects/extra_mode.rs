//! A mode that the simulator lacks: a mass that swings on a spring at the joint.

use super::{Absorber, Acts, EffectInfo, Experiment, Family, Joint, Kernel, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

pub(super) static INFO: EffectInfo = EffectInfo {
    name: "extra_mode",
    summary: "something on the joint (a tool, a hose, a structure) swings on a spring",
    equation: "x' = v,  v' = w^2 (q - x) + 2 z w (q' - v),  tau = -J v' on the joint",
    source: "Den Hartog (1956), Mechanical Vibrations, section 3.3 (damped vibration absorber)",
    acts: Acts::Joint,
    family: Family::Arm,
    usual: &["link_inertia"],
    inverse_dynamics: false,
    absorbed_by: &[Absorber::Links],
    shown_by: &[Experiment::WideBand],
    parameters: &[
        ParameterInfo {
            name: "inertia_kg_m2",
            unit: "kg m^2 (joint side)",
            lower: 0.0,
            upper: 1e6,
            typical: 20.0,
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "frequency_hz",
            unit: "Hz",
            role: Role::Shape,
            neutral: 15.0,
            lower: 0.5,
            upper: 200.0,
            typical: 15.0,
            prior: Prior::LogNormal { spread: 0.7 },
            sizes: "judgement: tools, hoses and structures swing at 4 to 60 Hz",
            ..ParameterInfo::PLAIN
        },
        ParameterInfo {
            name: "damping",
            unit: "1",
            role: Role::Shape,
            neutral: 0.05,
            lower: 1e-3,
            upper: 1.0,
            typical: 0.05,
            prior: Prior::LogNormal { spread: 1.0 },
            sizes: "judgement: damping of structures, a factor of seven either way (95 %)",
            ..ParameterInfo::PLAIN
        },
    ],
    ..EffectInfo::PLAIN
};

struct Mode<S> {
    inertia: S,
    rate: S,
    damping: S,
}

pub(super) fn kernel<S: Scalar>(p: &[S]) -> Box<dyn Kernel<S>> {
    Box::new(Mode {
        inertia: p[0],
        rate: p[1] * std::f64::consts::TAU,
        damping: p[2],
    })
}

impl<S: Scalar> Mode<S> {
    /// Acceleration of the swinging mass. Its states are its lag behind the joint and its speed.
    fn acceleration(&self, joint: &Joint<'_, S>) -> S {
        let [behind, speed] = joint.internal else {
            // At rest the mass does not accelerate.
            return S::zero();
        };
        let damper = self.damping * self.rate;
        self.rate * self.rate * *behind + (damper + damper) * (joint.speed - *speed)
    }
}

impl<S: Scalar> Kernel<S> for Mode<S> {
    fn n_internal(&self) -> usize {
        2
    }

    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        -(self.inertia * self.acceleration(joint))
    }

    fn joint_rates(&self, joint: &Joint<'_, S>, rates: &mut [S]) {
        if let ([_, speed], [behind, swing]) = (joint.internal, rates) {
            *behind = joint.speed - *speed;
            *swing = self.acceleration(joint);
        }
    }
}
