//! The unit of length in every format that stores one.

use std::fs::{self, File};
use std::ops::ControlFlow;

use stereology_grid::{Format, LengthUnit, VolumeShape, VoxelSize, write_volume};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

const SHAPE: VolumeShape = VolumeShape {
    nz: 2,
    ny: 3,
    nx: 4,
    channels: 1,
};

fn written(format: Format, unit: Option<LengthUnit>) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("volume");
    let size = VoxelSize {
        sides: [0.5, 0.25, 2.0],
        unit,
    };
    write_volume::<u8>(&path, format, SHAPE, size, |_, _| ControlFlow::Continue(())).unwrap();
    (folder, path)
}

/// Pixels per unit of the resolution, times the length of that unit, give the length of a pixel.
#[test]
fn tiff_states_the_length_of_a_pixel() {
    for unit in LengthUnit::ALL {
        let (_folder, path) = written(Format::Tiff, Some(unit));
        let mut decoder = Decoder::new(File::open(path).unwrap()).unwrap();
        let metres = match decoder.get_tag_u32(Tag::ResolutionUnit).unwrap() {
            2 => 0.0254,
            3 => 0.01,
            other => panic!("{unit}: resolution unit {other}"),
        };
        for (tag, side) in [(Tag::XResolution, 0.5), (Tag::YResolution, 0.25)] {
            let Value::Rational(n, d) = decoder.get_tag(tag).unwrap() else {
                panic!("no fraction")
            };
            let length = metres * f64::from(d) / f64::from(n);
            assert!(
                (length / (side * unit.in_metres()) - 1.0).abs() < 1e-5,
                "{unit}: {length}"
            );
        }
        let description = decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap();
        let name = if unit == LengthUnit::Inch { "inch" } else { "cm" };
        assert!(description.contains(&format!("unit={name}\n")), "{description}");
    }
}

#[test]
fn nrrd_vti_and_zarr_name_the_unit() {
    for unit in LengthUnit::ALL {
        let text = |format: Format, name: &str| {
            let (_folder, path) = written(format, Some(unit));
            let path = if name.is_empty() { path } else { path.join(name) };
            String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned()
        };
        let symbol = unit.symbol();
        let nrrd = text(Format::Nrrd, "");
        assert!(
            nrrd.contains(&format!("\nspace units: \"{symbol}\" \"{symbol}\" \"{symbol}\"\n")),
            "{nrrd}"
        );
        let codes: Vec<String> = symbol.bytes().map(|code| code.to_string()).collect();
        assert!(text(Format::Vti, "").contains(&format!(
            "Name=\"unit\" NumberOfTuples=\"1\" format=\"ascii\">{} 0<",
            codes.join(" ")
        )));
        let zarr = text(Format::Zarr, "zarr.json");
        let name = match unit {
            LengthUnit::Nanometre => "nanometer",
            LengthUnit::Micrometre => "micrometer",
            LengthUnit::Millimetre => "millimeter",
            LengthUnit::Centimetre => "centimeter",
            LengthUnit::Metre => "meter",
            LengthUnit::Inch => "inch",
        };
        assert_eq!(
            zarr.matches(&format!(r#""type":"space","unit":"{name}""#)).count(),
            3,
            "{zarr}"
        );
    }
}

/// Without a unit no format has one.
#[test]
fn no_unit_is_invented() {
    for (format, name) in [
        (Format::Nrrd, ""),
        (Format::Vti, ""),
        (Format::Tiff, ""),
        (Format::Zarr, "zarr.json"),
    ] {
        let (_folder, path) = written(format, None);
        let path = if name.is_empty() { path } else { path.join(name) };
        let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        assert!(!text.contains("unit"), "{format:?}: {text}");
    }
}
