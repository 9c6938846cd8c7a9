//! Fits that know no effect by name: axis models in the time domain, torque regressors of a
//! chain.
//!
//! They stand on the plant alone, so that a new effect leaves them as they are.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod axis;
pub mod regressor;
