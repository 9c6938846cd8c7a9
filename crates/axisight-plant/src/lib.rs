//! The plant: an arm, the points where an effect may act on it, its equations of motion and
//! their integration in the closed loop.
//!
//! No effect is known here by name: a new one leaves this crate, which holds what takes the
//! compiler longest, as it is ([`compiled`]). Modules stand bottom to top, each using only what
//! stands before it: [`robot`] is the arm; [`effect`] says what an effect is; [`formulas`] are
//! equations that models share; [`plant`] puts arm and effects together; [`simulation`] closes
//! the loop.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod compiled;
pub mod effect;
pub mod formulas;
pub mod plant;
pub mod robot;
pub mod simulation;
