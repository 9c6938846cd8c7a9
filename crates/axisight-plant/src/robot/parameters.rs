//! The physical parameters of a robot by name.

use super::chain::Chain;
use super::description::RobotDescription;
use axisight_scalar::Scalar;

/// One physical parameter; names are `<joint name>.<quantity>`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Link mass [kg].
    Mass(usize),
    /// Common factor on the inertia about the centre of mass [1].
    InertiaScale(usize),
    /// Coordinate of the centre of mass [m].
    Com(usize, usize),
    /// Spring stiffness [Nm/rad].
    Stiffness(usize),
    /// Spring damping [Nm s/rad].
    Damping(usize),
    /// Motor inertia [kg m^2].
    MotorInertia(usize),
    /// Viscous friction on the motor [Nm s/rad].
    ViscousFriction(usize),
}

/// Error: the robot has no parameter of this name.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("parameter `{name}`: expected one of {expected}")]
pub struct ParameterError {
    /// The requested name.
    pub name: String,
    /// The names of the robot's parameters.
    pub expected: String,
}

impl Parameter {
    /// All parameters of a robot, in chain order.
    pub fn all(robot: &RobotDescription) -> Vec<Self> {
        let mut out = Vec::new();
        for (i, joint) in robot.joints.iter().enumerate() {
            if joint.link.is_some() {
                out.extend([Self::Mass(i), Self::InertiaScale(i)]);
                out.extend((0..3).map(|k| Self::Com(i, k)));
            }
            if joint.compliance.is_some() {
                out.extend([Self::Stiffness(i), Self::Damping(i)]);
            }
            if joint.drive.is_some() {
                out.extend([Self::MotorInertia(i), Self::ViscousFriction(i)]);
            }
        }
        out
    }

    /// The parameter called `name`.
    ///
    /// # Errors
    /// [`ParameterError`] with the names of the robot's parameters, if `name` is not one of them.
    pub fn parse(name: &str, robot: &RobotDescription) -> Result<Self, ParameterError> {
        let all = Self::all(robot);
        all.iter()
            .copied()
            .find(|p| p.name(robot) == name)
            .ok_or_else(|| ParameterError {
                name: name.to_owned(),
                expected: all
                    .iter()
                    .map(|p| p.name(robot))
                    .collect::<Vec<_>>()
                    .join(", "),
            })
    }

    fn joint(self) -> usize {
        match self {
            Self::Mass(i)
            | Self::InertiaScale(i)
            | Self::Com(i, _)
            | Self::Stiffness(i)
            | Self::Damping(i)
            | Self::MotorInertia(i)
            | Self::ViscousFriction(i) => i,
        }
    }

    /// Name, e.g. `axis2.stiffness`.
    pub fn name(self, robot: &RobotDescription) -> String {
        let joint = robot
            .joints
            .get(self.joint())
            .map_or("?", |j| j.name.as_str());
        let quantity = match self {
            Self::Mass(_) => "mass",
            Self::InertiaScale(_) => "inertia_scale",
            Self::Com(_, 0) => "com_x",
            Self::Com(_, 1) => "com_y",
            Self::Com(..) => "com_z",
            Self::Stiffness(_) => "stiffness",
            Self::Damping(_) => "damping",
            Self::MotorInertia(_) => "motor_inertia",
            Self::ViscousFriction(_) => "viscous_friction",
        };
        format!("{joint}.{quantity}")
    }

    /// Value in a description; zero if the robot has no such part.
    pub fn nominal(self, robot: &RobotDescription) -> f64 {
        let Some(joint) = robot.joints.get(self.joint()) else {
            return 0.0;
        };
        let link = joint.link.as_ref();
        let compliance = joint.compliance.as_ref();
        let drive = joint.drive.as_ref();
        match self {
            Self::Mass(_) => link.map_or(0.0, |l| l.mass),
            Self::InertiaScale(_) => 1.0,
            Self::Com(_, k) => link.and_then(|l| l.com.get(k).copied()).unwrap_or(0.0),
            Self::Stiffness(_) => compliance.map_or(0.0, |c| c.stiffness),
            Self::Damping(_) => compliance.map_or(0.0, |c| c.damping),
            Self::MotorInertia(_) => drive.map_or(0.0, |d| d.motor_inertia),
            Self::ViscousFriction(_) => drive.map_or(0.0, |d| d.viscous_friction),
        }
    }

    /// Set the value in a description; does nothing if the robot has no such part.
    pub fn set(self, robot: &mut RobotDescription, value: f64) {
        let Some(joint) = robot.joints.get_mut(self.joint()) else {
            return;
        };
        let (link, drive) = (joint.link.as_mut(), joint.drive.as_mut());
        match (self, link, joint.compliance.as_mut(), drive) {
            (Self::Mass(_), Some(l), ..) => l.mass = value,
            (Self::InertiaScale(_), Some(l), ..) => l.inertia = l.inertia.map(|x| x * value),
            (Self::Com(_, k), Some(l), ..) => {
                if let Some(c) = l.com.get_mut(k) {
                    *c = value;
                }
            }
            (Self::Stiffness(_), _, Some(c), _) => c.stiffness = value,
            (Self::Damping(_), _, Some(c), _) => c.damping = value,
            (Self::MotorInertia(_), .., Some(d)) => d.motor_inertia = value,
            (Self::ViscousFriction(_), .., Some(d)) => d.viscous_friction = value,
            _ => {}
        }
    }

    /// Set a mass property of the chain. The plant sets all other parameters.
    pub fn apply_to_chain<S: Scalar>(self, value: S, chain: &mut Chain<S>) {
        let Some(body) = chain
            .joints
            .get_mut(self.joint())
            .and_then(|j| j.body.as_mut())
        else {
            return;
        };
        match self {
            Self::Mass(_) => body.mass = value,
            Self::InertiaScale(_) => body.inertia = body.inertia.map(|x| x * value),
            Self::Com(_, k) => {
                if let Some(c) = body.com.get_mut(k) {
                    *c = value;
                }
            }
            _ => {}
        }
    }
}
