//! Errors of the program: one message (what failed, where, what to do) and an exit code.

use std::ffi::OsStr;
use std::fmt::{self, Display};
use std::path::Path;

use stereology::shape::{Body, BodyError, ClosedMesh, read_mesh};

use crate::signals;

/// Why a command failed, and the exit code of the program.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    /// The data are unsuitable or the run failed: exit 1.
    pub fn run(message: impl Display) -> Self {
        Self {
            code: 1,
            message: message.to_string(),
        }
    }

    /// Wrong usage of the command: exit 2.
    pub fn usage(message: impl Display) -> Self {
        Self {
            code: 2,
            message: message.to_string(),
        }
    }

    /// Interrupted: exit 128 plus the number of the signal, 130 for Ctrl-C, as shells expect.
    pub fn stopped() -> Self {
        Self {
            code: signals::exit_code(),
            message: "interrupted; no output was changed".to_owned(),
        }
    }

    /// The same failure with another message.
    pub fn reworded(self, reword: impl FnOnce(&str) -> String) -> Self {
        Self {
            message: reword(&self.message),
            ..self
        }
    }

    /// Exit code of the program.
    pub fn code(&self) -> u8 {
        self.code
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// A body from its description. An invalid description is wrong usage; an unusable mesh is a failed run.
pub fn body(spec: &str) -> Result<Body, Failure> {
    body_welding(spec, None)
}

/// [`body`], whose description need not be text if it is the name of a mesh file.
///
/// Vertices of a mesh file that are closer than `weld` are merged.
pub fn body_of(spec: &OsStr, weld: Option<f64>) -> Result<Body, Failure> {
    let Some(text) = spec.to_str() else {
        let path = Path::new(spec);
        let mesh = read_mesh(path).at(path)?;
        return ClosedMesh::welded_within(mesh, weld.unwrap_or(0.0))
            .map(Body::from_mesh)
            .at(path);
    };
    body_welding(text, weld)
}

fn body_welding(spec: &str, weld: Option<f64>) -> Result<Body, Failure> {
    Body::parse_welding(spec, weld.unwrap_or(0.0)).map_err(|error| match error {
        BodyError::Length { .. }
        | BodyError::Numbers { .. }
        | BodyError::Roughness(_)
        | BodyError::Exponent(_)
        | BodyError::UnknownShape { .. } => Failure::usage(error),
        other => Failure::run(other),
    })
}

/// Adds to an error which file or option it concerns.
pub trait Explain<T> {
    /// The run failed on the file `path`.
    fn at(self, path: &Path) -> Result<T, Failure>;
    /// The run failed; the error needs no addition.
    fn or_fail(self) -> Result<T, Failure>;
    /// The value of an option is invalid.
    fn or_usage(self, option: &str) -> Result<T, Failure>;
}

impl<T, E: Display> Explain<T> for Result<T, E> {
    fn at(self, path: &Path) -> Result<T, Failure> {
        self.map_err(|error| {
            let (message, place) = (error.to_string(), path.display().to_string());
            // Many library errors name the file already.
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
