//! Steps that an earlier run finished, to be taken up where their inputs are the same.

use crate::pipeline::digest::{Digest, Inputs};
use crate::pipeline::{FineDetails, ParticleTypes};
use stereology_anneal::{PackOptions, Packing};
use stereology_pyramid::TextureOptions;
use stereology_segment::Segmentation;
use stereology_shape::{Arrangement, Particle};

/// Finished steps of an earlier run.
#[derive(Clone, Debug, Default)]
pub struct Finished {
    /// The packing.
    pub packing: Option<FinishedPacking>,
    /// The residual volume.
    pub texture: Option<FinishedTexture>,
}

/// A packing, and the digest of what it was made of.
#[derive(Clone, Debug)]
pub struct FinishedPacking {
    /// Digest of its inputs.
    pub inputs: Digest,
    /// Its particles.
    pub particles: Vec<Particle>,
    /// Iterations used.
    pub iterations: usize,
}

/// A residual volume, and the digest of what it was made of.
#[derive(Clone, Debug)]
pub struct FinishedTexture {
    /// Digest of its inputs.
    pub inputs: Digest,
    /// The volume and its reports.
    pub details: FineDetails,
}

impl FinishedPacking {
    /// The packing, if it was made of these inputs and is certified again.
    pub(crate) fn packing(&self, inputs: &Digest, start: &Arrangement) -> Option<Packing> {
        if self.inputs != *inputs {
            return None;
        }
        let arrangement = start.with_particles(self.particles.clone()).ok()?;
        let packing = Packing::verify(&arrangement).ok()?;
        Some(packing.with_iterations(self.iterations))
    }
}

/// Digest of the inputs of a packing: particles, bodies, box and options.
pub(crate) fn packing_inputs(start: &Arrangement, types: &ParticleTypes, options: &PackOptions) -> Digest {
    let mut inputs = Inputs::of("pack")
        .text(&format!("{options:?}"))
        .numbers(start.period().sides().iter().copied());
    for of in types.types() {
        let vertices = of.body.mesh().map(|mesh| mesh.vertices().to_vec()).unwrap_or_default();
        inputs = inputs
            .text(&of.name)
            .numbers([of.body.size()])
            .numbers(vertices.iter().flat_map(|vertex| [vertex.x, vertex.y, vertex.z]));
    }
    let numbers = |particle: &Particle| {
        let (p, q) = (particle.position, particle.orientation.quaternion());
        [particle.size, p.x, p.y, p.z, q.w, q.i, q.j, q.k]
    };
    let kinds: Vec<String> = start
        .particles()
        .iter()
        .map(|of| format!("{} {}", of.shape, of.category))
        .collect();
    inputs
        .numbers(start.particles().iter().flat_map(numbers))
        .text(&kinds.join(","))
        .digest()
}

/// Digest of the inputs of a residual volume: photograph, labels, colours and options.
pub(crate) fn texture_inputs(
    segmentation: &Segmentation,
    pixel: f64,
    voxels: usize,
    options: &TextureOptions,
) -> Digest {
    let labels: Vec<u8> = segmentation
        .labels
        .iter()
        .flat_map(|label| label.to_le_bytes())
        .collect();
    let photo = segmentation.photo();
    let categories: Vec<String> = segmentation
        .profiles
        .iter()
        .map(|profile| profile.category.to_string())
        .collect();
    Inputs::of("texture")
        .text(&format!("{options:?} {voxels} {:?}", photo.dimensions()))
        .numbers([pixel])
        .bytes(photo.as_raw())
        .bytes(&labels)
        .text(&categories.join(","))
        .numbers(segmentation.categories.iter().flat_map(|category| category.colour))
        .numbers(segmentation.binder.colour)
        .digest()
}
