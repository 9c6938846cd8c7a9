//! Description of a robot: a tree of joints, links and drives, in SI units. Most are serial chains.
//!
//! The checks here are physical and independent of files. The reader of robot files runs them and
//! reports the place of an error in the file.

use super::accelerometer::Accelerometer;
use super::setting::EffectSetting;
use std::sync::Arc;

/// Kind of motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Turns about its axis; angles in rad, torques in Nm.
    Revolute,
    /// Slides along its axis; "angles" in m, "torques" in N.
    Prismatic,
}

/// Spring and damper of a gearbox or an elastic joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliance {
    /// Stiffness, positive [Nm/rad; N/m if prismatic].
    pub stiffness: f64,
    /// Damping, not negative [Nm s/rad; N s/m if prismatic].
    pub damping: f64,
}

/// Mass properties of the body that moves with a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Mass, positive [kg].
    pub mass: f64,
    /// Centre of mass in the link frame [m].
    pub com: [f64; 3],
    /// Inertia about the centre of mass, link axes: Ixx Iyy Izz Ixy Ixz Iyz,
    /// positive definite [kg m^2].
    pub inertia: [f64; 6],
}

/// Motor and gear of a driven joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Joint angle per motor angle, not zero; negative if the joint turns the
    /// other way [rad/rad; m/rad if prismatic].
    pub gear_ratio: f64,
    /// Motor inertia, motor side; positive, or zero with a rigid transmission [kg m^2].
    pub motor_inertia: f64,
    /// Viscous friction, motor side, not negative [Nm s/rad].
    pub viscous_friction: f64,
}

/// One joint and the link it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name, unique in the robot.
    pub name: String,
    /// Index of the joint whose link carries this joint, below the joint's own index; `None` is the
    /// base.
    pub parent: Option<usize>,
    /// How the joint moves.
    pub motion: Motion,
    /// Position of the joint in the parent link's frame [m].
    pub origin: [f64; 3],
    /// Unit vector of the axis in the parent link's frame [1].
    pub axis: [f64; 3],
    /// Gearbox of a driven joint, spring of an elastic one; `None` is a rigid
    /// transmission, which only a driven joint can have.
    pub compliance: Option<Compliance>,
    /// Body that moves with the joint; `None` is massless.
    pub link: Option<Link>,
    /// Motor and gear: `Some` exactly for a driven joint.
    pub drive: Option<Drive>,
}

/// Controller of the robot, with one gain per driven joint, motor side.
#[derive(Debug, Clone, PartialEq)]
pub enum Controller {
    /// `u = u_ff + kp (w_ref - w) + ki (phi_ref - phi)`.
    PiVelocity {
        /// Velocity gain [Nm s/rad].
        kp: Vec<f64>,
        /// Integral gain of the velocity error [Nm/rad].
        ki: Vec<f64>,
    },
    /// Velocity loop without integral action.
    PVelocity {
        /// Velocity gain [Nm s/rad].
        kp: Vec<f64>,
    },
    /// Position P loop around a velocity PI loop.
    Cascade {
        /// Position gain [1/s].
        kv: Vec<f64>,
        /// Velocity gain [Nm s/rad].
        kp: Vec<f64>,
        /// Integral gain of the velocity error, zero for a velocity P loop [Nm/rad].
        ki: Vec<f64>,
        /// Kind of the references: `None` for speeds, `Some` for positions. With positions, the
        /// value says whether the rate of the positions is the speed reference; otherwise that
        /// reference is zero.
        told_positions: Option<bool>,
    },
    /// PD control of position: `u = u_ff + kp (phi_ref - phi) + kd (w_ref - w)`.
    PdPosition {
        /// Position gain [Nm/rad].
        kp: Vec<f64>,
        /// Velocity gain [Nm s/rad].
        kd: Vec<f64>,
        /// Whether `w_ref` is the rate of the position references; otherwise it is zero.
        feeds_speed: bool,
        /// Whether the law also acts between samples, as in an actuator of a simulator or a drive
        /// that is much faster than the sample time.
        continuous: bool,
        /// Robot model of the controller; without one, `u_ff` is constant. Fits do not change this
        /// model.
        known: Option<Known>,
        /// Simulator that executes the law; `None` for a real machine.
        stepped: Option<Stepped>,
    },
    /// No controller: logs are torque-driven only.
    None,
}

/// How a controller uses its robot model, which has rigid joints.
#[derive(Debug, Clone, PartialEq)]
pub enum Known {
    /// `u_ff` follows the gravity torque at the measured pose.
    Gravity(Arc<RobotDescription>),
    /// Computed torque. The gains [1/s^2] and [1/s] turn errors into accelerations, and the
    /// acceleration of the references is added. `u` is the torque for this acceleration, with
    /// `c(q, q') + g(q)` at the measured motion.
    Dynamics(Arc<RobotDescription>),
}

