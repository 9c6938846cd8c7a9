//! How values of a parameter are spread over machines and those who write their laws.

/// A density of values, of one within the bounds of the parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Normal about the neutral value, with the typical size as standard deviation: half of it where the neutral
    /// value is a bound. None at all is as usual as any.
    HalfNormal,
    /// Its logarithm is normal about that of the typical size, with a standard deviation [1]: something is there,
    /// and none at all has no density.
    LogNormal {
        /// Standard deviation of the logarithm [1].
        spread: f64,
    },
    /// Any value is as usual: shares, and orders that data show by themselves.
    Uniform,
}
