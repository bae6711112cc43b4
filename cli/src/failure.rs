//! What the program says when it stops: one message (what, where, what to do) and an exit code.

use std::fmt::{self, Display};
use std::path::Path;

use stereology::shape::{Body, BodyError};

/// Why a command stopped, and the code the program exits with.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    /// The data or the run failed: exit 1.
    pub fn run(message: impl Display) -> Self {
        Self {
            code: 1,
            message: message.to_string(),
        }
    }

    /// The command was called wrongly: exit 2.
    pub fn usage(message: impl Display) -> Self {
        Self {
            code: 2,
            message: message.to_string(),
        }
    }

    /// Stopped by Ctrl-C: exit 130, as shells expect.
    pub fn stopped() -> Self {
        Self {
            code: 130,
            message: "stopped before the end; no output was changed".to_owned(),
        }
    }

    /// What the program exits with.
    pub fn code(&self) -> u8 {
        self.code
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// A body from its description; a description that is none is wrong usage, a mesh that cannot be used a failed run.
pub fn body(spec: &str) -> Result<Body, Failure> {
    body_welding(spec, None)
}

/// [`body`], where vertices of a mesh file nearer than `weld` to each other are joined.
pub fn body_welding(spec: &str, weld: Option<f64>) -> Result<Body, Failure> {
    Body::parse_welding(spec, weld.unwrap_or(0.0)).map_err(|error| match error {
        BodyError::Length { .. }
        | BodyError::Numbers { .. }
        | BodyError::Roughness(_)
        | BodyError::Exponent(_)
        | BodyError::UnknownShape { .. } => Failure::usage(error),
        other => Failure::run(other),
    })
}

/// Says of an error which file it is about, or that it is the user's to mend.
pub trait Explain<T> {
    /// The run failed at `path`.
    fn at(self, path: &Path) -> Result<T, Failure>;
    /// The run failed; the error says enough by itself.
    fn or_fail(self) -> Result<T, Failure>;
    /// An option holds what it cannot hold.
    fn or_usage(self, option: &str) -> Result<T, Failure>;
}

impl<T, E: Display> Explain<T> for Result<T, E> {
    fn at(self, path: &Path) -> Result<T, Failure> {
        self.map_err(|error| {
            let (message, place) = (error.to_string(), path.display().to_string());
            // Many errors of the libraries name the file already.
            Failure::run(if message.contains(&place) {
                message
            } else {
                format!("{place}: {message}")
            })
        })
    }

    fn or_fail(self) -> Result<T, Failure> {
        self.map_err(Failure::run)
    }

    fn or_usage(self, option: &str) -> Result<T, Failure> {
        self.map_err(|error| Failure::usage(format!("{option}: {error}")))
    }
}

#[cfg(test)]
mod tests {
    use super::Explain;
    use std::path::Path;

    #[test]
    fn a_file_is_named_once() {
        let at = |message: &str| {
            Err::<(), _>(message.to_owned())
                .at(Path::new("a.csv"))
                .unwrap_err()
                .to_string()
        };
        assert_eq!(at("no header"), "a.csv: no header");
        assert_eq!(at("a.csv has no header"), "a.csv has no header");
    }
}
