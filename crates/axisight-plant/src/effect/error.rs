//! Misuse of effects.

/// Misuse of the effect table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No effect has this name.
    #[error("effect `{name}`: expected one of {expected}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The known names.
        expected: String,
    },
    /// Wrong number of parameters.
    #[error("effect `{effect}`: expected {expected} parameters, got {got}")]
    ParameterCount {
        /// Effect.
        effect: &'static str,
        /// Length of its parameter table.
        expected: usize,
        /// Length given.
        got: usize,
    },
    /// An effect of an axis without a valid one, of two axes without two, of the arm with any.
    #[error("effect `{effect}`: expected {expected}, got {got}")]
    Axis {
        /// Effect.
        effect: &'static str,
        /// What its scope asks for.
        expected: String,
        /// What came.
        got: String,
    },
    /// An axis of this robot lacks what an effect needs there, or has what excludes it.
    #[error("effect `{effect}`: expected {expected}, got {got}")]
    Lacking {
        /// Effect.
        effect: &'static str,
        /// What the effect needs.
        expected: String,
        /// The axis, and what it lacks or has.
        got: String,
    },
    /// A kernel asks for something its point of action has not.
    #[error("effect `{effect}`: expected {expected} where it acts, got {got}")]
    Unsupported {
        /// Effect.
        effect: &'static str,
        /// What the point of action offers.
        expected: &'static str,
        /// What the kernel asks for.
        got: String,
    },
    /// A parameter outside its bounds or not finite.
    #[error("effect `{effect}`: parameter `{parameter}`: expected {lower} to {upper}, got {got}")]
    Bounds {
        /// Effect.
        effect: &'static str,
        /// Parameter.
        parameter: &'static str,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Value given.
        got: f64,
    },
}
