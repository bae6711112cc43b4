//! One image rendered by this project and by Mitsuba (`pip install mitsuba`), an independent renderer, from the same
//! mesh, camera and sky.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use image::RgbImage;
use ndarray::Array3;
use stereology::imaging::{encoded_byte, linear};
use stereology::render::{Camera, RenderOptions, render_mesh, sky_map};
use stereology::shape::{TriangleMesh, write_mesh};

const SIDE: u32 = 256;
const SKY: [u32; 2] = [1024, 512];
const DISTANCE: f64 = 8.0;

/// Mitsuba renders `mesh.ply` under `sky.f32` and writes linear light to `mitsuba.f32`. Its columns of the sky run in
/// the opposite direction, from the back.
const SCRIPT: &str = r#"
import sys, numpy as np, mitsuba as mi
folder, azimuth, elevation, distance, fov, side, samples, red, green, blue = sys.argv[1], *map(float, sys.argv[2:])
mi.set_variant("scalar_rgb")
sky = np.fromfile(folder + "/sky.f32", "<f4").reshape(512, 1024, 3)
width = sky.shape[1]
sky = np.ascontiguousarray(sky[:, (width // 2 - 1 - np.arange(width)) % width])
a, e = np.radians(azimuth), np.radians(elevation)
eye = distance * np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
look = mi.ScalarTransform4f().look_at(origin=eye.tolist(), target=[0, 0, 0], up=[0, 1, 0])
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 64},
    "sensor": {"type": "perspective", "fov": fov, "to_world": look,
               "film": {"type": "hdrfilm", "width": int(side), "height": int(side), "rfilter": {"type": "box"}, "pixel_format": "rgb"},
               "sampler": {"type": "multijitter", "sample_count": int(samples)}},
    "light": {"type": "envmap", "bitmap": mi.Bitmap(sky.astype(np.float32))},
    "object": {"type": "ply", "filename": folder + "/mesh.ply",
               "bsdf": {"type": "twosided", "nested": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [red, green, blue]}}}},
})
np.array(mi.render(scene)).astype("<f4").tofile(folder + "/mitsuba.f32")
"#;

/// Renders a torus both ways, prints the difference of the images in grey levels, and keeps both in `folder`.
pub fn run(python: &Path, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let mesh = TriangleMesh::torus(2.0, 0.9, 96, 48);
    write_mesh(folder.join("mesh.ply"), &mesh)?;
    let camera = Camera {
        distance: Some(DISTANCE),
        ..Camera::default()
    };
    let sky = sky_map(&camera, SKY[0], SKY[1])?;
    let bytes: Vec<u8> = sky.into_raw().into_iter().flat_map(f32::to_le_bytes).collect();
    std::fs::write(folder.join("sky.f32"), bytes)?;
    let encoded = [0.85_f32, 0.6, 0.35];
    let options = RenderOptions {
        ground: false,
        gloss: 0.0,
        background: [0.0; 3],
        ..RenderOptions::default().with_size(SIDE, SIDE).with_samples(16)
    };
    let ours = render_mesh(&mesh, &|_| encoded, &camera, &options)?;
    ours.save(folder.join("ours.png"))?;

    let reflectance = encoded.map(linear);
    let numbers = [
        camera.azimuth,
        camera.elevation,
        DISTANCE,
        camera.field_of_view,
        f64::from(SIDE),
        1024.0,
    ];
    let status = Command::new(python)
        .args(["-c", SCRIPT])
        .arg(folder)
        .args(numbers.map(|number| number.to_string()))
        .args(reflectance.map(|number| number.to_string()))
        .status()
        .with_context(|| format!("{} cannot be run", python.display()))?;
    ensure!(status.success(), "Mitsuba failed; is it there (pip install mitsuba)?");
    let bytes = std::fs::read(folder.join("mitsuba.f32"))?;
    let values = bytes
        .as_chunks()
        .0
        .iter()
        .map(|four| f32::from_le_bytes(*four))
        .collect();
    let theirs = Array3::from_shape_vec((SIDE as usize, SIDE as usize, 3), values)?;
    compare(&ours, &theirs, folder)
}

/// Differences over the pixels that the object covers completely in both images.
fn compare(ours: &RgbImage, theirs: &Array3<f32>, folder: &Path) -> Result<()> {
    let picture = RgbImage::from_fn(SIDE, SIDE, |x, y| {
        image::Rgb([0, 1, 2].map(|c| encoded_byte(theirs[[y as usize, x as usize, c]])))
    });
    picture.save(folder.join("mitsuba.png"))?;
    // Where there is no object, Mitsuba shows the sky and our renderer black, so our image determines the background.
    let covered = |x: u32, y: u32| {
        (x.saturating_sub(1)..=(x + 1).min(SIDE - 1))
            .all(|x| (y.saturating_sub(1)..=(y + 1).min(SIDE - 1)).all(|y| ours.get_pixel(x, y).0[0] > 0))
    };
    let mut differences: Vec<f64> = (0..SIDE * SIDE)
        .map(|i| [i % SIDE, i / SIDE])
        .filter(|&[x, y]| covered(x, y))
        .flat_map(|[x, y]| {
            let (a, b) = (ours.get_pixel(x, y).0, picture.get_pixel(x, y).0);
            [0, 1, 2].map(|c| f64::from(a[c]) - f64::from(b[c]))
        })
        .collect();
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    differences.iter_mut().for_each(|d| *d = d.abs());
    differences.sort_by(f64::total_cmp);
    let absolute = differences.iter().sum::<f64>() / count;
    let most = differences[(0.999 * count) as usize];
    println!(
        "against Mitsuba, {count} values: mean difference {mean:.2} grey levels, mean absolute {absolute:.2}, 99.9 % within {most}; pictures in {}",
        folder.display()
    );
    ensure!(mean.abs() < 1.0 && absolute < 1.5, "the renderers disagree");
    Ok(())
}
