//! Monte Carlo studies: many realizations of the same identification experiment.
//!
//! A study is a function of (design, seed, run). Runs are divided into blocks by run number. One
//! thread computes a block and accumulates its runs in order, and blocks are merged in order.
//! Threads, machines and interruptions therefore do not change a bit of the result.
//!
//! Only this crate uses both simulation and frequency responses, so that the two can be compiled in
//! parallel.

mod block;
mod error;
mod record;
mod simulate;
mod spread;
mod study;
mod summary;

pub use block::{Block, BlockError, Failure, FailureKind, run_block};
pub use error::StudyError;
pub use simulate::Model;
pub use spread::{Distribution, Spread, SpreadTarget};
pub use study::{Study, StudySettings};
pub use summary::{Ensemble, Summary};
