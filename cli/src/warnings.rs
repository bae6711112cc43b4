//! The warnings the program can give: fixed codes, what each means, and what to do about it.

use serde_json::{Value, json};

/// Every code, in alphabetical order: (code, what it means, what to do). `docs/cli.md` and the report show this table.
pub const CODES: &[(&str, &str, &str)] = &[
    (
        "clamped-bins",
        "Some unfolded number densities came out negative and were set to zero.",
        "Use fewer bins, more photographs, or --method em, which stays positive by construction.",
    ),
    (
        "clipped-labels",
        "The largest label is exactly 255 or 65,535: the label map was probably cut off when it was saved.",
        "Save the labels with more bits (u16 or u32) and import them again.",
    ),
    (
        "edge-heavy",
        "Many profiles touch the edge of the photograph.",
        "Take a photograph of a larger area: it should be at least ten times as wide as the largest profile.",
    ),
    (
        "far-mean-colour",
        "The mean colour of the solid's sections differs visibly from the photograph's.",
        "Look at means.png: are all the colours there? Try more --categories or import a label map.",
    ),
    (
        "few-profiles",
        "There are fewer than 50 profiles: every figure that follows from them is uncertain.",
        "Use a photograph of a larger area, or fewer --bins.",
    ),
    (
        "fines-left-out",
        "The smallest sizes were left out of the packing, to keep the number of particles feasible.",
        "Raise --min-area, or give a smaller --box.",
    ),
    (
        "fraction-mismatch",
        "The particles' volume fraction by unfolding and the photograph's area fraction differ by more than 10 %, though on average they must agree.",
        "The shape is probably wrong (try another --shape), or many profiles were missed or merged (look at overlay.png).",
    ),
    (
        "gaps-in-bins",
        "Some size bins hold no profile at all.",
        "Use fewer --bins.",
    ),
    (
        "ill-conditioned",
        "The kernel is nearly singular: small errors of the counts become large errors of the densities.",
        "Use fewer --bins, or --method em.",
    ),
    (
        "mesh-repaired",
        "The mesh was not quite a closed surface and was repaired.",
        "Look at `repairs`; mend the mesh if that is not what you meant.",
    ),
    (
        "near-minimum",
        "Many profiles are hardly larger than the smallest that is counted: smaller ones are probably missed.",
        "Use a photograph of higher resolution; the sizes below the threshold are not reported.",
    ),
    (
        "no-binder",
        "No single colour surrounds the particles: what is particle and what is binder is a guess.",
        "Give the binder's colour with --binder R,G,B, or import a label map with --labels FILE.",
    ),
    (
        "poor-fit",
        "The refolded profiles do not fit the observed ones: the model does not explain the photograph.",
        "Try another --shape or several of them; look at the overlay for merged or broken profiles.",
    ),
    (
        "size-mismatch",
        "The profile sizes in sections of the solid differ from those of the photograph.",
        "Look at the histograms: missing fines need a higher resolution, missing large sizes a larger photograph.",
    ),
    (
        "split-label",
        "A label of the imported map is in several pieces; it was kept as one profile.",
        "Give each profile a label of its own if they are different particles.",
    ),
    (
        "truncated-bins",
        "Some bins lie below the smallest size that is counted: nothing can be said about them.",
        "Use a photograph of higher resolution if you need them.",
    ),
    (
        "unstable-count",
        "The number of profiles changes by more than 10 % when the thresholds move a little.",
        "Look at overlay.png; import a label map with --labels FILE if the particles are not outlined well.",
    ),
];

/// Something the user should know before trusting the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    code: String,
    message: String,
}

impl Warning {
    /// A warning of one of the fixed [`CODES`].
    pub fn new(code: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            code: code.into(),
            message: message.into(),
        }
    }

    /// The fixed code.
    pub fn code(&self) -> &str {
        &self.code
    }

    /// What was found, with its figures.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What to do about it.
    pub fn advice(&self) -> Option<&'static str> {
        CODES
            .iter()
            .find(|(code, ..)| *code == self.code)
            .map(|&(_, _, advice)| advice)
    }

    /// `{"code", "message"}`.
    pub fn to_json(&self) -> Value {
        json!({ "code": self.code, "message": self.message })
    }
}

#[cfg(test)]
mod tests {
    use super::CODES;

    #[test]
    fn codes_are_sorted_and_unique() {
        assert!(CODES.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
