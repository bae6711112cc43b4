//! `stereology slice`: a picture of a cut through a solid.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use stereology::files::solid::{self, SavedSolid};
use stereology::volume::{self, SlicePlane};

use crate::answer::Answer;
use crate::arguments::Everywhere;
use crate::failure::{Explain, Failure};
use crate::numbers::significant;
use crate::outputs::{check_file, write_png};
use crate::progress::go_on;
use crate::values::{Triple, count, finite};

/// Cuts a finished solid by a plane and writes the picture of the cut
///
/// DIR is an output folder of `stereology synthesize`. The plane stands across an axis, --at a fraction of the box's side (0.3 is 30 %), or is any plane
/// with a --normal at --offset from the origin along it. The picture shows one period of the solid.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology slice out --axis z --at 0.3 --size 512 -o cut.png")]
pub struct Slice {
    /// Folder of a solid, written by `stereology synthesize`
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Axis the plane stands across [default: z]
    #[arg(long, value_enum, conflicts_with = "normal")]
    pub axis: Option<Axis>,
    /// Where along the axis, as a fraction of the box's side [default: 0.5]
    #[arg(long, value_name = "F", value_parser = finite, allow_negative_numbers = true, conflicts_with = "normal")]
    pub at: Option<f64>,
    /// Normal of the plane, of any length, instead of --axis
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub normal: Option<Triple>,
    /// Distance of the plane from the origin along the normal [default: 0]
    #[arg(long, value_name = "D", value_parser = finite, allow_negative_numbers = true, requires = "normal")]
    pub offset: Option<f64>,
    /// Pixels along the longer side of the picture
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = count)]
    pub size: usize,
    /// File for the picture
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
}

/// An axis of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Slice {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        check_file(&self.output, everywhere.force)?;
        let solid = open_solid(&self.solid)?.solid;
        let sides = solid.period().sides();
        let (plane, [across, down]) = match self.normal {
            Some(Triple(normal)) => {
                let plane =
                    SlicePlane::oblique(Vector3::from(normal), self.offset.unwrap_or(0.0)).or_usage("--normal")?;
                (plane, [sides.max(); 2])
            }
            None => {
                let (axis, depth, extent) = match self.axis.unwrap_or(Axis::Z) {
                    Axis::X => (volume::Axis::X, sides.x, [sides.y, sides.z]),
                    Axis::Y => (volume::Axis::Y, sides.y, [sides.x, sides.z]),
                    Axis::Z => (volume::Axis::Z, sides.z, [sides.x, sides.y]),
                };
                (SlicePlane::across(axis, self.at.unwrap_or(0.5) * depth), extent)
            }
        };
        let pixel = across.max(down) / self.size as f64;
        let pixels = |extent: f64| ((extent / pixel).round() as u32).max(1);
        let picture = solid.slice(&plane, pixels(across), pixels(down), pixel).or_fail()?;
        go_on()?;
        write_png(&self.output, &picture)?;
        let mut answer = Answer::new("slice");
        answer
            .field("width", picture.width())
            .field("height", picture.height())
            .field("pixel", pixel)
            .line(format!(
                "{} x {} pixels of edge {} written to {}",
                picture.width(),
                picture.height(),
                significant(pixel),
                self.output.display()
            ));
        Ok(answer)
    }
}

/// Opens a folder of `stereology synthesize`.
pub fn open_solid(folder: &Path) -> Result<SavedSolid, Failure> {
    let parts = ["solid.json", "packing.json", "texture.npy"];
    if let Some(missing) = parts.iter().find(|part| !folder.join(part).is_file()) {
        return Err(Failure::run(format!(
            "{}: holds no {missing}; give a folder written by `stereology synthesize`",
            folder.display()
        )));
    }
    solid::read(folder).at(folder)
}
