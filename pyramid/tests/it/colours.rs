//! Colour components are uncorrelated and lossless, and brightness keeps its bands.

use nalgebra::Vector3;
use ndarray::{Array2, Array3, ArrayView3};
use proptest::prelude::*;
use std::ops::ControlFlow;
use stereology_pyramid::{
    Exemplar, PrincipalColours, SteerablePyramid, TextureOptions, cut_variances, synthesize_volume,
};

proptest! {
    /// For any colours and weights the components reconstruct the colours and are uncorrelated, their variances sum to
    /// that of the colours, and the first is the weighted sum.
    #[test]
    fn components_led_by_a_sum_are_uncorrelated_and_lossless(
        colours in prop::collection::vec(prop::array::uniform3(0.0_f32..1.0), 4..40),
        weights in prop::array::uniform3(0.05_f64..1.0),
    ) {
        let axes = PrincipalColours::fit(3, colours.iter().map(<[f32; 3]>::as_slice)).led_by(&weights);
        let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let mut products = [[0.0; 3]; 3];
        let mut variance = 0.0;
        for colour in &colours {
            let (mut component, mut back) = ([0.0; 3], [0.0; 3]);
            axes.decorrelate(colour, &mut component);
            axes.recombine(&component, &mut back);
            let from_mean = [0, 1, 2].map(|c| f64::from(colour[c]) - axes.mean()[c]);
            let sum: f64 = (0..3).map(|c| weights[c] * from_mean[c]).sum();
            prop_assert!((f64::from(component[0]) - sum / length).abs() < 1e-5);
            for i in 0..3 {
                prop_assert!((back[i] - colour[i]).abs() < 1e-5);
                variance += from_mean[i].powi(2) / colours.len() as f64;
                for j in 0..3 {
                    products[i][j] += f64::from(component[i]) * f64::from(component[j]) / colours.len() as f64;
                }
            }
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            prop_assert!(products[i][j].abs() < 1e-5, "{products:?}");
        }
        prop_assert!((axes.variances().iter().sum::<f64>() - variance).abs() < 1e-6);
    }
}

fn brightness(colours: ArrayView3<'_, f32>) -> Array2<f32> {
    colours.map_axis(ndarray::Axis(2), |c| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2])
}

/// Red and green are correlated in fine grain and anticorrelated in coarse spots. Their principal axes are uncorrelated
/// overall, but correlated in every band: with them, the band variances of brightness would have an error of 7 %.
#[test]
fn brightness_has_its_bands_where_the_correlation_of_colours_depends_on_scale() {
    let n = 64;
    let grain =
        |y: usize, x: usize| ((x * 7919 + y * 104_729 + x * y * 31 + (x * x * y) % 97) % 101) as f32 / 101.0 - 0.5;
    // Blurred grain is coarser, and an isotropic volume can have such slices.
    let blurred = |y: usize, x: usize| {
        let about = (0..25).map(|i| grain((y + i / 5 + 17) % n, (x + i % 5 + 29) % n));
        about.sum::<f32>() / 5.0
    };
    let exemplar = Array3::from_shape_fn((n, n, 3), |(y, x, c)| match c {
        0 => 0.5 + 0.4 * grain(y, x) + 0.5 * blurred(y, x),
        1 => 0.5 + 0.4 * grain(y, x) - 0.4 * blurred(y, x),
        _ => 0.5,
    });
    let levels = 2;
    let image = brightness(exemplar.view());
    let bands = SteerablePyramid::new([n, n], levels, 4)
        .and_then(|p| p.build(image.view()))
        .unwrap();
    let mut wanted = vec![0.0; levels + 1];
    for band in bands.summaries() {
        match band.orientation {
            Some(_) => wanted[1 + band.level] += band.mean_square,
            None if band.level == 0 => wanted[0] += band.mean_square,
            None => {}
        }
    }
    let go = |_: f64| ControlFlow::Continue(());
    let options = TextureOptions::default().with_levels(levels);
    let volume = synthesize_volume(&Exemplar::new(exemplar.view()), [32; 3], &options, &go).unwrap();
    let grey = volume.map_axis(ndarray::Axis(3), |c| 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]);
    let normals = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    for found in cut_variances(grey.view(), &normals, levels).unwrap() {
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!((found / wanted).ln().abs() < 0.05, "{found} for {wanted}");
        }
    }
}
