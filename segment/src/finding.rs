//! What a researcher should know before trusting a segmentation.

/// A remark on a segmentation; `code` is fixed, `message` says what was measured and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Of the photo: `alpha-over-white`, `no-binder`, `vague-binder`, `area-fraction`, `few-profiles`, `unstable-count`, `edge-heavy`, `near-minimum`. Of a label map: `clipped-labels`, `split-label`,
    /// `small-labels`, `first-page`, `overlapping-labels`, `lost-labels`.
    pub code: &'static str,
    /// For people.
    pub message: String,
}

impl Finding {
    pub(crate) fn new(code: &'static str, message: String) -> Self {
        Self { code, message }
    }
}
