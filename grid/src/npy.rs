//! NumPy's array file: a header whose length is a multiple of 64 bytes, then the samples.

use crate::element::Element;
use crate::error::GridError;
#[cfg(feature = "read")]
use crate::sample_type::SampleType;
use crate::volume_shape::VolumeShape;
use ndarray::{ArrayD, IxDyn, ShapeBuilder};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

const MAGIC: &[u8] = b"\x93NUMPY";
/// Bytes read at a time, a multiple of the size of every sample type.
const BLOCK: usize = 1 << 17;

/// Header of a C-ordered volume, version 1.0, padded to a multiple of 64 bytes.
pub(crate) fn header<T: Element>(shape: &VolumeShape) -> Vec<u8> {
    let sizes: Vec<String> = shape.sizes().iter().map(ToString::to_string).collect();
    let mut text = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}",
        T::NPY,
        sizes.join(", ")
    );
    let unpadded = MAGIC.len() + 4 + text.len() + 1;
    text.push_str(&" ".repeat(unpadded.next_multiple_of(64) - unpadded));
    text.push('\n');
    let length = u16::try_from(text.len()).expect("four sizes of at most 20 digits fit in a version 1.0 header");
    [MAGIC, &[1, 0], &length.to_le_bytes(), text.as_bytes()].concat()
}

/// Reads a `.npy` file of exactly the sample type `T`, with any number of axes, in C or Fortran order.
///
/// The header is checked against the length of the file before memory is allocated, so a damaged file cannot request
/// more than it holds.
///
/// # Errors
///
/// [`GridError::Io`] if the file cannot be read; [`GridError::NotNpy`] if it is no `.npy` file, or holds another type
/// or another number of bytes than its header states.
///
/// # Examples
///
/// ```
/// # use std::ops::ControlFlow;
/// # use stereology_grid::{Format, VolumeShape, read_npy, write_volume};
/// # let folder = tempfile::tempdir()?;
/// let file = folder.path().join("ids.npy");
/// let shape = VolumeShape { nz: 1, ny: 2, nx: 3, channels: 1 };
/// write_volume::<u32>(&file, Format::Npy, shape, [1.0; 3], |_, mut slab| {
///     slab[[1, 2, 0]] = 70_000;
///     ControlFlow::Continue(())
/// })?;
/// assert_eq!(read_npy::<u32>(&file)?[[0, 1, 2]], 70_000);
/// let refused = read_npy::<u8>(&file).unwrap_err();
/// assert!(refused.to_string().contains("holds samples of type <u4"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_npy<T: Element>(path: impl AsRef<Path>) -> Result<ArrayD<T>, GridError> {
    let path = path.as_ref();
    let wrong = |reason: String| GridError::NotNpy {
        path: path.to_owned(),
        reason,
    };
    let sample_size = |descr: &str| {
        if descr == T::NPY {
            return Ok(size_of::<T>());
        }
        Err(format!(
            "holds samples of type {descr}, not {}; convert it with numpy's astype",
            T::NPY
        ))
    };
    let contents = Contents::open(path, wrong, sample_size)?;
    let mut samples = Vec::with_capacity(contents.samples);
    let header = contents.read(path, |bytes| samples.extend(T::decode(bytes)))?;
    let shape = IxDyn(&header.shape).set_f(header.fortran_order);
    ArrayD::from_shape_vec(shape, samples).map_err(|_| wrong("changed while it was read".into()))
}

/// Reads a `.npy` file of any numbers.
#[cfg(feature = "read")]
pub(crate) fn read_samples(path: &Path) -> Result<(ArrayD<f32>, SampleType), GridError> {
    let wrong = |reason: String| GridError::NotVolume {
        path: path.to_owned(),
        reason,
    };
    let kind_of = |descr: &str| {
        SampleType::of_npy(descr)
            .ok_or_else(|| format!("holds samples of type {descr}; convert it with numpy's astype('f4')"))
    };
    let contents = Contents::open(path, wrong, |descr| kind_of(descr).map(|(kind, _)| kind.size()))?;
    let (kind, big_endian) = kind_of(&contents.header.descr).map_err(wrong)?;
    let mut samples = Vec::with_capacity(contents.samples);
    let header = contents.read(path, |bytes| samples.extend(kind.decode(bytes, big_endian)))?;
    let shape = IxDyn(&header.shape).set_f(header.fortran_order);
    let samples = ArrayD::from_shape_vec(shape, samples);
    Ok((samples.map_err(|_| wrong("changed while it was read".into()))?, kind))
}

