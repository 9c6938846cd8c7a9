//! The arm: its description, rigid-body algorithms, equilibrium, linearization.

mod axis;
mod chain;
mod description;
mod dynamics;
mod equilibrium;
mod linear_algebra;
mod linearization;
mod parameters;
mod plant;
mod reader;
mod rigid_body;
mod vector;
mod zoh_response;

pub use axis::{Axis, Gear};
pub use chain::{Body, Chain, Pose};
pub use description::{Compliance, Controller, Drive, Joint, Link, Motion, RobotDescription};
pub use dynamics::{Dynamics, DynamicsScratch, DynamicsState, MOST_JOINTS};
pub use equilibrium::{Equilibrium, EquilibriumError, equilibrium};
pub use linearization::{Linearization, LinearizationError, linearize};
pub use parameters::{Parameter, ParameterError};
pub use plant::{EffectSetting, Plant, PlantError};
pub use reader::{RobotError, read_robot};
pub use rigid_body::RigidBody;
pub use vector::{Mat3, Vec3};
pub use zoh_response::zoh_frequency_response;
