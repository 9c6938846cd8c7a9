//! Gray-box identification: torque regressors of a chain, axis models fitted in the time
//! domain, linearized robots fitted to frequency responses.
//!
//! A crate of its own because nothing in the core needs it and the core, generic over its
//! scalars, takes minutes to compile.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod axis;
pub mod frequency;
pub mod regressor;
