//! Axisight core: identify industrial robots, simulate them, and explain the
//! gap between simulator and machine.
//!
//! Modules stand bottom to top: [`scalar`] and [`signal`] know nothing of
//! robots, nor do [`ensemble`], [`excitation`] and [`frf`], which stand on them; [`robot`]
//! is the arm; [`effects`] is what a simulator may lack; [`simulation`] closes the loop;
//! [`identification`] fits parameters; [`montecarlo`] runs studies over many realizations.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod effects;
pub mod ensemble;
pub mod excitation;
pub mod frf;
pub mod identification;
pub mod montecarlo;
pub mod robot;
pub mod scalar;
pub mod signal;
pub mod simulation;
