//! Axisight core: the arm, what a simulator of it may lack, and the closed loop.
//!
//! Modules stand bottom to top, each using only what stands before it: [`robot`] is the arm;
//! [`effects`] is what a simulator may lack; [`robot_file`] reads both from text; [`plant`] makes
//! equations of motion of both; [`simulation`] closes the loop.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod effects;
pub mod plant;
pub mod robot;
pub mod robot_file;
pub mod simulation;
