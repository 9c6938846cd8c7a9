//! Frequency responses from periodic records.

mod periodic;

pub use periodic::{Output, Spectra, response};
