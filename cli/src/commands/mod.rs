//! The commands, one module each.

pub mod carve;
pub mod contact;
pub mod displace;
pub mod exemplar;
pub mod explore;
pub mod export;
pub mod grow;
pub mod kmatrix;
pub mod measure;
pub mod pack;
mod pack_quality;
pub mod pyramid;
pub mod render;
pub mod segment;
pub mod shape;
pub mod slice;
pub mod synthesize;
pub mod texture;
pub mod unfold;

use clap::Subcommand;

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::Failure;
use crate::manual;

/// What holds for all commands, for `docs/cli.md`.
pub const CONVENTIONS: &str = "\
- Lengths are pixels unless `--scale UNITS_PER_PIXEL` is given; meshes are in mesh units.
- The `size` of a profile is the diameter of the circle with its area; the size of a particle is the diameter of the circle with the area of its largest \
section, so a sphere's size is its diameter.
- Size bins are (a, b]: N equal bins of (0, max-size] by `--bins N`, or `--edges a,b,...`, or `--spacing geometric`.
- SHAPE is `sphere` (diameter 1), `ellipsoid:A,B,C` (semi-axes), `box:A,B,C` (full edges), `cylinder:D,L`, `rock:SEED`, or a mesh file (`.obj`, `.stl`, \
`.ply`); or anything else that `stereology shape` takes as SPEC. `SHAPE=FRACTION` gives the share of the particles of that shape. Only proportions matter to unfolding and packing.
- Arrays are u8 with axes (z, y, x, channel) in C order: `.npy` as is; `.nrrd` with sizes `3 nx ny nz`; `.vti` with one array `rgb` of three components, x \
fastest; `.tif` with one RGB page a z; `.h5` in the layout of DREAM.3D; `.zarr` is OME-Zarr 0.5, axes (channel, z, y, x).
- `--json` prints one object whose first key is `schema`, `stereology.<command>/1`, and which has `warnings`, a list of `{code, message}` (codes below).
- Colours are averaged as stored (sRGB-encoded values / 255), as in the paper.";

/// A command and its options.
#[derive(Debug, Subcommand)]
pub enum Command {
    Synthesize(synthesize::Synthesize),
    Segment(segment::Segment),
    Kmatrix(kmatrix::Kmatrix),
    Unfold(unfold::Unfold),
    Pack(pack::Pack),
    Texture(texture::Texture),
    Pyramid(pyramid::Pyramid),
    Shape(shape::Shape),
    Slice(slice::Slice),
    Render(render::Render),
    Export(export::Export),
    Carve(carve::Carve),
    Measure(measure::Measure),
    Exemplar(exemplar::Exemplar),
    Grow(grow::Grow),
    Contact(contact::Contact),
    Displace(displace::Displace),
    Explore(explore::Explore),
    /// Prints docs/cli.md
    #[command(hide = true)]
    Manual,
}

/// Runs a command; `None` if it has printed its answer itself.
pub fn run(command: &Command, everywhere: &Everywhere) -> Result<Option<Answer>, Failure> {
    match command {
        Command::Synthesize(options) => options.run(everywhere).map(Some),
        Command::Segment(options) => options.run(everywhere).map(Some),
        Command::Kmatrix(options) => options.run(everywhere).map(Some),
        Command::Unfold(options) => options.run(everywhere).map(Some),
        Command::Pack(options) => options.run(everywhere).map(Some),
        Command::Texture(options) => options.run(everywhere).map(Some),
        Command::Pyramid(options) => options.run(everywhere).map(Some),
        Command::Shape(options) => options.run(everywhere).map(Some),
        Command::Slice(options) => options.run(everywhere).map(Some),
        Command::Render(options) => options.run(everywhere).map(Some),
        Command::Export(options) => options.run(everywhere).map(Some),
        Command::Carve(options) => options.run(everywhere).map(Some),
        Command::Measure(options) => options.run(everywhere).map(Some),
        Command::Exemplar(options) => options.run(everywhere).map(Some),
        Command::Grow(options) => options.run(everywhere).map(Some),
        Command::Contact(options) => options.run(everywhere).map(Some),
        Command::Displace(options) => options.run(everywhere).map(Some),
        Command::Explore(options) => options.run(everywhere).map(Some),
        Command::Manual => {
            use std::io::Write;
            let _ = std::io::stdout().write_all(manual::page().as_bytes());
            Ok(None)
        }
    }
}
