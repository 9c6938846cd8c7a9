//! Frequency responses from periodic records.

mod multivariable;
mod periodic;
mod spectra;

pub use multivariable::{Layout, LineFlag, Multivariable, multivariable};
pub use periodic::{Output, Spectra, response};
pub use spectra::{Channels, Extent, spectra};
