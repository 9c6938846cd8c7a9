//! Errors in the use of effects.

/// Error in the use of effects.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No effect has this name.
    #[error("effect `{name}`: expected one of {expected}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The available names.
        expected: String,
    },
    /// Wrong number of parameters.
    #[error("effect `{effect}`: expected {expected} parameters, got {got}")]
    ParameterCount {
        /// Name of the effect.
        effect: &'static str,
        /// Number of parameters of the effect.
        expected: usize,
        /// Number of given parameters.
        got: usize,
    },
    /// The place does not fit the scope: an effect of one axis or of two axes needs valid axes, an
    /// effect of the arm needs none.
    #[error("effect `{effect}`: expected {expected}, got {got}")]
    Axis {
        /// Name of the effect.
        effect: &'static str,
        /// The place that the scope requires.
        expected: String,
        /// The given place.
        got: String,
    },
    /// An axis of the robot lacks a part that the effect needs, or has a part that excludes the
    /// effect.
    #[error("effect `{effect}`: expected {expected}, got {got}")]
    Lacking {
        /// Name of the effect.
        effect: &'static str,
        /// What the effect needs.
        expected: String,
        /// The axis with its missing or excluding part.
        got: String,
    },
    /// A kernel uses a feature that its point of action does not offer.
    #[error("effect `{effect}`: expected {expected} where it acts, got {got}")]
    Unsupported {
        /// Name of the effect.
        effect: &'static str,
        /// What the point of action offers.
        expected: &'static str,
        /// What the kernel uses.
        got: String,
    },
    /// A parameter is outside its bounds or not finite.
    #[error("effect `{effect}`: parameter `{parameter}`: expected {lower} to {upper}, got {got}")]
    Bounds {
        /// Name of the effect.
        effect: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
        /// Given value.
        got: f64,
    },
}

impl EffectError {
    /// Error: effect `effect` needs a robot without branches.
    pub fn on_tree(effect: &'static str) -> Self {
        Self::Lacking {
            effect,
            expected: "a robot without branches (link_mass and link_com change one link)"
                .to_owned(),
            got: "one with branches".to_owned(),
        }
    }
}
