//! Commands that write every kind of output, and the inputs they need.

use std::path::Path;

use anyhow::Result;

use crate::faults::program::Program;

/// A command and its outputs, which it writes into the current folder; its inputs are in `../../inputs`.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// What it writes.
    pub name: &'static str,
    /// Its arguments.
    pub line: &'static str,
    /// Arguments of a command that writes other contents under the same names.
    pub other: &'static str,
}

const fn task(name: &'static str, line: &'static str, other: &'static str) -> Task {
    Task { name, line, other }
}

/// Exports of a volume, by format.
pub const VOLUMES: [&str; 6] = ["npy", "nrrd", "vti", "tif", "h5", "zarr"];

/// A command of every kind of output: files, sets of files, folders, volumes.
pub const TASKS: [Task; 15] = [
    task(
        "volume (.npy)",
        "export ../../inputs/solid --voxels 160 -o v.npy",
        "--seed 1 --channel id",
    ),
    task(
        "volume (.zarr)",
        "export ../../inputs/solid --voxels 160 -o v.zarr",
        "--seed 1 --samples 2",
    ),
    task(
        "volume (.tif)",
        "export ../../inputs/solid --voxels 160 -o v.tif",
        "--channel category",
    ),
    task("segment", "segment ../../inputs/photo.png -o out", "--min-area 30"),
    task(
        "segment and label maps",
        "segment ../../inputs/photo.png -o out --labels-out l.zip --labels-out l.geojson --labels-out l.npy",
        "--min-area 30",
    ),
    task(
        "explore",
        "explore ../../inputs/rock.ply --count 12 --pixels 64 -o out",
        "--seed 1",
    ),
    task(
        "assemble",
        "assemble ../../inputs/packing.json -o out",
        "--binder 1,2,3",
    ),
    task(
        "pack and its set",
        "pack --constant --count 300 --fraction 0.4 -o p.json --also p.csv --also p.xyz --also p.vtp --surfaces s.vtp --trace t.csv",
        "--seed 1",
    ),
    task(
        "unfold",
        "unfold ../../inputs/seg -o d.csv --bootstrap 400",
        "--seed 1 --bins 9",
    ),
    task(
        "texture",
        "texture ../../inputs/photo.png --size 32 -o t.npy --iterations 2",
        "--seed 1",
    ),
    task(
        "exemplar and its sources",
        "exemplar ../../inputs/small.png --size 16 --iterations 3 -o e.npy --sources s.npy",
        "--seed 1",
    ),
    task(
        "grow and its cells",
        "grow ../../inputs/rock.ply ../../inputs/small.png --resolution 24 --seeds 5 -o g.npy --cells c.nrrd --sources s.tif",
        "--seed 1",
    ),
    task(
        "displace and its tables",
        "displace ../../inputs/rock.ply --contact ../../inputs/contact.json --units 20 --edge-length 0.05 -o m.glb --labels-out l.csv \
         --design-out d.json",
        "--seed 1",
    ),
    task(
        "carve",
        "carve ../../inputs/solid ../../inputs/rock.ply --triangles 60000 -o c.glb",
        "--turned",
    ),
    task(
        "turntable",
        "render ../../inputs/solid --size 96 --turntable 4 -o r.png",
        "--gloss 0.7",
    ),
];

/// Writes the inputs of all commands into a folder.
pub fn make_inputs(program: &Program, folder: &Path) -> Result<()> {
    for line in [
        "synthesize -o solid --count 150 --texture-voxels 32 --voxels 24 --bins 5 --iterations 1",
        "slice solid --size 700 -o photo.png",
        "slice solid --size 64 -o small.png",
        "segment photo.png -o seg",
        "pack --constant --count 400 --fraction 0.3 -o packing.json",
        "shape rock:1 -o rock.ply",
        "contact photo.png -o contact.json",
    ] {
        program.succeed(line, folder)?;
    }
    Ok(())
}
