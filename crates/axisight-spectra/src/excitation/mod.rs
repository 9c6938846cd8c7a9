//! Excitation signals: velocity references with a known spectrum.

pub mod crest;
mod directions;
mod multisine;
mod square;

pub use directions::directions;
pub use multisine::{Grid, Multisine, random_phases};
pub use square::Square;

/// Error: an excitation has an invalid field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, got {got}")]
pub struct ExcitationError {
    /// Name of the field.
    pub field: &'static str,
    /// Expected value.
    pub expected: String,
    /// Actual value.
    pub got: String,
}

impl ExcitationError {
    #[allow(clippy::needless_pass_by_value)]
    fn new(field: &'static str, expected: impl Into<String>, got: impl std::fmt::Display) -> Self {
        Self {
            field,
            expected: expected.into(),
            got: got.to_string(),
        }
    }
}

/// `seconds / sample_time` if it is a whole number of samples, at least one.
fn whole_samples(
    field: &'static str,
    seconds: f64,
    sample_time: f64,
) -> Result<usize, ExcitationError> {
    /// A longer record, more than a day at 10 kHz, does not fit in memory.
    const MOST: f64 = 1e9;
    let ratio = seconds / sample_time;
    let whole = ratio.round();
    // Quotients of decimal fractions such as 10.0 / 5e-4 have an error of a few units in the last
    // place.
    let close = (ratio - whole).abs() <= 1e-9 * whole.abs();
    if !(seconds.is_finite() && (1.0..MOST).contains(&whole) && close) {
        let expected = format!("a positive whole number of samples of {sample_time} s");
        return Err(ExcitationError::new(
            field,
            expected,
            format!("{seconds} s"),
        ));
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded above
    let n = whole as usize;
    Ok(n)
}
