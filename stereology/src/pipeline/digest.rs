//! Digests of the inputs of a step: equal digests mean equal inputs, and so equal results.

use sha2::{Digest as _, Sha256};
use std::fmt::{self, Display};

/// The SHA-256 digest of the inputs of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digest(String);

impl Digest {
    /// A digest from its hexadecimal digits, as they are displayed.
    #[must_use]
    pub fn from_digits(digits: &str) -> Self {
        Self(digits.to_owned())
    }
}

impl Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Inputs that are added one after the other. Each is preceded by its length, so that two cannot be exchanged.
pub struct Inputs(Sha256);

impl Inputs {
    /// Inputs of a step of this version.
    #[must_use]
    pub fn of(step: &str) -> Self {
        Self(Sha256::new()).text(env!("CARGO_PKG_VERSION")).text(step)
    }

    /// Adds bytes.
    #[must_use]
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Adds a text.
    #[must_use]
    pub fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes())
    }

    /// Adds numbers, bit for bit.
    #[must_use]
    pub fn numbers(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        let bytes: Vec<u8> = numbers.into_iter().flat_map(f64::to_le_bytes).collect();
        self.bytes(&bytes)
    }

    /// The digest of all.
    #[must_use]
    pub fn digest(self) -> Digest {
        Digest(self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::Inputs;

    #[test]
    fn digests_differ_where_inputs_do() {
        let of = |parts: &[&str]| {
            parts
                .iter()
                .fold(Inputs::of("pack"), |inputs, part| inputs.text(part))
                .digest()
        };
        assert_eq!(of(&["a", "bc"]), of(&["a", "bc"]));
        assert_ne!(of(&["a", "bc"]), of(&["ab", "c"]));
        assert_ne!(
            Inputs::of("a").numbers([0.0]).digest(),
            Inputs::of("a").numbers([-0.0]).digest()
        );
    }
}
