//! `stereology slice`: an image of a plane section through a solid.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;
use stereology::files::solid::SavedSolid;
use stereology::grid::LengthUnit;
use stereology::volume::{self, SlicePlane};

use crate::answer::{Answer, Fields, Notes};
use crate::commands::solid_files::open_solid;
use crate::everywhere::Everywhere;
use crate::failure::{Explain, Failure};
use crate::outputs::{Output, write_png};
use crate::progress::go_on;
use crate::values::{Triple, count, finite};
use stereology_report::significant;

/// Slices a finished solid with a plane and writes an image of the section
///
/// DIR is an output folder of `stereology synthesize` or `assemble`, or a packing.json. The plane is perpendicular to
/// an --axis, at a fraction --at of the box's side (0.3 is 30 %), or it is given by a --normal and its --offset from
/// the origin along the normal. The image shows one period of the solid.
#[derive(Args, Debug)]
#[command(after_long_help = "Example: stereology slice out --axis z --at 0.3 --size 512 -o cut.png")]
pub struct Slice {
    /// Folder of a solid, written by `stereology synthesize` or `assemble`, or a packing.json
    #[arg(value_name = "DIR")]
    pub solid: PathBuf,
    /// Axis perpendicular to the slice [default: z]
    #[arg(long, value_enum, conflicts_with = "normal")]
    pub axis: Option<Axis>,
    /// Position along the axis, as a fraction of the box's side [default: 0.5]
    #[arg(long, value_name = "F", value_parser = finite, allow_negative_numbers = true, conflicts_with = "normal")]
    pub at: Option<f64>,
    /// Normal of the plane, of any length, instead of --axis
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub normal: Option<Triple>,
    /// Distance of the plane from the origin along the normal [default: 0]
    #[arg(long, value_name = "D", value_parser = finite, allow_negative_numbers = true, requires = "normal")]
    pub offset: Option<f64>,
    /// Pixels along the longer side of the image
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = count)]
    pub size: usize,
    /// Image to write
    #[arg(short, long, value_name = "PNG")]
    pub output: Output,
}

/// An axis of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    X,
    Y,
    Z,
}

/// JSON of `stereology slice`.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SliceFields {
    /// Width of the image in pixels.
    width: u32,
    /// Height of the image in pixels.
    height: u32,
    /// Side of a pixel.
    pixel: f64,
    /// Unit of the side; null if it is not known, or pixels of the photograph.
    unit: Option<&'static str>,
}

impl Fields for SliceFields {
    const COMMAND: &'static str = "slice";
}

impl Slice {
    pub fn run(&self, everywhere: &Everywhere) -> Result<Answer, Failure> {
        let file = everywhere.outputs.file(&self.output)?;
        let SavedSolid { solid, unit, .. } = open_solid(&self.solid, everywhere)?;
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
        write_png(&file, &picture)?;
        let mut notes = Notes::default();
        notes.line(format!(
            "{} x {} pixels with side {}{} written to {}",
            picture.width(),
            picture.height(),
            significant(pixel),
            unit.map_or(String::new(), |unit| format!(" {}", unit.printed())),
            self.output.display()
        ));
        let fields = SliceFields {
            width: picture.width(),
            height: picture.height(),
            pixel,
            unit: unit.map(LengthUnit::symbol),
        };
        Answer::new(&fields, notes)
    }
}
