//! Distributions of parameter values over machines and notations.

/// A probability density of a parameter within its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Normal about the neutral value, with the typical size as standard deviation. If the neutral
    /// value is a bound, only one half of the density is used. Values near neutral are the most
    /// likely.
    HalfNormal,
    /// Log-normal about the typical size. The density at zero is zero.
    LogNormal {
        /// Standard deviation of the logarithm [1].
        spread: f64,
    },
    /// Uniform within the bounds, for shares and for orders that the data determine.
    Uniform,
}
