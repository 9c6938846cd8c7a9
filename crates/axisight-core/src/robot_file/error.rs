//! Why a robot file is refused.

/// Why a robot description is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A value is of the wrong type or shape, or means nothing physical.
    #[error("line {line}: `{key}`: expected {expected}, got {got}")]
    Invalid {
        /// Path of the key; joints and array entries count from 1.
        key: String,
        /// Line of the value, from 1.
        line: usize,
        /// What the format asks for.
        expected: String,
        /// What the file says.
        got: String,
    },
    /// A key the schema does not have.
    #[error("line {line}: unknown key `{key}`; expected one of {expected}")]
    UnknownKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the key, from 1.
        line: usize,
        /// Keys that may stand here.
        expected: String,
    },
    /// A required key is not there.
    #[error("line {line}: missing key `{key}`; expected {expected}")]
    MissingKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the table that lacks it, from 1.
        line: usize,
        /// What the format asks for.
        expected: String,
    },
    /// The text is not TOML.
    #[error("line {line}: not valid TOML: {message}")]
    Syntax {
        /// Line of the fault, from 1.
        line: usize,
        /// What the TOML parser says.
        message: String,
    },
}

impl RobotError {
    /// Append the name of the joint: people know joints by name, not number.
    pub(super) fn of_joint(mut self, name: &str) -> Self {
        let text = match &mut self {
            Self::Invalid { got, .. } => got,
            Self::UnknownKey { expected, .. } | Self::MissingKey { expected, .. } => expected,
            Self::Syntax { message, .. } => message,
        };
        text.push_str(" (joint `");
        text.push_str(name);
        text.push_str("`)");
        self
    }
}
