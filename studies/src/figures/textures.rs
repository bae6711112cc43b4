//! Volumes beside their exemplars, synthetic textures.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};
use nalgebra::{Point3, Vector3};
use ndarray::{Array3, Array4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stereology::pyramid::{
    Exemplar, Mode, TextureOptions, TextureReport, synthesize_oriented_volume, synthesize_volume,
};
use stereology::render::{BlockOptions, render_block};

/// Granite and terrazzo in the modes `slices` and `volume`, layered grains in the mode `oriented` from three images,
/// each cube beside its exemplars.
pub fn draw(folder: &Path) -> Result<()> {
    let go = |_: f64| ControlFlow::Continue(());
    for (name, picture) in [("granite", granite()), ("terrazzo", terrazzo())] {
        let samples = samples(&picture);
        for (mode_name, mode) in [("slices", Mode::Slices), ("volume", Mode::Volume)] {
            let options = TextureOptions::default().with_mode(mode);
            let volume = synthesize_volume(&Exemplar::new(samples.view()), [96; 3], &options, &go)?;
            let drawn = beside(&picture, &picture_of(&volume)?);
            drawn.save(folder.join(format!("texture-{name}-{mode_name}.png")))?;
        }
    }
    let views = flakes();
    let three = views.each_ref().map(samples);
    let exemplars = three.each_ref().map(|view| Exemplar::new(view.view()));
    let watch = |done: f64, _: &TextureReport| go(done);
    let (volume, _) = synthesize_oriented_volume(&exemplars, [96; 3], &TextureOptions::default(), &watch)?;
    let pictures = beside(&beside(&views[0], &views[1]), &views[2]);
    beside(&pictures, &picture_of(&volume)?).save(folder.join("texture-layers-oriented.png"))?;
    Ok(())
}

/// A block of one period of a volume.
pub fn picture_of(volume: &Array4<f32>) -> Result<RgbImage> {
    let (nz, ny, nx, _) = volume.dim();
    let index = |x: f64, n: usize| (x.max(0.0) as usize) % n;
    let colour = |p: &Point3<f64>| {
        [0, 1, 2].map(|c| volume[[index(p.z, nz), index(p.y, ny), index(p.x, nx), c]].clamp(0.0, 1.0))
    };
    let sides = Vector3::new(nx as f64, ny as f64, nz as f64);
    Ok(render_block(&colour, sides, &BlockOptions::default())?)
}

/// Two images side by side, the left one enlarged by an integer factor or reduced to fit.
pub fn beside(left: &RgbImage, right: &RgbImage) -> RgbImage {
    let height = right.height().max(left.height().min(256));
    let factor = (height / left.height()).max(1);
    let left = if left.height() > height {
        resize(
            left,
            left.width() * height / left.height(),
            height,
            FilterType::Triangle,
        )
    } else {
        resize(left, factor * left.width(), factor * left.height(), FilterType::Nearest)
    };
    let mut both = RgbImage::from_pixel(left.width() + 12 + right.width(), height, Rgb([255; 3]));
    replace(&mut both, &left, 0, i64::from((height - left.height()) / 2));
    replace(
        &mut both,
        right,
        i64::from(left.width() + 12),
        i64::from((height - right.height()) / 2),
    );
    both
}

fn samples(picture: &RgbImage) -> Array3<f32> {
    Array3::from_shape_fn((picture.height() as usize, picture.width() as usize, 3), |(y, x, c)| {
        f32::from(picture.get_pixel(x as u32, y as u32).0[c]) / 255.0
    })
}

const SIDE: u32 = 128;

/// Slightly smooths a periodic image of colours 0 to 255 and adds noise.
fn finished(seed: u64, noise: f64, colour: impl Fn(u32, u32) -> [f64; 3]) -> RgbImage {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let mut sum = [0.0; 3];
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let at = colour((x + dx) % SIDE, (y + dy) % SIDE);
            sum.iter_mut().zip(at).for_each(|(s, v)| *s += v / 4.0);
        }
        let shift = noise * (rng.random::<f64>() + rng.random::<f64>() - 1.0);
        Rgb(sum.map(|v| (v + shift).round().clamp(0.0, 255.0) as u8))
    })
}