/// How the steps of a simulator change a control law: forces act around the start of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Stepped {
    /// Step [s]. A reference acts from half a step earlier.
    pub step: f64,
    /// Inertia that the simulator's treatment of damping adds to each motor [kg m^2].
    pub inertia: Vec<f64>,
}

impl Controller {
    /// Whether the references are positions.
    pub fn has_targets(&self) -> bool {
        match self {
            Self::PdPosition { .. } => true,
            Self::Cascade { told_positions, .. } => told_positions.is_some(),
            _ => false,
        }
    }

    /// The same controller for a loop that is `factor` times as fast: damping gains grow with the
    /// factor, stiffness gains with its square.
    #[must_use]
    pub fn at_speed(&self, factor: f64) -> Self {
        let scaled = |gains: &[f64], by: f64| gains.iter().map(|g| g * by).collect();
        match self {
            Self::PiVelocity { kp, ki } => Self::PiVelocity {
                kp: scaled(kp, factor),
                ki: scaled(ki, factor * factor),
            },
            Self::PVelocity { kp } => Self::PVelocity {
                kp: scaled(kp, factor),
            },
            Self::Cascade {
                kv,
                kp,
                ki,
                told_positions,
            } => Self::Cascade {
                kv: scaled(kv, factor),
                kp: scaled(kp, factor),
                ki: scaled(ki, factor * factor),
                told_positions: *told_positions,
            },
            Self::PdPosition {
                kp,
                kd,
                feeds_speed,
                continuous,
                known,
                stepped,
            } => Self::PdPosition {
                kp: scaled(kp, factor * factor),
                kd: scaled(kd, factor),
                feeds_speed: *feeds_speed,
                continuous: *continuous,
                known: known.clone(),
                stepped: stepped.clone(),
            },
            Self::None => Self::None,
        }
    }
}

/// A robot on a fixed or a floating base, from the base to the tips.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotDescription {
    /// Name for people.
    pub name: String,
    /// Gravity in the base frame; with a floating base, in the world frame [m/s^2].
    pub gravity: [f64; 3],
    /// The link of a floating base; `None` for a fixed base.
    pub floating_base: Option<Link>,
    /// Sample time of controller and log, positive [s].
    pub sample_time: f64,
    /// Joints, every one behind its parent; link `i` moves with joint `i`.
    pub joints: Vec<Joint>,
    /// Controller.
    pub controller: Controller,
    /// Standard deviation of the white noise on motor positions, per sample [rad].
    pub position_noise_std: f64,
    /// Angles of the driven joints at the operating point, in chain order
    /// [rad; m if prismatic].
    pub operating_point: Vec<f64>,
    /// Accelerometers on the links.
    pub accelerometers: Vec<Accelerometer>,
    /// Effects that the robot's own simulator includes.
    pub effects: Vec<EffectSetting<f64>>,
    /// Relative tolerance of the robot's own parameters by quantity, if stated.
    pub tolerances: Vec<(String, f64)>,
}

impl RobotDescription {
    /// Number of joints, driven and elastic.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Driven joints in chain order, each with its 0-based place in the chain
    /// and its drive.
    pub fn driven(&self) -> impl Iterator<Item = (usize, &Joint, &Drive)> {
        self.joints
            .iter()
            .enumerate()
            .filter_map(|(i, joint)| joint.drive.as_ref().map(|drive| (i, joint, drive)))
    }

    /// The robot's own effects, without those that `settings` replaces.
    pub fn effects_beside<S>(
        &self,
        settings: &[EffectSetting<S>],
    ) -> impl Iterator<Item = &EffectSetting<f64>> {
        let kept = move |own: &&EffectSetting<f64>| !settings.iter().any(|s| s.replaces(own));
        self.effects.iter().filter(kept)
    }

    /// The robot without effects, and the list of its own effects together with `settings`.
    ///
    /// A setting replaces the robot's own effect of the same name and place.
    #[must_use]
    pub fn with_all_effects(
        &self,
        settings: &[EffectSetting<f64>],
    ) -> (Self, Vec<EffectSetting<f64>>) {
        let mut all: Vec<_> = self.effects_beside(settings).cloned().collect();
        all.extend_from_slice(settings);
        let bare = Self {
            effects: Vec::new(),
            ..self.clone()
        };
        (bare, all)
    }

    /// Number of driven joints.
    pub fn n_axes(&self) -> usize {
        self.driven().count()
    }

