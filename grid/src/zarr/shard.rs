//! A shard: its chunks one after the other, an index with the offset and length of each, and the checksum of the index.

use crate::element::Element;
use crate::volume_shape::VolumeShape;
use std::io::{self, Write};
use std::ops::Range;

/// Slabs in a shard, and voxels along each side of a chunk.
pub(crate) const CHUNK: usize = 32;

/// Where a shard lies in its band of slabs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shard {
    /// Number of chunks along y and x.
    pub(crate) chunks: [usize; 2],
    /// First voxel along y and x.
    pub(crate) from: [usize; 2],
}

/// Offset and length of an absent chunk, one that lies outside the array.
const MISSING: u64 = u64::MAX;

impl Shard {
    /// Writes the shard, from the slabs of its band.
    pub(crate) fn write<T: Element>(&self, band: &[T], shape: &VolumeShape, out: &mut dyn Write) -> io::Result<()> {
        let slab = shape.ny * shape.nx * shape.channels;
        let mut written = 0;
        let mut index = Vec::new();
        let mut chunk = vec![T::default(); shape.channels * CHUNK.pow(3)];
        let length = size_of_val(chunk.as_slice()) as u64;
        for [y, x] in self.places() {
            if y >= shape.ny || x >= shape.nx {
                index.extend([MISSING; 2]);
                continue;
            }
            chunk.fill(T::default());
            for (z, slab) in band.chunks_exact(slab).enumerate() {
                for row in rows([y, x], z, shape) {
                    row.pick(slab, shape.channels, &mut chunk);
                }
            }
            T::write(&chunk, out)?;
            index.extend([written, length]);
            written += length;
        }
        let index: Vec<u8> = index.iter().flat_map(|word| word.to_le_bytes()).collect();
        out.write_all(&index)?;
        out.write_all(&crc32c(&index).to_le_bytes())
    }

    /// Copies the samples of the shard into the slabs of its band; `None` if the bytes are too few for this shape.
    pub(crate) fn unpack<T: Element>(&self, bytes: &[u8], shape: &VolumeShape, slabs: &mut [Vec<T>]) -> Option<()> {
        let VolumeShape { ny, nx, channels, .. } = *shape;
        let length = channels * CHUNK.pow(3) * size_of::<T>();
        let mut chunks = bytes.chunks_exact(length);
        for [y, x] in self.places().filter(|&[y, x]| y < ny && x < nx) {
            let chunk = T::decode(chunks.next()?);
            for (z, slab) in slabs.iter_mut().enumerate() {
                for Row { voxel, channel, inside } in rows([y, x], z, shape) {
                    let to = slab[voxel * channels + channel..].iter_mut().step_by(channels);
                    to.zip(&chunk[inside]).for_each(|(to, from)| *to = *from);
                }
            }
        }
        Some(())
    }

    /// First voxels of the chunks along y and x, in the order of the index.
    fn places(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let Self {
            chunks: [rows, columns],
            from: [y, x],
        } = *self;
        (0..rows).flat_map(move |v| (0..columns).map(move |u| [y + v * CHUNK, x + u * CHUNK]))
    }
}

/// A row of one channel: its first voxel in the slab, and its range in the chunk.
struct Row {
    voxel: usize,
    channel: usize,
    inside: Range<usize>,
}

/// The rows at one z of the chunk whose first voxel is (y, x), clipped to the array.
fn rows([y, x]: [usize; 2], z: usize, shape: &VolumeShape) -> impl Iterator<Item = Row> + use<> {
    let VolumeShape { ny, nx, channels, .. } = *shape;
    let length = CHUNK.min(nx - x);
    (y..(y + CHUNK).min(ny)).flat_map(move |v| {
        (0..channels).map(move |channel| {
            let from = ((channel * CHUNK + z) * CHUNK + v - y) * CHUNK;
            Row {
                voxel: v * nx + x,
                channel,
                inside: from..from + length,
            }
        })
    })
}

impl Row {
    /// Copies the row from a slab of `channels` channels.
    fn pick<T: Copy>(self, slab: &[T], channels: usize, chunk: &mut [T]) {
        let to = &mut chunk[self.inside];
        let from = &slab[self.voxel * channels..(self.voxel + to.len()) * channels];
        match from.as_chunks::<3>() {
            // The usual case; a constant number of channels is faster.
            (voxels, []) if channels == 3 && self.channel < 3 => {
                to.iter_mut().zip(voxels).for_each(|(to, rgb)| *to = rgb[self.channel]);
            }
            _ => {
                let from = from[self.channel..].iter().step_by(channels);
                to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
            }
        }
    }
}

/// The checksum of the index: CRC-32 with Castagnoli's polynomial, reflected.
fn crc32c(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 == 1 { 0x82f6_3b78 } else { 0 }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::{Shard, crc32c};
    use crate::volume_shape::VolumeShape;
    use proptest::prelude::*;

    /// The check value of the polynomial's definition, and RFC 3720's of 32 zeros.
    #[test]
    fn the_checksum_is_castagnolis() {
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn slabs_are_read_back_from_their_shard(ny in 1_usize..70, nx in 1_usize..70, depth in 1_usize..4, channels in prop_oneof![Just(1_usize), Just(3)]) {
            let shape = VolumeShape { nz: depth, ny, nx, channels };
            let slab = ny * nx * channels;
            let band: Vec<u32> = (0..u32::try_from(slab * depth).unwrap()).collect();
            let shard = Shard { chunks: [3, 3], from: [0, 0] };
            let mut slabs = vec![vec![0; slab]; depth];
            let mut bytes = Vec::new();
            shard.write(&band, &shape, &mut bytes).unwrap();
            shard.unpack(&bytes, &shape, &mut slabs).unwrap();
            prop_assert_eq!(slabs.concat(), band);
        }
    }
}
