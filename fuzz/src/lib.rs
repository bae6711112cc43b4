//! Properties that hold for any input bytes: an error or a result, never a panic, an endless loop or NaN.
//!
//! `cargo +nightly fuzz run mesh_file --features libfuzzer` (cargo-fuzz; `-s none` without sanitizers) drives these
//! functions guided by coverage, from the small corpus in this folder. `cargo run --release --example mutate --
//! SECONDS` drives them with random changes of the corpus and of small meshes, and needs neither nightly nor
//! cargo-fuzz. `cargo run
//! --release --example replay -- corpus/*/*` runs the corpus, which includes former failures.

use std::io::Write;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use stereology_kmatrix::{SectionLaw, SectionOptions};
use stereology_segment::{PhotoOptions, SegmentOptions, Segmentation, read_grey, read_labels_for, read_photo_with};
use stereology_shape::{
    Body, ClosedMesh, ControlSphere, MeshFormat, TableSource, TriangleMesh, convex_hull, parse_points,
};

/// Meshes of more triangles are read and checked, but not swept, to spend the time on small ones.
const MOST_SWEPT: usize = 400;

/// Reads the bytes as every mesh file format, and sweeps meshes that enclose a solid.
pub fn mesh_file(bytes: &[u8]) {
    for format in [MeshFormat::Obj, MeshFormat::Stl, MeshFormat::Ply] {
        if let Ok(mesh) = format.parse(bytes, Path::new("bytes")) {
            solid(mesh);
        }
    }
    if let Ok(points) = parse_points(bytes, Path::new("bytes"))
        && let Ok(hull) = convex_hull(&points)
    {
        solid(hull.as_triangle_mesh().clone());
    }
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Ok(sphere) = ControlSphere::from_json(text)
    {
        solid(sphere.triangles(3));
    }
}

/// Reads the bytes as delimited text, and all of its numbers, which are finite.
pub fn table(bytes: &[u8]) {
    let source = TableSource {
        columns: &["area", "size", "x"],
        slashes: false,
    };
    let Ok(table) = source.parse(bytes) else { return };
    let columns = table.columns().len().clamp(1, 64);
    let _ = (table.format(), table.remarks(), table.column(source.columns));
    for row in table.rows() {
        let _ = row.check_width();
        for number in (0..columns).filter_map(|column| row.number(column).ok()) {
            assert!(number.is_finite());
        }
    }
}

/// Most pixels of pictures, and the size of label maps, (height, width).
const MOST_PIXELS: u64 = 1 << 20;
const MAP: (usize, usize) = (24, 32);

/// Reads the bytes as a picture of any format.
pub fn photo(bytes: &[u8]) {
    let options = PhotoOptions {
        most_pixels: MOST_PIXELS,
        ..PhotoOptions::default()
    };
    let file = file_of(bytes);
    if let Ok(read) = read_photo_with(file.path(), &options) {
        assert!(u64::from(read.photo.width()) * u64::from(read.photo.height()) <= MOST_PIXELS);
    }
    if let Ok(read) = read_grey(file.path(), &options) {
        assert!(read.grey.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}

/// Reads the bytes as a label map of any format (TIFF, PNG, NumPy, GeoJSON, COCO, LabelMe, VIA, ImageJ's regions), and
/// measures its profiles.
pub fn labels(bytes: &[u8]) {
    let Ok(read) = read_labels_for(file_of(bytes).path(), MAP) else {
        return;
    };
    if read.labels.len() as u64 > MOST_PIXELS {
        return;
    }
    if let Ok(found) = Segmentation::of_sizes(read.labels, &SegmentOptions::default()) {
        assert!(found.profiles.iter().all(|p| p.area > 0.0 && p.size.is_finite()));
    }
}

/// The bytes as a file: formats are recognised by the contents.
fn file_of(bytes: &[u8]) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().expect("a file");
    file.write_all(bytes).expect("the bytes can be written");
    file
}

/// Interprets the bytes as a mesh: the number of vertices; coordinates of one byte each (so that many vertices are
/// coplanar, collinear or equal) or of eight; and triangles of three bytes.
pub fn sweep(bytes: &[u8]) {
    let [count, kind, rest @ ..] = bytes else { return };
    let wide = kind % 4 == 0;
    let width = if wide { 24 } else { 3 };
    let vertices = usize::from(*count);
    let Some((positions, corners)) = rest.split_at_checked(vertices * width) else {
        return;
    };
    let coordinate = |bytes: &[u8]| match bytes {
        [x] => f64::from(*x % kind.saturating_add(2)),
        _ => f64::from_le_bytes(bytes.try_into().unwrap_or_default()),
    };
    let vertices = positions
        .chunks_exact(width)
        .map(|p| {
            let mut at = p.chunks_exact(width / 3).map(coordinate);
            let mut next = || at.next().unwrap_or_default();
            Point3::new(next(), next(), next())
        })
        .collect();
    let triangles = corners
        .chunks_exact(3)
        .map(|t| [t[0], t[1], t[2]].map(|v| u32::from(v) % (u32::from(*count) + u32::from(kind % 7 == 0)).max(1)))
        .collect();
    solid(TriangleMesh { vertices, triangles });
}

fn solid(mesh: TriangleMesh) {
    let Ok(closed) = ClosedMesh::try_from(mesh) else { return };
    assert!(closed.volume() > 0.0 && closed.volume().is_finite());
    assert!(closed.mean_width() > 0.0 && closed.signed_mean_width().is_finite());
    if closed.triangles().len() > MOST_SWEPT {
        return;
    }
    let body = Body::from_mesh(closed);
    assert!(body.largest_section_area() > 0.0 && body.size().is_finite());
    for normal in [Vector3::x_axis(), Vector3::z_axis()] {
        let areas = body.profile_areas(&normal, body.centroid().coords.dot(&normal));
        assert!(areas.iter().all(|area| area.is_finite() && *area >= 0.0));
    }
    if let Ok(law) = SectionLaw::of_body(&body, &SectionOptions::default().with_directions(64)) {
        let matrix = law.k_matrix(5);
        for (j, column) in matrix.column_iter().enumerate() {
            assert!((column.sum() - (j + 1) as f64 / 5.0).abs() < 1e-9, "{matrix}");
            assert!(column.iter().all(|k| *k >= -1e-12));
        }
        assert!(law.caliper_effective().is_finite() && law.mean_square_profile_area().is_finite());
    }
}
