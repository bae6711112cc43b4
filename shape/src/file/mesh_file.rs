//! Reading and writing mesh files: OBJ, STL (text and binary) and PLY (text and binary), in double precision.

use std::io::BufWriter;
use std::path::Path;

use tempfile::NamedTempFile;

use crate::file::mesh_file_error::MeshFileError;
use crate::file::obj;
use crate::file::ply;
use crate::file::stl;
use crate::mesh::triangle_mesh::TriangleMesh;

/// Mesh file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront text; only positions and faces are read. Written with all digits.
    Obj,
    /// Stereolithography; text or binary is detected on reading. Written as binary, in single precision, as the format
    /// requires.
    Stl,
    /// Polygon file format; text or binary of either byte order is detected on reading. Written as little-endian
    /// binary, doubles.
    Ply,
}

impl MeshFormat {
    /// The format of a file name's extension, in any case.
    ///
    /// # Errors
    ///
    /// [`MeshFileError::Format`] if the name ends in none of .obj, .stl, .ply.
    ///
    /// ```
    /// # use stereology_shape::MeshFormat;
    /// assert_eq!(MeshFormat::from_path("rock.STL".as_ref())?, MeshFormat::Stl);
    /// # Ok::<(), stereology_shape::MeshFileError>(())
    /// ```
    pub fn from_path(path: &Path) -> Result<Self, MeshFileError> {
        let ending = path
            .extension()
            .map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("obj") => Ok(Self::Obj),
            Some("stl") => Ok(Self::Stl),
            Some("ply") => Ok(Self::Ply),
            _ => Err(MeshFileError::Format { path: path.to_owned() }),
        }
    }

    /// The triangles in the bytes of a file of this format; errors report it as `name`.
    ///
    /// # Errors
    ///
    /// [`MeshFileError::Content`] states the place and the fault.
    ///
    /// ```
    /// # use stereology_shape::MeshFormat;
    /// let mesh = MeshFormat::Obj.parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "drop.obj".as_ref())?;
    /// assert_eq!(mesh.triangles, [[0, 1, 2]]);
    /// # Ok::<(), stereology_shape::MeshFileError>(())
    /// ```
    pub fn parse(self, bytes: &[u8], name: &Path) -> Result<TriangleMesh, MeshFileError> {
        let mesh = match self {
            Self::Obj => obj::parse(bytes),
            Self::Stl => stl::parse(bytes),
            Self::Ply => ply::parse(bytes),
        };
        mesh.map_err(|(place, fault)| MeshFileError::Content {
            path: name.to_owned(),
            place,
            fault,
        })
    }
}

/// Reads the triangles of a mesh file; the extension determines the format. Faces with more corners are cut into
/// triangles.
///
/// Vertices are those of the file: texture or normal seams of an OBJ do not split them, and
/// [`ClosedMesh`](crate::ClosedMesh) welds equal positions and reports it. An STL file has no shared vertices, so equal
/// positions become one vertex on reading.
///
/// # Errors
///
/// [`MeshFileError`] states the file, the place in it and the fault. A truncated file is never read in part.
///
/// # Examples
///
/// ```
/// use stereology_shape::{TriangleMesh, read_mesh, write_mesh};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("box.obj");
/// let mesh = TriangleMesh::cuboid([0.1, 0.2, 0.3]);
/// write_mesh(&path, &mesh)?;
/// assert_eq!(read_mesh(&path)?, mesh);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_mesh(path: impl AsRef<Path>) -> Result<TriangleMesh, MeshFileError> {
    let path = path.as_ref();
    let format = MeshFormat::from_path(path)?;
    let bytes = std::fs::read(path).map_err(|source| MeshFileError::Read {
        path: path.to_owned(),
        source,
    })?;
    format.parse(&bytes, path)
}

/// Writes triangles as a mesh file; the extension determines the format. An existing file is replaced only by a
/// complete one: the new file is written beside it under a temporary name and renamed.
///
/// OBJ and PLY keep every bit of the positions; STL holds them in single precision.
///
/// # Errors
///
/// [`MeshFileError::Format`] if the extension is unknown, [`MeshFileError::Write`] if the file cannot be written.
///
/// ```
/// # use stereology_shape::{TriangleMesh, read_mesh, write_mesh};
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("ball.ply");
/// write_mesh(&path, &TriangleMesh::icosphere(1.0, 2))?;
/// assert_eq!(read_mesh(&path)?.triangles.len(), 320);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_mesh(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), MeshFileError> {
    let path = path.as_ref();
    let format = MeshFormat::from_path(path)?;
    write_whole(path, |out| {
        check_indices(mesh)?;
        match format {
            MeshFormat::Obj => obj::write(out, mesh),
            MeshFormat::Stl => stl::write(out, mesh),
            MeshFormat::Ply => ply::write(out, mesh),
        }
    })
}

/// Writes a temporary file beside `path` and renames it when it is complete.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> std::io::Result<()>,
) -> Result<(), MeshFileError> {
    let write = || {
        // The target of a link is replaced, and the link stays.
        let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".mesh.partial-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // as of any new file, less the umask
        let mut out = BufWriter::new(builder.tempfile_in(folder)?);
        write(&mut out)?;
        let whole = out.into_inner().map_err(std::io::IntoInnerError::into_error)?;
        whole.as_file().sync_all()?;
        whole.persist(&target).map(drop).map_err(|error| error.error)
    };
    write().map_err(|source| MeshFileError::Write {
        path: path.to_owned(),
        source,
    })
}

pub(crate) fn check_indices(mesh: &TriangleMesh) -> std::io::Result<()> {
    let vertices = mesh.vertices.len();
    match mesh
        .triangles
        .iter()
        .position(|corners| corners.iter().any(|&i| i as usize >= vertices))
    {
        None => Ok(()),
        Some(t) => {
            let message = format!("triangle {t} refers to a vertex that is not among the {vertices} vertices");
            Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, message))
        }
    }
}
