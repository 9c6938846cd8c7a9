//! Frequency responses and the signals they are measured with: excitation design, estimators
//! with their uncertainty, and the seeded streams and accumulators of ensembles.
//!
//! Knows nothing of robots: records in, responses out.

// Kernels are generic over the scalar and must be inlined to become vector code.
#![allow(clippy::inline_always)]

pub mod ensemble;
pub mod excitation;
pub mod frf;
