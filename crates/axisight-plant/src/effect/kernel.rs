//! The points where an effect may act, and what it sees there.

use crate::robot::{Body, Chain, ChainJoint, Motion};
use axisight_scalar::Scalar;

/// State of one motor as its effects see it.
#[derive(Debug, Clone, Copy)]
pub struct Motor<'a, S> {
    /// Motor angle phi [rad].
    pub angle: S,
    /// Motor speed [rad/s].
    pub speed: S,
    /// Commanded torque of the sample, u [Nm].
    pub command: S,
    /// Gear torque the motor carries, motor side [Nm]; zero for a rigid transmission.
    pub load: S,
    /// States of the effect itself; empty where nothing is integrated (inverse dynamics).
    pub internal: &'a [S],
}

/// What a gear makes of its geometric deflection.
#[derive(Clone, Copy)]
pub struct Deflected<S> {
    /// Deflection that loads the spring [rad].
    pub loaded: S,
    /// Its slope over the geometric one.
    pub slope: S,
    /// Share of the geometric rate that the gear damps.
    pub damped: S,
}

/// State of a gear spring as its effects see it.
#[derive(Debug, Clone, Copy)]
pub struct Spring<'a, S> {
    /// Deflection that loads the spring [rad].
    pub loaded: S,
    /// Its rate [rad/s]; zero at rest.
    pub rate: S,
    /// Stiffness of the linear spring [Nm/rad].
    pub stiffness: S,
    /// States of the effect itself; empty at rest.
    pub internal: &'a [S],
}

/// State of a driven joint as its effects see it.
#[derive(Debug, Clone, Copy)]
pub struct Joint<'a, S> {
    /// Joint angle q [rad].
    pub angle: S,
    /// Joint speed [rad/s]; zero at rest.
    pub speed: S,
    /// Gear ratio r, joint angle per motor angle.
    pub ratio: f64,
    /// States of the effect itself; empty where nothing is integrated.
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

/// State of two axes as an effect between them sees it.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a, S> {
    /// The axes in the order of the setting.
    pub axes: [CoupledAxis<S>; 2],
    /// States of the effect itself; empty where nothing is integrated.
    pub internal: &'a [S],
}

/// What an effect adds to an axis.
#[derive(Debug, Clone, Copy)]
pub struct AxisTorque<S> {
    /// On the motor shaft [Nm].
    pub motor: S,
    /// On the driven joint [Nm, joint side].
    pub joint: S,
}

impl<S: Scalar> AxisTorque<S> {
    /// Nothing.
    pub fn zero() -> Self {
        let zero = S::zero();
        Self {
            motor: zero,
            joint: zero,
        }
    }
}

/// State of the arm as its effects see it; joints of the robot, base to tip.
#[derive(Debug, Clone, Copy)]
pub struct Arm<'a, S> {
    /// Joint angles [rad].
    pub angles: &'a [S],
    /// Joint speeds [rad/s]; zero at rest.
    pub speeds: &'a [S],
    /// States of the effect itself; empty where nothing is integrated.
    pub internal: &'a [S],
}

/// The parts of a plant an arm or transmission effect may change before a run.
#[derive(Debug)]
pub struct PlantParameters<'a, S> {
    /// Links, and gravity in the frame of the base.
    pub chain: &'a mut Chain<S>,
    /// Joint of the chain that the axis drives; `None` for arm effects.
    pub driven: Option<usize>,
    /// Joint of the chain that carries the link of the axis; `None` for arm effects or without mass.
    pub link: Option<usize>,
    /// Gear stiffness of the axis [Nm/rad]; `None` for arm effects or a rigid transmission.
    pub stiffness: Option<&'a mut S>,
    /// Gear damping of the axis [Nm s/rad]; `None` as for the stiffness.
    pub damping: Option<&'a mut S>,
    /// Motor inertia of the axis [kg m^2]; `None` for arm effects.
    pub motor_inertia: Option<&'a mut S>,
}

impl<S: Scalar> PlantParameters<'_, S> {
    /// The joint that the axis drives.
    pub fn joint(&mut self) -> Option<&mut ChainJoint<S>> {
        self.chain.joints.get_mut(self.driven?)
    }

    /// The joint that the link of the axis carries; `None` behind the last.
    pub fn next_joint(&mut self) -> Option<&mut ChainJoint<S>> {
        self.chain.joints.get_mut(self.link? + 1)
    }

    /// The body that moves with the axis.
    pub fn body(&mut self) -> Option<&mut Body<S>> {
        self.chain.joints[self.link?].body.as_mut()
    }
}

/// A spring the arm stands on: an elastic joint below the first one.
#[derive(Debug, Clone, Copy)]
pub struct BaseJoint<S> {
    /// How it moves.
    pub motion: Motion,
    /// Unit vector of its axis in the base frame.
    pub axis: [f64; 3],
    /// Stiffness [Nm/rad or N/m].
    pub stiffness: S,
    /// Damping [Nm s/rad or N s/m].
    pub damping: S,
    /// What moves with it besides the arm.
    pub body: Option<Body<S>>,
}

