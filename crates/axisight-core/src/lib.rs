//! Axisight core: the arm, what a simulator of it may lack, and the closed loop.
//!
//! Modules stand bottom to top: [`robot`] is the arm; [`effects`] is what a simulator may lack;
//! [`simulation`] closes the loop.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod effects;
pub mod robot;
pub mod simulation;
