//! What an effect is: its description and the points where it may act.

use crate::robot::Chain;
use axisight_scalar::Scalar;

/// Whether an effect belongs to one driven axis or to the arm as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One driven axis.
    Axis,
    /// The whole arm.
    Arm,
}

/// Where in the signal path an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// Between commanded and applied motor torque.
    TorquePath,
    /// Torque on the motor shaft.
    Motor,
    /// Between motor and joint.
    Transmission,
    /// Torque on the driven joint.
    Joint,
    /// Masses and springs of the arm.
    Arm,
    /// Between true and measured motor position.
    Sensor,
}

/// What a parameter does to an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The effect vanishes when every amplitude is at its neutral value.
    Amplitude,
    /// Shapes the effect; any value is neutral once the amplitudes are.
    Shape,
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy)]
pub struct ParameterInfo {
    /// Name with its unit as suffix, e.g. `coulomb_nm`.
    pub name: &'static str,
    /// Unit, e.g. `Nm`; `1` when dimensionless.
    pub unit: &'static str,
    /// Amplitude or shape.
    pub role: Role,
    /// Value at which the effect vanishes (amplitude) or the usual value (shape).
    pub neutral: f64,
    /// Smallest admissible value.
    pub lower: f64,
    /// Largest admissible value.
    pub upper: f64,
    /// Typical magnitude: natural scale of a search and width of a plausible range.
    pub typical: f64,
}

/// Description of an effect.
#[derive(Debug)]
pub struct EffectInfo {
    /// Name as in the verdict vocabulary.
    pub name: &'static str,
    /// One line for people.
    pub summary: &'static str,
    /// Equation in the notation of the thesis.
    pub equation: &'static str,
    /// Where the equation comes from.
    pub source: &'static str,
    /// Axis or arm.
    pub scope: Scope,
    /// Point of action.
    pub acts: Acts,
    /// Parameters in kernel order.
    pub parameters: &'static [ParameterInfo],
}

/// Misuse of the effect table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No effect has this name.
    #[error("effect `{name}`: expected one of {expected}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The known names.
        expected: String,
    },
    /// Wrong number of parameters.
    #[error("effect `{effect}`: expected {expected} parameters, got {got}")]
    ParameterCount {
        /// Effect.
        effect: &'static str,
        /// Length of its parameter table.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// An axis effect without a valid axis, or an arm effect with one.
    #[error("effect `{effect}`: expected {expected}, got {got}")]
    Axis {
        /// Effect.
        effect: &'static str,
        /// What its scope asks for.
        expected: String,
        /// What came.
        got: String,
    },
    /// A parameter outside its bounds or not finite.
    #[error("effect `{effect}`: parameter `{parameter}`: expected {lower} to {upper}, got {got}")]
    Bounds {
        /// Effect.
        effect: &'static str,
        /// Parameter.
        parameter: &'static str,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Value given.
        got: f64,
    },
}

impl EffectError {
    pub(super) fn unknown(name: &str) -> Self {
        let names: Vec<_> = super::EFFECTS.iter().map(|e| e.name).collect();
        Self::Unknown {
            name: name.to_owned(),
            expected: names.join(", "),
        }
    }
}

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

/// The parts of a plant an arm or transmission effect may change before a run.
#[derive(Debug)]
pub struct PlantParameters<'a, S> {
    /// Links.
    pub chain: &'a mut Chain<S>,
    /// Gear stiffness of the axis [Nm/rad]; `None` for arm effects or a rigid transmission.
    pub stiffness: Option<&'a mut S>,
    /// Gear damping of the axis [Nm s/rad]; `None` as for the stiffness.
    pub damping: Option<&'a mut S>,
    /// Motor inertia of the axis [kg m^2]; `None` for arm effects.
    pub motor_inertia: Option<&'a mut S>,
}

/// The points where an effect may act; every default is "not here".
pub trait Kernel<S: Scalar>: Send + Sync {
    /// Change masses or stiffness before the run.
    fn prepare(&self, _plant: &mut PlantParameters<'_, S>) {}
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
    /// Time constant of the current loop [s].
    fn lag(&self) -> Option<S> {
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
    /// Number of states the effect has of its own; they start at zero.
    fn n_internal(&self) -> usize {
        0
    }
    /// Rate of change of these states [1/s].
    fn internal_rate(&self, _motor: &Motor<'_, S>, _rate: &mut [S]) {}
    /// Deflection that loads the gear spring and its slope, from the geometric deflection [rad].
    fn deflection(&self, delta: S) -> (S, S) {
        (delta, S::one())
    }
    /// Deflection from the one that loads the spring; `delta` for [`Kernel::deflection`] at rest.
    fn deflection_inverse(&self, loaded: S) -> S {
        loaded
    }
    /// Gear torque added to the linear spring [Nm, joint side].
    fn gear_torque(&self, _loaded: S) -> S {
        S::zero()
    }
    /// Kinematic error of the gear over the motor angle: joint angle [rad] by which the
    /// gear runs ahead, and its slope.
    fn transmission_error(&self, _angle: S) -> Option<(S, S)> {
        None
    }
    /// Torque added on the driven joint, joint side [Nm].
    fn joint_torque(&self, _joint_angle: S) -> S {
        S::zero()
    }
    /// Error added to the measured motor position [rad].
    fn sensor(&self, _angle: S) -> S {
        S::zero()
    }
}
