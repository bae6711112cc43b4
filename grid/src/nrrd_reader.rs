//! Reader of NRRD files: header lines, then samples that are raw, gzip or text, in the same or a separate file.

use crate::error::GridError;
use crate::sample_type::SampleType;
use flate2::read::MultiGzDecoder;
use ndarray::{ArrayD, Axis, IxDyn};
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;

/// The samples, slowest axis first and the channel axis last.
pub(crate) fn read_samples(path: &Path) -> Result<(ArrayD<f32>, SampleType), GridError> {
    let bytes = fs::read(path).map_err(GridError::io(path))?;
    let wrong = |reason: String| GridError::NotVolume {
        path: path.to_owned(),
        reason,
    };
    let (header, attached) = header(&bytes).map_err(&wrong)?;
    let needed = |key: &str| {
        header
            .get(key)
            .map(String::as_str)
            .ok_or_else(|| wrong(format!("its header has no `{key}`")))
    };
    let name = needed("type")?;
    let sample_type = SampleType::of_nrrd(name)
        .ok_or_else(|| wrong(format!("holds samples of type `{name}`, which are not numbers")))?;
    let sizes: Vec<usize> = needed("sizes")?
        .split_whitespace()
        .map(|size| size.parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(|| wrong("its header has `sizes` that are not integers".into()))?;
    let count = sizes
        .iter()
        .try_fold(1_usize, |count, &size| count.checked_mul(size))
        .filter(|count| count.checked_mul(8).is_some())
        .ok_or_else(|| wrong(format!("states sizes {sizes:?}, more than can be counted")))?;
    let beside;
    let data = match header.get("data file").or_else(|| header.get("datafile")) {
        None => attached,
        Some(file) => {
            let file = path.with_file_name(file);
            beside = fs::read(&file).map_err(GridError::io(&file))?;
            &beside
        }
    };
    let skip = header.get("byte skip").map_or(Some(0), |skip| skip.parse().ok());
    let data = skip
        .and_then(|skip: usize| data.get(skip..))
        .ok_or_else(|| wrong("its `byte skip` is not supported; save it without".into()))?;
    if header.get("line skip").is_some_and(|skip| skip != "0") {
        return Err(wrong("its `line skip` is not supported; save it without".into()));
    }
    let big_endian = header.get("endian").is_some_and(|endian| endian == "big");
    let expected = count * sample_type.size();
    let samples = match needed("encoding")? {
        "raw" => sample_type.decode(data, big_endian),
        "gzip" | "gz" => {
            let mut unpacked = Vec::new();
            let most = expected as u64 + 1;
            let done = MultiGzDecoder::new(data).take(most).read_to_end(&mut unpacked);
            done.map_err(|error| wrong(format!("its gzip data is damaged: {error}")))?;
            sample_type.decode(&unpacked, big_endian)
        }
        "txt" | "text" | "ascii" => String::from_utf8_lossy(data)
            .split_whitespace()
            .map(|number| number.parse().ok())
            .collect::<Option<_>>()
            .ok_or_else(|| wrong("its text contains something that is not a number".into()))?,
        other => {
            return Err(wrong(format!("is encoded as `{other}`; save it raw or with gzip")));
        }
    };
    if samples.len() != count {
        return Err(wrong(format!(
            "states {sizes:?} samples but holds {}; it is damaged or truncated",
            samples.len()
        )));
    }
    let slowest_first: Vec<usize> = sizes.iter().rev().copied().collect();
    let samples = ArrayD::from_shape_vec(IxDyn(&slowest_first), samples)
        .map_err(|_| wrong(format!("states sizes {sizes:?}, which form no array")))?;
    Ok((channel_last(samples, header.get("kinds"), &sizes), sample_type))
}

/// Moves the channel axis behind the others: the axis whose kind is not a direction of space, or else, among four axes,
/// the one of at most 4 samples.
fn channel_last(samples: ArrayD<f32>, kinds: Option<&String>, sizes: &[usize]) -> ArrayD<f32> {
    let is_space = |kind: &str| ["domain", "space", "time", "???"].contains(&kind);
    let named = kinds.and_then(|kinds| kinds.split_whitespace().position(|kind| !is_space(kind)));
    let small = || {
        [0, sizes.len().wrapping_sub(1)]
            .into_iter()
            .find(|&axis| sizes.len() == 4 && sizes[axis] <= 4)
    };
    let Some(axis) = named.or_else(small) else {
        // All kinds are directions of space, so three axes are a volume however few voxels it has along x.
        let is_volume = kinds.is_some() && sizes.len() == 3;
        return if is_volume {
            samples.insert_axis(Axis(3))
        } else {
            samples
        };
    };
    // The file lists the fastest axis first, the array the slowest.
    let Some(axis) = sizes.len().checked_sub(1 + axis) else {
        return samples;
    };
    let order: Vec<usize> = (0..sizes.len()).filter(|&a| a != axis).chain([axis]).collect();
    samples.permuted_axes(IxDyn(&order))
}

/// Fields of the header, and the bytes after it.
fn header(bytes: &[u8]) -> Result<(BTreeMap<String, String>, &[u8]), String> {
    if !bytes.starts_with(b"NRRD000") {
        return Err("is no NRRD file".into());
    }
    let mut fields = BTreeMap::new();
    let mut rest = bytes;
    loop {
        let Some(end) = rest.iter().position(|&byte| byte == b'\n') else {
            // A header only; the samples are in another file.
            return Ok((fields, &[]));
        };
        let line = String::from_utf8_lossy(&rest[..end]);
        let line = line.trim();
        rest = &rest[end + 1..];
        if line.is_empty() {
            return Ok((fields, rest));
        }
        if let Some((key, value)) = line.split_once(": ").filter(|_| !line.starts_with('#')) {
            fields.insert(key.trim().to_ascii_lowercase(), value.trim().to_owned());
        }
    }
}
