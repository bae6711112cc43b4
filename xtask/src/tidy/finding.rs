//! What a check reports.

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// File, line or crate.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// Whether it fails the check; otherwise it is a warning.
    pub fatal: bool,
}

impl Finding {
    pub fn error(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            message: message.into(),
            fatal: true,
        }
    }

    /// The same, not fatal.
    pub fn into_warning(self) -> Self {
        Self { fatal: false, ..self }
    }

    pub fn warning(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::error(place, message).into_warning()
    }
}
