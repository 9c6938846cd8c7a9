//! Quality flags of the lines of an estimate.

/// The reason why a line is not reliable. The numbers are those of the Python enumeration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum LineFlag {
    /// The line is reliable.
    Good = 0,
    /// The experiments do not excite all inputs independently. The response is NaN.
    RankDeficient = 1,
    /// Errors are amplified more than a thousandfold, or the weakest direction of the input is
    /// below its noise.
    IllConditioned = 2,
    /// An input has no amplitude. The response is NaN.
    NoExcitation = 3,
}
