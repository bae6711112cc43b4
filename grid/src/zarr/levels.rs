//! The resolutions of a volume, each half as fine as the one before.

use crate::atomic::write_atomically;
use crate::element::Element;
use crate::error::GridError;
use crate::volume_shape::VolumeShape;
use crate::zarr::shard::{CHUNK, Shard};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest number of chunks along y and x in a shard.
const CHUNKS: usize = 16;
/// The coarsest resolution has at most this many voxels along its longest side.
const COARSE: usize = 128;

/// One resolution, and its slabs that are in no shard yet.
#[derive(Debug)]
pub(crate) struct Level<T> {
    pub(crate) folder: PathBuf,
    pub(crate) shape: VolumeShape,
    /// Slabs since the last multiple of [`CHUNK`].
    band: Vec<T>,
    /// Number of slabs received.
    z: usize,
}

impl<T: Element> Level<T> {
    /// From the finest to the coarsest.
    pub(crate) fn all(folder: &Path, finest: &VolumeShape) -> Vec<Self> {
        let mut shape = *finest;
        let mut levels = Vec::new();
        loop {
            levels.push(Self {
                folder: folder.join(levels.len().to_string()),
                shape,
                band: Vec::new(),
                z: 0,
            });
            if shape.nz.max(shape.ny).max(shape.nx) <= COARSE {
                return levels;
            }
            shape = VolumeShape {
                nz: shape.nz.div_ceil(2),
                ny: shape.ny.div_ceil(2),
                nx: shape.nx.div_ceil(2),
                ..shape
            };
        }
    }

    /// Chunks along y and x in a shard.
    pub(crate) fn shards(&self) -> [usize; 2] {
        [self.shape.ny, self.shape.nx].map(|n| n.div_ceil(CHUNK).min(CHUNKS))
    }

    fn slab_length(&self) -> usize {
        self.shape.ny * self.shape.nx * self.shape.channels
    }

    /// The shards of a band of [`CHUNK`] slabs, and their files.
    fn shards_of(&self, band: usize) -> impl Iterator<Item = (Shard, PathBuf)> + '_ {
        let [sy, sx] = self.shards();
        let (rows, columns) = (self.shape.ny.div_ceil(sy * CHUNK), self.shape.nx.div_ceil(sx * CHUNK));
        (0..rows).flat_map(move |y| {
            (0..columns).map(move |x| {
                let shard = Shard {
                    chunks: [sy, sx],
                    from: [y * sy * CHUNK, x * sx * CHUNK],
                };
                (shard, self.folder.join(format!("c/0/{band}/{y}/{x}")))
            })
        })
    }

    /// Number of slabs from z = 0 on whose shards all exist.
    pub(crate) fn whole_slabs(&self) -> usize {
        let bands = self.shape.nz.div_ceil(CHUNK);
        let whole = (0..bands).take_while(|&band| self.shards_of(band).all(|(_, file)| file.is_file()));
        (whole.count() * CHUNK).min(self.shape.nz)
    }

    /// The slabs of the shards that begin at `z`.
    pub(crate) fn read_slabs(&self, z: usize) -> Result<Vec<Vec<T>>, GridError> {
        let depth = CHUNK.min(self.shape.nz - z);
        let mut slabs = vec![vec![T::default(); self.slab_length()]; depth];
        for (shard, file) in self.shards_of(z / CHUNK) {
            let bytes = fs::read(&file).map_err(GridError::io(&file))?;
            shard
                .unpack(&bytes, &self.shape, &mut slabs)
                .ok_or(GridError::OtherPartial { partial: file })?;
        }
        Ok(slabs)
    }

    fn write_band(&self) -> Result<(), GridError> {
        for (shard, file) in self.shards_of((self.z - 1) / CHUNK) {
            let parent = file.parent().unwrap_or(&self.folder);
            fs::create_dir_all(parent).map_err(GridError::io(parent))?;
            write_atomically(&file, |out| shard.write(&self.band, &self.shape, out))?;
        }
        Ok(())
    }

    /// The last one or two slabs as a slab of the next resolution: means of colours and of distances. Ids and
    /// categories have no mean; the first is taken.
    fn halved(&self) -> Vec<T> {
        let VolumeShape { ny, nx, channels, .. } = self.shape;
        let length = self.slab_length();
        let slabs = self.band.len() / length;
        let last = &self.band[(slabs - (2 - self.z % 2)) * length..];
        let labels = channels == 1 && T::TIFF_SAMPLE == 1;
        let mut half = Vec::with_capacity(length.div_ceil(4));
        for y in (0..ny).step_by(2) {
            // Rows of the earlier slab come first.
            let rows: Vec<&[T]> = last
                .chunks_exact(length)
                .flat_map(|slab| slab.chunks_exact(nx * channels).skip(y).take(2))
                .collect();
            match rows.as_slice() {
                rows if labels => half.extend(rows[0].iter().step_by(2)),
                // The usual case: all eight voxels exist.
                &[a, b, c, d] if nx % 2 == 0 && channels == 3 => half.extend(means::<T, 3>([a, b, c, d])),
                &[a, b, c, d] if nx % 2 == 0 && channels == 1 => half.extend(means::<T, 1>([a, b, c, d])),
                rows => half.extend((0..nx.div_ceil(2) * channels).map(|sample| {
                    let from = sample / channels * 2 * channels + sample % channels;
                    let columns = [from, from + channels].into_iter().filter(|&at| at < nx * channels);
                    T::mean(
                        &rows
                            .iter()
                            .flat_map(|row| columns.clone().map(|at| row[at]))
                            .collect::<Vec<T>>(),
                    )
                })),
            }
        }
        half
    }
}

/// Means over 2 × 2 × 2 voxels of `CHANNELS` channels each, from the four rows that contain them.
fn means<'a, T: Element, const CHANNELS: usize>(rows: [&'a [T]; 4]) -> impl Iterator<Item = T> + 'a {
    let [a, b, c, d] = rows.map(|row| row.as_chunks::<CHANNELS>().0.as_chunks::<2>().0);
    let pairs = a.iter().zip(b).zip(c).zip(d);
    pairs.flat_map(|(((a, b), c), d)| {
        let mut means = [T::default(); CHANNELS];
        for (k, mean) in means.iter_mut().enumerate() {
            *mean = T::mean(&[a[0][k], a[1][k], b[0][k], b[1][k], c[0][k], c[1][k], d[0][k], d[1][k]]);
        }
        means
    })
}

/// Adds the next slab to the finest of `levels`; complete shards are written if `write`.
pub(crate) fn push<T: Element>(levels: &mut [Level<T>], slab: &[T], write: bool) -> Result<(), GridError> {
    let Some((level, coarser)) = levels.split_first_mut() else {
        return Ok(());
    };
    level.band.extend_from_slice(slab);
    level.z += 1;
    let last = level.z == level.shape.nz;
    if !coarser.is_empty() && (level.z % 2 == 0 || last) {
        // Coarser shards are always written: they may include slabs that were missing at the interruption.
        push(coarser, &level.halved(), true)?;
    }
    if level.z % CHUNK == 0 || last {
        if write {
            level.write_band()?;
        }
        level.band.clear();
    }
    Ok(())
}
