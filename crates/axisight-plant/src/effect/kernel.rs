//! The interface of an effect: the points where it may act, and the state of the plant there.

use crate::robot::{Body, Chain, ChainJoint, Motion};
use axisight_scalar::Scalar;

/// State of one motor, as an input of effects.
#[derive(Debug, Clone, Copy)]
pub struct Motor<'a, S> {
    /// Motor angle phi [rad].
    pub angle: S,
    /// Motor speed [rad/s].
    pub speed: S,
    /// Motor acceleration [rad/s^2]: that of a measured motion, or, for effects that need it, the
    /// acceleration without them. Zero for all others.
    pub acceleration: S,
    /// Commanded torque of the sample, u [Nm].
    pub command: S,
    /// Gear torque on the motor, motor side [Nm]; zero for a rigid transmission.
    pub load: S,
    /// The effect's own states; empty if nothing is integrated (inverse dynamics).
    pub internal: &'a [S],
}

/// Result of an effect on the geometric deflection of a gear.
#[derive(Clone, Copy)]
pub struct Deflected<S> {
    /// Deflection that loads the spring [rad].
    pub loaded: S,
    /// Slope of `loaded` over the geometric deflection.
    pub slope: S,
    /// Share of the geometric rate that the gear damps.
    pub damped: S,
}

/// State of a gear spring, as an input of effects.
#[derive(Debug, Clone, Copy)]
pub struct Spring<'a, S> {
    /// Deflection that loads the spring [rad].
    pub loaded: S,
    /// Its rate [rad/s]; zero at rest.
    pub rate: S,
    /// Stiffness of the linear spring [Nm/rad].
    pub stiffness: S,
    /// The effect's own states; empty at rest.
    pub internal: &'a [S],
}

/// State of a driven joint, as an input of effects.
#[derive(Debug, Clone, Copy)]
pub struct Joint<'a, S> {
    /// Joint angle q [rad].
    pub angle: S,
    /// Joint speed [rad/s]; zero at rest.
    pub speed: S,
    /// Gear ratio r, joint angle per motor angle.
    pub ratio: f64,
    /// The effect's own states; empty if nothing is integrated.
    pub internal: &'a [S],
}

/// State of one of two coupled axes.
#[derive(Debug, Clone, Copy)]
pub struct CoupledAxis<S> {
    /// Motor angle [rad].
    pub motor_angle: S,
    /// Motor speed [rad/s].
    pub motor_speed: S,
    /// Joint angle [rad].
    pub joint_angle: S,
    /// Joint speed [rad/s].
    pub joint_speed: S,
}

/// State of two coupled axes, as an input of effects between them.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a, S> {
    /// The axes in the order of the setting.
    pub axes: [CoupledAxis<S>; 2],
    /// The effect's own states; empty if nothing is integrated.
    pub internal: &'a [S],
}

/// Torque that an effect adds to an axis.
#[derive(Debug, Clone, Copy)]
pub struct AxisTorque<S> {
    /// On the motor shaft [Nm].
    pub motor: S,
    /// On the driven joint [Nm, joint side].
    pub joint: S,
}

impl<S: Scalar> AxisTorque<S> {
    /// No torque.
    pub fn zero() -> Self {
        let zero = S::zero();
        Self {
            motor: zero,
            joint: zero,
        }
    }
}

/// State of the arm, as an input of its effects. Joints are ordered from base to tip.
#[derive(Debug, Clone, Copy)]
pub struct Arm<'a, S> {
    /// Joint angles [rad].
    pub angles: &'a [S],
    /// Joint speeds [rad/s]; zero at rest.
    pub speeds: &'a [S],
    /// The effect's own states; empty if nothing is integrated.
    pub internal: &'a [S],
}

