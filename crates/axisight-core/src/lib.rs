//! Axisight core: what a simulator may lack, robots from files, and many runs of both.
//!
//! Modules stand bottom to top, each using only what stands before it: [`effects`] is what a
//! simulator may lack; [`robot_file`] reads a robot and its effects from text; [`plant`] puts
//! them together by name; [`simulation`] adds the linear plant and runs batches. The arm, the
//! equations of motion and the integrators are those of [`axisight_plant`], seen from here too.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod compiled;
pub mod effects;
pub mod plant;
pub mod robot_file;
pub mod simulation;

pub use axisight_plant::robot;