/// Kinematic error of a gear over the motor angle.
#[derive(Debug, Clone, Copy)]
pub struct GearError<S> {
    /// Joint angle by which the gear runs ahead [rad].
    pub ahead: S,
    /// Its derivative: what it adds to the gear ratio of rates.
    pub slope: S,
    /// What it adds to the ratio at which the gear's torque returns to the motor: the slope itself
    /// where the gear conserves power.
    pub returned: S,
}

/// The points where an effect may act; every default is "not here".
///
/// States of its own start at zero; their rates are asked for where the effect acts
/// ([`Kernel::motor_rates`] for an effect on the motor, and so on).
pub trait Kernel<S: Scalar>: Send + Sync {
    /// Number of states the effect has of its own.
    fn n_internal(&self) -> usize {
        0
    }

    /// The state of an effect whose one state moves with the time since the log began alone; `None` of all others.
    fn state_at(&self, _time: S) -> Option<S> {
        None
    }

    /// Change masses, stiffness or gravity before the run.
    fn prepare(&self, _plant: &mut PlantParameters<'_, S>) {}
    /// Springs below the first joint, ground to arm.
    fn base_joints(&self) -> Vec<BaseJoint<S>> {
        Vec::new()
    }

    /// What the drive makes of a command before any delay or lag, e.g. a limit [Nm].
    fn command(&self, torque: S) -> S {
        torque
    }
    /// Motor torque as an affine function of the torque the drive delivers [Nm].
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
    /// Whether [`Kernel::motor_torque`] depends on the command.
    fn uses_command(&self) -> bool {
        false
    }
    /// Rates of the effect's own states on a motor [1/s].
    fn motor_rates(&self, _motor: &Motor<'_, S>, _rates: &mut [S]) {}

    /// What a geometric deflection [rad] makes of the gear.
    fn deflection(&self, delta: S) -> Deflected<S> {
        Deflected {
            loaded: delta,
            slope: S::one(),
            damped: S::one(),
        }
    }
    /// Deflection from the one that loads the spring; `delta` for [`Kernel::deflection`] at rest.
    fn deflection_inverse(&self, loaded: S) -> S {
        loaded
    }
    /// Gear torque added to the linear spring and damper [Nm, joint side]; positive for a positive
    /// deflection or rate where it restores or damps.
    fn gear_torque(&self, _spring: &Spring<'_, S>) -> S {
        S::zero()
    }
    /// Rates of the effect's own states in a gear [1/s].
    fn gear_rates(&self, _spring: &Spring<'_, S>, _rates: &mut [S]) {}
    /// Kinematic error of the gear over the motor angle.
    fn transmission_error(&self, _angle: S) -> Option<GearError<S>> {
        None
    }

    /// Whether what acts on the motor also acts on the driven joint, behind the gear.
    fn acts_behind_gear(&self) -> bool {
        false
    }
    /// Torque added on the driven joint, joint side [Nm].
    fn joint_torque(&self, _joint: &Joint<'_, S>) -> S {
        S::zero()
    }
    /// Rates of the effect's own states on a joint [1/s].
    fn joint_rates(&self, _joint: &Joint<'_, S>, _rates: &mut [S]) {}

    /// Torques added on two axes, in their order.
    fn pair_torque(&self, _pair: &Pair<'_, S>) -> [AxisTorque<S>; 2] {
        [AxisTorque::zero(); 2]
    }
    /// Share of the first axis' turn (joint side) by which the gear of the second one is turned.
    fn turns_next(&self) -> Option<S> {
        None
    }
    /// Rates of the effect's own states between two axes [1/s].
    fn pair_rates(&self, _pair: &Pair<'_, S>, _rates: &mut [S]) {}

    /// Add forces on the joints of the arm [Nm or N] to `force`, one entry a joint.
    fn arm_force(&self, _arm: &Arm<'_, S>, _force: &mut [S]) {}
    /// Rates of the effect's own states on the arm [1/s].
    fn arm_rates(&self, _arm: &Arm<'_, S>, _rates: &mut [S]) {}

    /// By how much the controller's clock is fast against that of the logs [1].
    fn clock_drift(&self) -> Option<S> {
        None
    }
    /// Factors of the controller's proportional and integral gain, and of a cascade's gain of position [1].
    fn controller_gains(&self) -> Option<[S; 3]> {
        None
    }
    /// What the controller adds to its command for the rate of the reference [Nm s^2/rad] and for the
    /// reference itself [Nm s/rad].
    fn feedforward(&self) -> Option<[S; 2]> {
        None
    }
    /// Time constant of the filter through which the controller takes the speed [s]; `None` at zero.
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
    /// By how much the motor position is read late [s].
    fn reading_delay(&self) -> Option<S> {
        None
    }
    /// Step of the position sensor [rad].
    fn resolution(&self) -> Option<S> {
        None
    }
    /// Error of the measured joint angle [rad], from which the motor position is taken; what it is
    /// where a run begins counts for nothing.
    fn joint_sensor(&self, _angle: S) -> Option<S> {
        None
    }
}
