//! Fits that know no effect by name: axis models in the time domain, and torque regressors of a
//! chain.
//!
//! The crate depends on the plant only, so a new effect does not change it.

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

pub mod axis;
pub mod regressor;