/// The parts of a plant that an effect of the arm or the transmission may change before a run.
#[derive(Debug)]
pub struct PlantParameters<'a, S> {
    /// Links of the chain, and gravity in the frame of the base.
    pub chain: &'a mut Chain<S>,
    /// Joint of the chain that the axis drives; `None` for arm effects.
    pub driven: Option<usize>,
    /// Joint of the chain that carries the link of the axis; `None` for arm effects or if there is
    /// no link with mass.
    pub link: Option<usize>,
    /// Gear stiffness of the axis [Nm/rad]; `None` for arm effects or a rigid transmission.
    pub stiffness: Option<&'a mut S>,
    /// Gear damping of the axis [Nm s/rad]; `None` as for the stiffness.
    pub damping: Option<&'a mut S>,
    /// Motor inertia of the axis [kg m^2]; `None` for arm effects.
    pub motor_inertia: Option<&'a mut S>,
}

impl<S: Scalar> PlantParameters<'_, S> {
    /// The joint that the axis drives; `None` for arm effects.
    pub fn joint(&mut self) -> Option<&mut ChainJoint<S>> {
        self.chain.joints.get_mut(self.driven?)
    }

    /// The joint on the link of the axis; `None` after the last one.
    pub fn next_joint(&mut self) -> Option<&mut ChainJoint<S>> {
        self.chain.joints.get_mut(self.link? + 1)
    }

    /// The body that moves with the axis; `None` if there is none.
    pub fn body(&mut self) -> Option<&mut Body<S>> {
        self.chain.joints[self.link?].body.as_mut()
    }
}

/// A spring below the arm: an elastic joint below the first one.
#[derive(Debug, Clone, Copy)]
pub struct BaseJoint<S> {
    /// Kind of motion of the joint.
    pub motion: Motion,
    /// Unit vector of its axis in the base frame.
    pub axis: [f64; 3],
    /// Stiffness [Nm/rad or N/m].
    pub stiffness: S,
    /// Damping [Nm s/rad or N s/m].
    pub damping: S,
    /// Body that moves with the joint, besides the arm.
    pub body: Option<Body<S>>,
}

/// Kinematic error of a gear over the motor angle.
#[derive(Debug, Clone, Copy)]
pub struct GearError<S> {
    /// Joint angle by which the gear leads [rad].
    pub ahead: S,
    /// Derivative of `ahead`, which is added to the gear ratio of rates.
    pub slope: S,
    /// Addition to the ratio by which the gear's torque acts on the motor. It equals `slope` if the
    /// gear conserves power.
    pub returned: S,
}

/// An effect: the points where it may act. Every default means that it does not act there.
///
/// The effect's own states start at zero. Their rates are requested at the point of action, for
/// example by [`Kernel::motor_rates`] for an effect on the motor.
pub trait Kernel<S: Scalar>: Send + Sync {
    /// Number of the effect's own states.
    fn n_internal(&self) -> usize {
        0
    }

    /// Value of a single own state that depends only on the time since the start of the log; `None`
    /// for all other effects.
    fn state_at(&self, _time: S) -> Option<S> {
        None
    }

