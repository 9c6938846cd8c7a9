//! Monte Carlo studies: many realizations of the same identification experiment.
//!
//! A study is a function of (design, seed, run). Runs are cut into blocks by run number; a
//! block is computed by one thread, its runs accumulated in order, and blocks are merged in
//! order, so neither threads nor machines nor interruptions can change a bit of the result.
//!
//! The one place where simulation and frequency responses meet, so neither waits for the other.

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
