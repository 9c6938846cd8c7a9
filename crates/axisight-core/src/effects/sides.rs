//! Dry friction on both sides of an elastic gear.

use super::{Joint, Kernel, Mark, Motor, ParameterInfo, Prior, Role};
use axisight_scalar::Scalar;

/// Share of a friction that acts on the arm, behind the gear.
pub(super) const ARM_SHARE: ParameterInfo = ParameterInfo {
    name: "arm_share",
    unit: "1",
    role: Role::Shape,
    lower: 0.0,
    upper: 1.0,
    typical: 0.5,
    marks: &[Mark::Place],
    prior: Prior::Uniform,
    sizes: "judgement: on which side of a gear its seals and bearings rub is known of none",
    ..ParameterInfo::PLAIN
};

/// A friction without states.
pub(super) trait Friction<S: Scalar>: Send + Sync + 'static {
    /// Torque on a motor [Nm], against its motion, at an angle [rad] and a speed [rad/s].
    fn torque(&self, angle: S, speed: S) -> S;
}

struct Sides<S, F> {
    friction: F,
    arm_share: S,
}

/// The kernel of a friction, with the share `arm_share` behind the gear. There it uses the angle
/// and speed of the joint, converted to those of a motor on a rigid gear.
pub(super) fn on_sides<S: Scalar>(friction: impl Friction<S>, arm_share: S) -> Box<dyn Kernel<S>> {
    Box::new(Sides {
        friction,
        arm_share,
    })
}

impl<S: Scalar, F: Friction<S>> Kernel<S> for Sides<S, F> {
    fn motor_torque(&self, motor: &Motor<'_, S>) -> S {
        (S::one() - self.arm_share) * self.friction.torque(motor.angle, motor.speed)
    }

    fn acts_behind_gear(&self) -> bool {
        let share = self.arm_share;
        let changes = |lane| (0..S::PARTIALS).any(|p| share.partial(p, lane) != 0.0);
        (0..S::LANES).any(|lane| share.lane(lane) != 0.0 || changes(lane))
    }

    fn joint_torque(&self, joint: &Joint<'_, S>) -> S {
        let turns = 1.0 / joint.ratio;
        let friction = self
            .friction
            .torque(joint.angle * turns, joint.speed * turns);
        self.arm_share * friction * turns
    }
}
