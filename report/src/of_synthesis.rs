//! The report of a synthesis: its numbers and images.

use image::RgbImage;
use stereology::grid::LengthUnit;
use stereology::kmatrix::Sizes;
use stereology::pipeline::{Comparison, ParticleTypes, Synthesis};
use stereology::unfold::Interval;

use crate::figures::{
    CategoryFigures, ComparisonFigures, PackingFigures, PhotoFigures, Remark, SectionFigures, SizeFigures,
    SynthesisReport,
};

/// Images of a solid for its report.
#[derive(Clone, Debug)]
pub struct SolidImages {
    /// One period of the solid.
    pub cube: RgbImage,
    /// Sections as large as the photograph.
    pub sections: Vec<RgbImage>,
}

/// How the computation was invoked.
#[derive(Clone, Debug, Default)]
pub struct Invocation {
    /// Name of the photograph, without its folder.
    pub photo_name: String,
    /// The command that repeats the computation.
    pub command: String,
    /// Every parameter with its value.
    pub parameters: Vec<(String, String)>,
    /// Unit of all lengths, if it is known.
    pub unit: Option<LengthUnit>,
}

impl SynthesisReport {
    /// The report of a synthesis, with these warnings.
    #[must_use]
    pub fn new(
        synthesis: &Synthesis,
        types: &ParticleTypes,
        images: SolidImages,
        invocation: Invocation,
        remarks: Vec<Remark>,
    ) -> Self {
        let pixel = synthesis.details.residual.voxel;
        Self {
            photo_name: invocation.photo_name,
            unit: match invocation.unit {
                Some(unit) => unit.printed(),
                None if (pixel - 1.0).abs() < 1e-12 => "px",
                None => "units",
            }
            .to_owned(),
            command: invocation.command,
            parameters: invocation.parameters,
            remarks,
            verdict: synthesis.verdict.clone(),
            photo: photo(synthesis, pixel),
            sizes: sizes(synthesis, types),
            packing: PackingFigures {
                particles: synthesis.packing.particles().len() as u64,
                sides: synthesis.packing.sides().into(),
                fraction: synthesis.packing.fraction(),
                requested_fraction: synthesis.population.fraction,
                iterations: synthesis.packing.iterations() as u64,
                cube: images.cube.clone(),
            },
            comparison: comparison(synthesis, images),
        }
    }
}

fn photo(synthesis: &Synthesis, pixel: f64) -> PhotoFigures {
    let found = &synthesis.segmentation;
    let categories = found.categories.iter().enumerate().map(|(k, category)| {
        let own: Vec<f64> = found
            .profiles
            .iter()
            .filter(|p| usize::from(p.category) == k)
            .map(|p| p.size * pixel)
            .collect();
        CategoryFigures {
            colour: category.colour,
            profiles: category.profiles as u64,
            mean_size: own.iter().sum::<f64>() / own.len() as f64,
        }
    });
    PhotoFigures {
        picture: found.photo().clone(),
        overlay: found.overlay(),
        profiles: found.profiles.iter().filter(|profile| profile.weight > 0.0).count() as u64,
        profiles_found: found.profiles.len() as u64,
        area_fraction: found.area_fraction,
        number_per_area: found.number_per_area / (pixel * pixel),
        categories: categories.collect(),
        binder: found.binder.colour,
    }
}

fn sizes(synthesis: &Synthesis, types: &ParticleTypes) -> SizeFigures {
    let kernel = match synthesis.densities.sizes {
        Sizes::Integrated => "integrated",
        Sizes::UpperEdge => "upper-edge",
    };
    let (densities, found) = (&synthesis.densities, &synthesis.densities.all);
    let area = synthesis.profiles.area;
    let ends = |interval: Interval| (interval.lower, interval.upper);
    let particle_sizes: Vec<f64> = synthesis
        .packing
        .particles()
        .iter()
        .map(|particle| particle.size)
        .collect();
    let volume = synthesis.population.period.volume();
    SizeFigures {
        profile_edges: densities.profile_edges.clone(),
        observed: found.observed.iter().map(|n| n * area).collect(),
        refolded: found.refolded.iter().map(|n| n * area).collect(),
        particle_edges: found.edges.clone(),
        number_density: found.number_density.clone(),
        interval: found.intervals.as_ref().map(|intervals| {
            intervals
                .iter()
                .map(|interval| interval.map_or((f64::NAN, f64::NAN), ends))
                .collect()
        }),
        packed: histogram(&particle_sizes, &found.edges, 1.0 / volume),
        total: found.total.value,
        total_interval: found.total.interval.map(ends),
        mean_size: found.mean_size.value,
        volume_fraction: synthesis.population.unfolded_fraction,
        shapes: types.types().iter().map(|of| (of.name.clone(), of.share)).collect(),
        by_shape: synthesis.by_shape.clone(),
        method: format!("{}, {kernel} kernel", found.method.name()),
        deviance: found.deviance,
        degrees_of_freedom: found.degrees_of_freedom as f64,
        condition_number: found.condition_number,
        clamped_bins: found.clamped_bins.len() as u64,
    }
}

fn comparison(synthesis: &Synthesis, images: SolidImages) -> ComparisonFigures {
    let found = &synthesis.verification;
    let figures = |of: &Comparison| SectionFigures {
        profiles: of.profiles_synthetic as u64,
        size_w1: of.size_w1,
        area_fraction_photo: of.area_fraction_photo,
        area_fraction_synthetic: of.area_fraction_synthetic,
        colour_distance: of.colour_distance,
    };
    ComparisonFigures {
        exact: figures(&found.exact),
        resegmented: found.resegmented.as_ref().map(figures),
        outlines: found.outlines,
        profiles_synthetic: histogram(
            &found.section_sizes,
            &synthesis.densities.profile_edges,
            synthesis.profiles.area / found.section_area,
        ),
        spectrum: synthesis.spectra.clone(),
        sections: images.sections,
    }
}

/// Number of values in each bin (a, b], times `weight`.
fn histogram(values: &[f64], edges: &[f64], weight: f64) -> Vec<f64> {
    let mut counts = vec![0_u64; edges.len().saturating_sub(1)];
    for &value in values {
        let above = edges.partition_point(|&edge| edge < value);
        if (1..edges.len()).contains(&above) {
            counts[above - 1] += 1;
        }
    }
    counts.into_iter().map(|n| n as f64 * weight).collect()
}

#[cfg(test)]
mod tests {
    use super::histogram;

    #[test]
    fn bins_hold_their_upper_edge() {
        assert_eq!(
            histogram(&[0.0, 0.5, 1.0, 1.5, 2.0, 2.5], &[0.0, 1.0, 2.0], 2.0),
            [4.0, 4.0]
        );
    }
}
