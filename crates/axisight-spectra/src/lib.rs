//! Frequency responses and the signals for measuring them: excitation design, estimators with
//! uncertainty, and seeded streams and accumulators of ensembles.
//!
//! The crate contains no robot model: it turns records into responses.

// Kernels are generic over the scalar and become vector code only if they are inlined.
#![allow(clippy::inline_always)]

pub mod ensemble;
pub mod excitation;
pub mod frf;
