//! Errors of mesh files: the file, the place in it and the fault.

use std::path::PathBuf;

/// Why a mesh file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The extension is unknown.
    #[error("{}: mesh files end in .obj, .stl or .ply", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// A textured mesh is written as GLB alone.
    #[error("{}: meshes with a texture end in .glb", path.display())]
    Ending {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not of the named format, broken or truncated.
    #[error("{}: {place}: {fault}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: MeshFilePlace,
        /// What is wrong there.
        fault: MeshFileFault,
    },
}

/// A place in a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFilePlace {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(usize),
    /// A vertex, counted from 0 in the order of the file.
    Vertex(usize),
    /// A face, counted from 0 in the order of the file.
    Face(usize),
}

impl std::fmt::Display for MeshFilePlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File => f.write_str("the file"),
            Self::Line(line) => write!(f, "line {line}"),
            Self::Vertex(vertex) => write!(f, "vertex {vertex} (counted from 0)"),
            Self::Face(face) => write!(f, "face {face} (counted from 0)"),
        }
    }
}

/// What is wrong at a place of a mesh file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileFault {
    /// A coordinate is not a number, not finite, or missing.
    #[error("{word:?} is not a finite coordinate")]
    Coordinate {
        /// The text there; empty if there is none.
        word: String,
    },
    /// A face refers to a vertex that is not in the file.
    #[error("{word:?} is not the index of one of the {vertices} vertices")]
    Index {
        /// The text there.
        word: String,
        /// How many vertices the file has.
        vertices: usize,
    },
    /// A face with fewer than 3 or more than 4096 corners.
    #[error("a face has 3 to 4096 corners, not {corners}")]
    Corners {
        /// How many it has.
        corners: usize,
    },
    /// Something else was expected.
    #[error("expected {expected}, found {found:?}")]
    Expected {
        /// What the format requires.
        expected: &'static str,
        /// The text there; empty at the end of the file.
        found: String,
    },
    /// The file is shorter or longer than its header states.
    #[error(
        "{triangles} triangles take {expected} bytes, but the file has {found}: it is truncated or not an STL file"
    )]
    Length {
        /// Number of triangles in its header.
        triangles: u32,
        /// Bytes they take.
        expected: u64,
        /// Bytes in the file.
        found: u64,
    },
    /// An error of the PLY parser.
    #[error("{message}")]
    Ply {
        /// Its message.
        message: String,
    },
    /// A fault of delimited text, and how it was understood.
    #[error("{message}")]
    Table {
        /// What is wrong.
        message: String,
    },
    /// No faces.
    #[error("there are no faces")]
    NoFaces,
}

/// A fault and its place, before the file's name is known.
pub(crate) type Fault = (MeshFilePlace, MeshFileFault);

/// A finite number from a word of a text file.
pub(crate) fn coordinate(word: Option<&str>) -> Result<f64, MeshFileFault> {
    let word = word.unwrap_or_default();
    let number = word.parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| MeshFileFault::Coordinate { word: word.to_owned() })
}
