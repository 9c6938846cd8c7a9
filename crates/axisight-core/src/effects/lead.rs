//! Friction against the speed that a motor is about to have.
//!
//! Simulators with soft constraints let friction act on `phi' + T a`, where `a` is the acceleration
//! that the motor has without this friction. Such friction holds a motor against torques below its
//! level, and lets a speed fade with the time constant `T`.

use super::{Joint, Kernel, Mark, Motor, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

/// Time by which a friction acts ahead of the speed.
pub(super) const LEAD: ParameterInfo = ParameterInfo {
    name: "lead_s",
    unit: "s",
    role: Role::Shape,
    lower: 0.0,
    upper: 1.0,
    typical: 9.5e-3,
    marks: &[Mark::Notation],
    prior: Prior::Uniform,
    sizes: "MuJoCo, constraint with the default solref and solimp: 0.02 s times 0.95 over two",
    ..ParameterInfo::PLAIN
};

struct Ahead<S> {
    friction: Box<dyn Kernel<S>>,
    lead: S,
}

/// Whether a friction acts ahead of the speed.
pub(super) fn has_lead<S: Scalar>(lead: S) -> bool {
    (0..S::LANES).any(|lane| lead.lane(lane) > 0.0)
}

/// The friction on the speed of the motor that is `lead` ahead; behind the gear it stays.
pub(super) fn ahead<S: Scalar>(friction: Box<dyn Kernel<S>>, lead: S) -> Box<dyn Kernel<S>> {
    Box::new(Ahead { friction, lead })
}

impl<S: Scalar> Kernel<S> for Ahead<S> {
    fn needs_acceleration(&self) -> bool {
        true
    }

    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        self.friction.motor_torque(&Motor {
            speed: self.lead.fma(motor.acceleration, motor.speed),
            ..*motor
        })
    }

    fn acts_behind_gear(&self) -> bool {
        self.friction.acts_behind_gear()
    }

    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        self.friction.joint_torque(joint)
    }
}
