//! Errors in robot files.

/// Reason why a robot file is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// A value has the wrong type or shape, or is not physical.
    #[error("line {line}: `{key}`: expected {expected}, got {got}")]
    Invalid {
        /// Path of the key; joints and array entries count from 1.
        key: String,
        /// Line of the value, counted from 1.
        line: usize,
        /// What the format expects.
        expected: String,
        /// The value in the file.
        got: String,
    },
    /// The schema has no such key.
    #[error("line {line}: unknown key `{key}`; expected one of {expected}")]
    UnknownKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the key, counted from 1.
        line: usize,
        /// Keys that are allowed here.
        expected: String,
    },
    /// A required key is missing.
    #[error("line {line}: missing key `{key}`; expected {expected}")]
    MissingKey {
        /// Path of the key; joints count from 1.
        key: String,
        /// Line of the table without the key, counted from 1.
        line: usize,
        /// What the format expects.
        expected: String,
    },
    /// The text is not valid TOML.
    #[error("line {line}: not valid TOML: {message}")]
    Syntax {
        /// Line of the error, counted from 1.
        line: usize,
        /// Message of the TOML parser.
        message: String,
    },
}

impl RobotError {
    /// Append the name of the joint, because users know joints by name, not by number.
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
