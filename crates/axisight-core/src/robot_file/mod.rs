//! Robot files: TOML text to a description, faults named with their line.

mod document;
mod effects;
mod error;
mod reader;

pub use error::RobotError;
pub use reader::read_robot;
