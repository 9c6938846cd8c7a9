//! The plant: an arm, the effects on it, its equations of motion and their integration in the
//! closed loop.
//!
//! No effect is known here by name, so a new effect does not change this crate, which takes longest
//! to compile ([`compiled`]). The modules are ordered from bottom to top, and each uses only those
//! before it:
//!
//! * [`robot`] is the arm.
//! * [`effect`] describes effects.
//! * [`formulas`] are equations that models share.
//! * [`plant`] combines arm and effects.
//! * [`simulation`] closes the loop.

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

pub mod compiled;
pub mod effect;
pub mod formulas;
pub mod plant;
pub mod robot;
pub mod simulation;