/// Random points of the image.
fn points(rng: &mut ChaCha8Rng, count: usize) -> Vec<[f64; 2]> {
    (0..count)
        .map(|_| [0; 2].map(|_| f64::from(SIDE) * rng.random::<f64>()))
        .collect()
}

/// Distance in the periodic image, with rows stretched by `stretch`.
fn apart(a: [f64; 2], b: [f64; 2], stretch: f64) -> f64 {
    let d = [0, 1].map(|i| {
        let d = (a[i] - b[i]).abs();
        d.min(f64::from(SIDE) - d)
    });
    d[0].hypot(stretch * d[1])
}

/// Crystals of feldspar, quartz and mica.
fn granite() -> RgbImage {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let seeds = points(&mut rng, 900);
    let minerals = [
        [205.0, 170.0, 150.0],
        [180.0, 178.0, 172.0],
        [222.0, 216.0, 205.0],
        [62.0, 58.0, 60.0],
    ];
    let kinds: Vec<usize> = seeds.iter().map(|_| (4.0 * rng.random::<f64>()) as usize).collect();
    finished(2, 14.0, |x, y| {
        let at = [f64::from(x), f64::from(y)];
        let nearest = (0..seeds.len()).min_by(|&i, &j| apart(seeds[i], at, 1.0).total_cmp(&apart(seeds[j], at, 1.0)));
        minerals[kinds[nearest.unwrap_or(0)]]
    })
}

/// Chips of three colours in a pale binder.
fn terrazzo() -> RgbImage {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let centres = points(&mut rng, 110);
    let radii: Vec<f64> = centres
        .iter()
        .map(|_| 2.5 + 5.0 * rng.random::<f64>().powi(2))
        .collect();
    let chips = [[150.0, 84.0, 66.0], [96.0, 104.0, 112.0], [196.0, 160.0, 96.0]];
    finished(4, 18.0, |x, y| {
        let at = [f64::from(x), f64::from(y)];
        let inside = (0..centres.len()).find(|&i| apart(centres[i], at, 1.0) < radii[i]);
        inside.map_or([216.0, 210.0, 198.0], |i| chips[i % 3])
    })
}

/// A solid of flat grains, longer along x than along y and thin along z, cut normal to z (rows along y, columns along
/// x), to y (rows along z, columns along x) and to x (rows along z, columns along y).
fn flakes() -> [RgbImage; 3] {
    const LENGTHS: [f64; 3] = [14.0, 8.0, 3.5];
    let side = f64::from(SIDE);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let count = (side.powi(3) / LENGTHS.iter().product::<f64>()) as usize;
    let seeds: Vec<[f64; 3]> = (0..count).map(|_| [0; 3].map(|_| side * rng.random::<f64>())).collect();
    let shades: Vec<f64> = seeds.iter().map(|_| 90.0 + 120.0 * rng.random::<f64>()).collect();
    let colour = |at: [f64; 3]| {
        let apart = |seed: &[f64; 3]| -> f64 {
            let of_axis = |i: usize| {
                let d = (seed[i] - at[i]).abs();
                d.min(side - d) / LENGTHS[i]
            };
            (0..3).map(|i| of_axis(i).powi(2)).sum()
        };
        let nearest = (0..count).min_by(|&i, &j| apart(&seeds[i]).total_cmp(&apart(&seeds[j])));
        let shade = shades[nearest.unwrap_or(0)];
        [shade + 18.0, shade + 4.0, shade - 14.0]
    };
    let (middle, at) = (0.5 * side, |i: u32| f64::from(i));
    [
        finished(6, 14.0, |x, y| colour([at(x), at(y), middle])),
        finished(7, 14.0, |x, z| colour([at(x), middle, at(z)])),
        finished(8, 14.0, |y, z| colour([middle, at(y), at(z)])),
    ]
}
