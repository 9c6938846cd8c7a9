//! Robot files: reads a description from TOML text, and reports errors with their line.

mod accelerometers;
mod base;
mod document;
mod effects;
mod error;
mod limits;
mod parents;
mod reader;

pub use error::RobotError;
pub use reader::read_robot;