    /// The last joint that moves no inertia, if any. Such a joint makes the inertia matrix singular
    /// in every pose.
    pub fn joint_without_inertia(&self) -> Option<usize> {
        let mut moves_mass = vec![false; self.joints.len()];
        for (i, joint) in self.joints.iter().enumerate().rev() {
            moves_mass[i] |= joint.link.is_some();
            if let Some(parent) = joint.parent {
                moves_mass[parent] |= moves_mass[i];
            }
        }
        let mut joints = self.joints.iter().zip(&moves_mass);
        joints.rposition(|(joint, moves_mass)| !moves_mass && !joint.carries_inertia())
    }

    /// Whether each joint sits on the link of the joint before it, and the first one on the base.
    pub fn is_chain(&self) -> bool {
        let mut joints = self.joints.iter().enumerate();
        joints.all(|(i, joint)| joint.parent == i.checked_sub(1))
    }

    /// The joint that carries the link of a driven axis: the first joint with mass, from the driven
    /// one on, that moves with it but with no further axis.
    pub fn link_of_axis(&self, index: usize) -> Option<usize> {
        let (driven, ..) = self.driven().nth(index)?;
        let parent = |i: usize| self.joints[i].parent;
        let is_driven = |i: usize| self.joints[i].drive.is_some();
        (driven..self.joints.len())
            .find(|i| self.joints[*i].link.is_some() && moves_with(*i, driven, parent, is_driven))
    }

    /// The first pair of joints (earlier, later) that share a name.
    pub fn duplicate_name(&self) -> Option<(usize, usize)> {
        self.joints.iter().enumerate().find_map(|(later, joint)| {
            let earlier = self.joints.iter().take(later);
            let earlier = earlier
                .map(|other| &other.name)
                .position(|name| *name == joint.name);
            earlier.map(|earlier| (earlier, later))
        })
    }
}

/// Whether link `i` moves with the driven joint `axis`, and no joint between both is driven.
pub(crate) fn moves_with(
    i: usize,
    axis: usize,
    parent: impl Fn(usize) -> Option<usize>,
    is_driven: impl Fn(usize) -> bool,
) -> bool {
    let mut at = i;
    while at != axis {
        match parent(at) {
            Some(before) if !is_driven(at) => at = before,
            _ => return false,
        }
    }
    true
}

impl Joint {
    /// Whether the joint moves its own mass, or a rotor through a rigid transmission.
    fn carries_inertia(&self) -> bool {
        let has_rotor = |drive: &Drive| drive.motor_inertia > 0.0;
        let rigid = self.compliance.is_none();
        self.link.is_some() || (rigid && self.drive.as_ref().is_some_and(has_rotor))
    }
}

/// Allowed range of a finite number.
#[derive(Debug, Clone, Copy)]
pub enum Bound {
    /// Any sign.
    Any,
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Either sign, not zero.
    NotZero,
}

impl Bound {
    /// Whether `x` is finite and within the bound.
    pub fn allows(self, x: f64) -> bool {
        x.is_finite()
            && match self {
                Self::Any => true,
                Self::Positive => x > 0.0,
                Self::NotNegative => x >= 0.0,
                Self::NotZero => x != 0.0,
            }
    }

    /// The bound in words, for messages with "expected ...".
    pub fn describe(self, unit: &str) -> String {
        let kind = match self {
            Self::Any => "a finite number",
            Self::Positive => "a positive number",
            Self::NotNegative => "a number not below zero",
            Self::NotZero => "a number other than zero",
        };
        format!("{kind} [{unit}]")
    }
}

/// Check that a vector is of unit length to `tolerance`.
///
/// # Errors
/// The actual length.
pub fn check_unit(axis: &[f64; 3], tolerance: f64) -> Result<(), f64> {
    let [x, y, z] = *axis;
    let norm = x.hypot(y).hypot(z);
    if (norm - 1.0).abs() <= tolerance {
        Ok(())
    } else {
        Err(norm)
    }
}

/// Whether the symmetric matrix xx yy zz xy xz yz is positive definite.
///
/// The pivots of its `L D L^T` decomposition must be positive by more than
/// rounding: a singular matrix with decimal entries has a last pivot of either
/// sign near 1e-16.
pub fn is_positive_definite(matrix: &[f64; 6]) -> bool {
    let [xx, yy, zz, xy, xz, yz] = *matrix;
    let rounding = 1e-14 * xx.max(yy).max(zz);
    let second = yy - xy / xx * xy;
    let coupling = yz - xy / xx * xz;
    let third = zz - xz / xx * xz - coupling / second * coupling;
    // In this form, a NaN pivot after a zero pivot also fails.
    [xx, second, third].iter().all(|pivot| *pivot > rounding)
}
