//! Frequency responses from periodic records, and from any records by local models.

mod local_estimate;
mod local_least_squares;
mod local_polynomial;
mod local_rational;
mod periodic;
mod record_spectra;

pub use local_estimate::{LineFlag, LocalEstimate, LocalModelError};
pub use local_polynomial::local_polynomial_periodic;
pub use local_rational::{LocalModel, local_rational};
pub use periodic::{Output, Spectra, response};
pub use record_spectra::Records;