/// An open file whose header fits its length.
struct Contents {
    header: Header,
    reader: BufReader<File>,
    samples: usize,
    bytes: u64,
}

impl Contents {
    /// `sample_size` refuses a type or returns its bytes. The header is checked against the length of the file, so that
    /// no more memory than that is allocated.
    fn open(
        path: &Path,
        wrong: impl Fn(String) -> GridError,
        sample_size: impl Fn(&str) -> Result<usize, String>,
    ) -> Result<Self, GridError> {
        let file = File::open(path).map_err(GridError::io(path))?;
        let length = file.metadata().map_err(GridError::io(path))?.len();
        let mut reader = BufReader::new(file);
        let header = Header::read(&mut reader)
            .map_err(GridError::io(path))?
            .map_err(&wrong)?;
        let sample = sample_size(&header.descr).map_err(&wrong)?;
        let samples = header.shape.iter().try_fold(1_usize, |all, &n| all.checked_mul(n));
        let bytes = length.saturating_sub(header.length);
        match samples {
            Some(samples) if samples.checked_mul(sample).map(|all| all as u64) == Some(bytes) => Ok(Self {
                header,
                reader,
                samples,
                bytes,
            }),
            _ => Err(wrong(format!(
                "states {:?} samples of {sample} bytes but holds {bytes} bytes; it is damaged or truncated",
                header.shape
            ))),
        }
    }

    /// Passes the bytes to `take` in blocks of whole samples: all at once would be a second copy of the file in memory.
    fn read(mut self, path: &Path, mut take: impl FnMut(&[u8])) -> Result<Header, GridError> {
        let mut block = vec![0; BLOCK];
        while self.bytes > 0 {
            let part = &mut block[..usize::try_from(self.bytes).map_or(BLOCK, |left| left.min(BLOCK))];
            self.reader.read_exact(part).map_err(GridError::io(path))?;
            take(part);
            self.bytes -= part.len() as u64;
        }
        Ok(self.header)
    }
}

struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
    length: u64,
}

impl Header {
    /// Outer error: the file cannot be read. Inner error: what is wrong with the header.
    fn read(reader: &mut impl Read) -> io::Result<Result<Self, String>> {
        let mut start = [0; 10];
        let mut text = Vec::new();
        let mut length = 10;
        let not_npy = || Ok(Err("is no .npy file".to_string()));
        if let Err(e) = reader.read_exact(&mut start) {
            return if e.kind() == io::ErrorKind::UnexpectedEof {
                not_npy()
            } else {
                Err(e)
            };
        }
        if !start.starts_with(MAGIC) {
            return not_npy();
        }
        let mut size = u64::from(u16::from_le_bytes([start[8], start[9]]));
        if start[6] > 1 {
            let mut rest = [0; 2];
            if reader.read_exact(&mut rest).is_err() {
                return not_npy();
            }
            size += u64::from(u16::from_le_bytes(rest)) << 16;
            length += 2;
        }
        length += reader.take(size).read_to_end(&mut text)? as u64;
        let text = String::from_utf8_lossy(&text);
        Ok(Self::parse(&text, length).ok_or_else(|| "has an invalid header".to_string()))
    }

    fn parse(text: &str, length: u64) -> Option<Self> {
        let after = |key: &str| text.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
        let descr = after("descr")?.strip_prefix('\'')?.split_once('\'')?.0.to_string();
        let fortran_order = after("fortran_order")?.starts_with("True");
        let sizes = after("shape")?.strip_prefix('(')?.split_once(')')?.0;
        let sizes = sizes.split(',').map(str::trim).filter(|size| !size.is_empty());
        let shape = sizes.map(|size| size.parse().ok()).collect::<Option<Vec<usize>>>()?;
        Some(Self {
            descr,
            fortran_order,
            shape,
            length,
        })
    }
}
