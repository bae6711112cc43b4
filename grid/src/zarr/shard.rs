//! A shard: chunks one behind the other, then an index of where each begins and how long it is, then the index's checksum.

use crate::VolumeShape;
use crate::element::Element;
use crate::zarr::CHUNK;

/// Where a shard lies in its band of slabs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shard {
    /// Chunks along y and x.
    pub(crate) chunks: [usize; 2],
    /// Its first voxel along y and x.
    pub(crate) from: [usize; 2],
}

/// Offset and length of a chunk that is not there: it lies outside the array.
const MISSING: u64 = u64::MAX;

impl Shard {
    /// The bytes of the shard, from the slabs of its band.
    pub(crate) fn packed<T: Element>(&self, band: &[T], shape: &VolumeShape) -> Vec<u8> {
        let VolumeShape { ny, nx, channels, .. } = *shape;
        let slab = ny * nx * channels;
        let mut out = Vec::new();
        let mut index = Vec::new();
        let mut chunk = vec![T::default(); channels * CHUNK.pow(3)];
        for [y, x] in self.places() {
            if y >= ny || x >= nx {
                index.extend([MISSING; 2]);
                continue;
            }
            chunk.fill(T::default());
            for (z, slab) in band.chunks_exact(slab).enumerate() {
                for (c, v, u) in voxels([y, x], shape) {
                    chunk[((c * CHUNK + z) * CHUNK + v - y) * CHUNK + u - x] = slab[(v * nx + u) * channels + c];
                }
            }
            let from = out.len();
            T::write(&chunk, &mut out).expect("a vector takes all bytes");
            index.extend([from as u64, (out.len() - from) as u64]);
        }
        let index: Vec<u8> = index.iter().flat_map(|word| word.to_le_bytes()).collect();
        out.extend(&index);
        out.extend(crc32c(&index).to_le_bytes());
        out
    }

    /// Puts the samples of the shard into the slabs of its band; `None` if it is no shard of this shape.
    pub(crate) fn unpack<T: Element>(&self, bytes: &[u8], shape: &VolumeShape, slabs: &mut [Vec<T>]) -> Option<()> {
        let VolumeShape { ny, nx, channels, .. } = *shape;
        let length = channels * CHUNK.pow(3) * size_of::<T>();
        let mut chunks = bytes.chunks_exact(length);
        for [y, x] in self.places().filter(|&[y, x]| y < ny && x < nx) {
            let chunk = T::decode(chunks.next()?);
            for (z, slab) in slabs.iter_mut().enumerate() {
                for (c, v, u) in voxels([y, x], shape) {
                    slab[(v * nx + u) * channels + c] = chunk[((c * CHUNK + z) * CHUNK + v - y) * CHUNK + u - x];
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

/// Channels and voxels (y, x) of a chunk that lie in the array.
fn voxels([y, x]: [usize; 2], shape: &VolumeShape) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
    let VolumeShape { ny, nx, channels, .. } = *shape;
    (0..channels)
        .flat_map(move |c| (y..(y + CHUNK).min(ny)).flat_map(move |v| (x..(x + CHUNK).min(nx)).map(move |u| (c, v, u))))
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
    use crate::VolumeShape;
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
        fn a_shard_gives_back_its_slabs(ny in 1_usize..70, nx in 1_usize..70, depth in 1_usize..4, channels in prop_oneof![Just(1_usize), Just(3)]) {
            let shape = VolumeShape { nz: depth, ny, nx, channels };
            let slab = ny * nx * channels;
            let band: Vec<u32> = (0..u32::try_from(slab * depth).unwrap()).collect();
            let shard = Shard { chunks: [3, 3], from: [0, 0] };
            let mut slabs = vec![vec![0; slab]; depth];
            shard.unpack(&shard.packed(&band, &shape), &shape, &mut slabs).unwrap();
            prop_assert_eq!(slabs.concat(), band);
        }
    }
}
