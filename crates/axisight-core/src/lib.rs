//! Axisight core: the library of effects, robots from files, and batches of runs.
//!
//! The modules are ordered from bottom to top, and each uses only those before it:
//!
//! * [`effects`] is what a simulator may lack.
//! * [`robot_file`] reads a robot and its effects from text.
//! * [`plant`] combines robot and effects by name.
//! * [`simulation`] adds the linear plant and runs batches.
//!
//! The arm, the equations of motion and the integrators come from [`axisight_plant`] and are
//! re-exported.

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

pub mod compiled;
pub mod effects;
pub mod plant;
pub mod robot_file;
pub mod simulation;

pub use axisight_plant::robot;
