//! Discs drawn on a binder, with blur, texture and uneven light.

use image::{Rgb, RgbImage};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A disc: centre, radius, colour.
pub(crate) struct Disc {
    pub(crate) centre: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) colour: [f64; 3],
}

/// Discs that keep a distance of 4 pixels, radii from 5 to 16, lighter and darker than the grey between them.
pub(crate) fn discs(count: usize, [width, height]: [u32; 2], seed: u64) -> Vec<Disc> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let colours = [[60.0, 45.0, 40.0], [230.0, 220.0, 210.0], [170.0, 60.0, 50.0]];
    let mut out: Vec<Disc> = Vec::new();
    for _ in 0..100 * count {
        if out.len() == count {
            break;
        }
        let radius = 5.0 + 11.0 * rng.random::<f64>();
        let place = |n: u32, r: f64| radius + 3.0 + (f64::from(n) - 2.0 * radius - 6.0) * r;
        let centre = [place(width, rng.random()), place(height, rng.random())];
        let apart = |d: &Disc| (d.centre[0] - centre[0]).hypot(d.centre[1] - centre[1]) > d.radius + radius + 4.0;
        if out.iter().all(apart) {
            out.push(Disc {
                centre,
                radius,
                colour: colours[out.len() % 3],
            });
        }
    }
    out
}

/// The photo: an edge one pixel and a half wide, texture of a few levels, light that falls by a tenth across.
pub(crate) fn photo(discs: &[Disc], [width, height]: [u32; 2], seed: u64) -> RgbImage {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    RgbImage::from_fn(width, height, |x, y| {
        let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let mut colour = [150.0, 148.0, 140.0];
        for d in discs {
            let outside = (px - d.centre[0]).hypot(py - d.centre[1]) - d.radius;
            let cover = (0.5 - outside / 1.5).clamp(0.0, 1.0);
            (0..3).for_each(|c| colour[c] += cover * (d.colour[c] - colour[c]));
        }
        let light = 1.05 - 0.1 * px / f64::from(width);
        let texture = 4.0 * (rng.random::<f64>() - 0.5);
        Rgb(colour.map(|c| {
            (c * light + texture + 2.0 * (rng.random::<f64>() - 0.5))
                .round()
                .clamp(0.0, 255.0) as u8
        }))
    })
}
