//! What is wrong with a line of an estimate.

/// Why a line is not to be trusted; the numbers are those of the Python enumeration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i8)]
pub enum LineFlag {
    /// Nothing.
    Good = 0,
    /// The experiments do not excite all inputs independently: NaN.
    RankDeficient = 1,
    /// Errors are amplified more than a thousandfold, or the weakest direction of the input
    /// is lost in its noise.
    IllConditioned = 2,
    /// An input has no amplitude: NaN.
    NoExcitation = 3,
}