    /// Change masses, inertias, stiffness or gravity before the run.
    fn prepare(&self, _plant: &mut PlantParameters<'_, S>) {}
    /// Springs below the first joint, from ground to arm.
    fn base_joints(&self) -> Vec<BaseJoint<S>> {
        Vec::new()
    }

    /// Command [Nm] that the drive accepts, before any delay or lag. Example: a limit.
    fn command(&self, torque: S) -> S {
        torque
    }
    /// Motor torque [Nm] for the torque that the drive delivers; must be affine.
    fn drive(&self, torque: S) -> S {
        torque
    }
    /// Inverse of [`Kernel::drive`], for the static torque at rest.
    fn drive_inverse(&self, torque: S) -> S {
        torque
    }
    /// Transport delay of the command [s].
    fn delay(&self) -> Option<S> {
        None
    }
    /// Time constant of the current loop [s], of first order.
    fn lag(&self) -> Option<S> {
        None
    }
    /// Time constant [s] and damping ratio of the current loop, of second order.
    fn current_loop(&self) -> Option<(S, S)> {
        None
    }

    /// Torque added on the motor shaft [Nm]; friction is negative for positive speed.
    fn motor_torque(&self, _motor: &Motor<'_, S>) -> S {
        S::zero()
    }
    /// Whether [`Kernel::motor_torque`] depends on the acceleration.
    fn needs_acceleration(&self) -> bool {
        false
    }
    /// Whether [`Kernel::motor_torque`] depends on the command.
    fn uses_command(&self) -> bool {
        false
    }
    /// Rates of the effect's own states on a motor [1/s].
    fn motor_rates(&self, _motor: &Motor<'_, S>, _rates: &mut [S]) {}

    /// Loaded deflection of the gear for a geometric deflection [rad].
    fn deflection(&self, delta: S) -> Deflected<S> {
        Deflected {
            loaded: delta,
            slope: S::one(),
            damped: S::one(),
        }
    }
    /// Geometric deflection for a loaded one, the inverse of [`Kernel::deflection`] at rest.
    fn deflection_inverse(&self, loaded: S) -> S {
        loaded
    }
    /// Gear torque added to the linear spring and damper [Nm, joint side]. A restoring or damping
    /// torque is positive for a positive deflection or rate.
    fn gear_torque(&self, _spring: &Spring<'_, S>) -> S {
        S::zero()
    }
    /// Rates of the effect's own states in a gear [1/s].
    fn gear_rates(&self, _spring: &Spring<'_, S>, _rates: &mut [S]) {}
    /// Kinematic error of the gear at a motor angle.
    fn transmission_error(&self, _angle: S) -> Option<GearError<S>> {
        None
    }

    /// Whether the torque on the motor also acts on the driven joint, behind the gear.
    fn acts_behind_gear(&self) -> bool {
        false
    }
    /// Torque added on the driven joint, joint side [Nm].
    fn joint_torque(&self, _joint: &Joint<'_, S>) -> S {
        S::zero()
    }
    /// Rates of the effect's own states on a joint [1/s].
    fn joint_rates(&self, _joint: &Joint<'_, S>, _rates: &mut [S]) {}

    /// Torques added on two axes, in the order of the axes.
    fn pair_torque(&self, _pair: &Pair<'_, S>) -> [AxisTorque<S>; 2] {
        [AxisTorque::zero(); 2]
    }
    /// Turn of the second axis' gear per turn of the first axis (joint side).
    fn turns_next(&self) -> Option<S> {
        None
    }
    /// Rates of the effect's own states between two axes [1/s].
    fn pair_rates(&self, _pair: &Pair<'_, S>, _rates: &mut [S]) {}

    /// Add the forces on the joints of the arm [Nm or N] to `force`, one entry per joint.
    fn arm_force(&self, _arm: &Arm<'_, S>, _force: &mut [S]) {}
    /// Rates of the effect's own states on the arm [1/s].
    fn arm_rates(&self, _arm: &Arm<'_, S>, _rates: &mut [S]) {}

    /// Relative error of the controller's clock [1]; positive if it is fast compared with the clock
    /// of the logs.
    fn clock_drift(&self) -> Option<S> {
        None
    }
    /// Factors of the controller's gains [1]: proportional, integral, and the position gain of a
    /// cascade.
    fn controller_gains(&self) -> Option<[S; 3]> {
        None
    }
    /// Feed-forward gains of the controller: for the rate of the reference [Nm s^2/rad], and for
    /// the reference itself [Nm s/rad].
    fn feedforward(&self) -> Option<[S; 2]> {
        None
    }
    /// Time constant of the controller's speed filter [s]; `None` at zero.
    fn speed_filter(&self) -> Option<S> {
        None
    }

    /// Share of the commanded torque that the drive reports [1].
    fn reported_share(&self) -> Option<S> {
        None
    }
    /// Error added to the measured motor position [rad].
    fn sensor(&self, _angle: S) -> S {
        S::zero()
    }
    /// Delay of the motor position reading [s].
    fn reading_delay(&self) -> Option<S> {
        None
    }
    /// Step of the position sensor [rad].
    fn resolution(&self) -> Option<S> {
        None
    }
    /// Error [rad] of a joint encoder from which the motor position is computed. Its value at the
    /// start of a run does not count.
    fn joint_sensor(&self, _angle: S) -> Option<S> {
        None
    }
}
