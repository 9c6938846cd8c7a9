//! Frequency responses: from periodic records, and by local models from any records.

mod flag;
mod local_estimate;
mod local_least_squares;
mod local_polynomial;
mod local_rational;
mod multivariable;
mod periodic;
mod record_spectra;
mod spectra;

pub use flag::LineFlag;
pub use local_estimate::{LocalEstimate, LocalModelError};
pub use local_polynomial::local_polynomial_periodic;
pub use local_rational::{LocalModel, local_rational};
pub use multivariable::{Layout, Multivariable, multivariable};
pub use periodic::{Output, Spectra, response};
pub use record_spectra::Records;
pub use spectra::{Channels, Extent, LineSpectra};
