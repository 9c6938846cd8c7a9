//! Fits of a robot with effects by name, to logs in the time domain and to frequency responses.

pub mod frequency;
pub mod logs;
