//! A remark on a result.

/// A remark on a result: `code` is fixed and meant for programs, `message` is meant for people.
///
/// Each function that returns findings documents the codes it can return.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Fixed word with hyphens, such as `few-profiles`.
    pub code: &'static str,
    /// What was measured and what to do, in one or two sentences.
    pub message: String,
}

impl Finding {
    /// A finding.
    #[must_use]
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }
}
