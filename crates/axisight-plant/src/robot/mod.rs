//! The arm: its description, its chain and its rigid-body algorithms.

mod accelerometer;
mod along;
mod base_joints;
mod chain;
mod course;
pub mod description;
mod dynamics;
mod linear_algebra;
mod parameters;
mod rigid_body;
mod setting;
mod vector;

pub use accelerometer::{Accelerometer, JointMotion, n_readings};
pub use along::{Along, Course};
pub use base_joints::BASE_NAMES;
pub use chain::{Body, Chain, ChainJoint, Pose};
pub use description::{
    Compliance, Controller, Drive, Joint, Known, Link, Motion, RobotDescription, Stepped,
};
pub use dynamics::{
    BASE_COORDINATES, BaseMotion, Dynamics, DynamicsScratch, DynamicsState, FloatingBody,
    MOST_JOINTS,
};
pub use parameters::{Parameter, ParameterError};
pub use rigid_body::{RigidBody, ShapeError};
pub use setting::{EffectSetting, Place};
pub use vector::{Mat3, Vec3};
