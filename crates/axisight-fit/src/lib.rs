//! Fits of models to data: whole robots to logs, torque regressors of a chain, axis models in
//! the time domain, linearized robots to frequency responses.
//!
//! A crate of its own because nothing in the core needs it and the core, generic over its
//! scalars, takes long to compile.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod axis;
pub mod frequency;
pub mod identification;
pub mod regressor;
