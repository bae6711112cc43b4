//! Profiles that are told apart, by the type of their particle or by its colour: each group unfolded by itself on common bins, and all together.

use crate::pipeline::fitting::Fitting;
use crate::pipeline::{DensityError, DensityOptions, MeasuredProfiles, ParticleTypes};
use stereology_unfold::{Progress, TypesUnfolding, unfold_types_with_progress};

/// Colour categories, each and together.
#[derive(Clone, Debug)]
pub struct CategoryDensities {
    /// Category of each entry of `found.types`, rising.
    pub categories: Vec<u8>,
    /// Type of the particles of each entry, where types are told apart too.
    pub kinds: Vec<Option<usize>>,
    /// Each by itself, and their sum, with intervals if asked.
    pub found: TypesUnfolding,
}

/// Unfolds profiles whose type is known (`profiles.types`), each type with its own kernel: eq. (9).
///
/// # Errors
///
/// [`DensityError`]: as [`particle_densities`](crate::pipeline::particle_densities), and [`DensityError::Labels`] for a type without a shape, or a shape
/// without profiles.
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, type_densities};
/// // Cuts at even depths through spheres, called type 0, and again, called type 1.
/// let cuts = |i: i32| 10.0 * (1.0 - ((f64::from(i % 300) + 0.5) / 300.0).powi(2)).sqrt();
/// let sizes: Vec<f64> = (0..600).map(cuts).collect();
/// let types = (0..600).map(|i| i / 300).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 600], categories: vec![0; 600], types, area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let spheres = ParticleTypes::parse(&["sphere", "sphere"])?;
/// let found = type_densities(&profiles, &spheres, &DensityOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert!((found.total.value - 2.0 * found.types[0].total.value).abs() < 1e-9 * found.total.value);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn type_densities(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    options: &DensityOptions,
    progress: Progress<'_>,
) -> Result<TypesUnfolding, DensityError> {
    let kinds = types.types().len();
    if profiles.types.len() != profiles.sizes.len() {
        return Err(DensityError::Labels(
            "not every profile has a type: give all, or leave the column out".to_owned(),
        ));
    }
    if let Some(beyond) = profiles.types.iter().find(|kind| **kind >= kinds) {
        return Err(DensityError::Labels(format!(
            "a profile has type {beyond}, but there are {kinds} --shape (types are numbered from 0)"
        )));
    }
    let fitting = Fitting::new(profiles, types, options)?;
    let counted = fitting.counted();
    let groups: Vec<Group> = (0..kinds)
        .map(|kind| Group {
            places: counted.iter().copied().filter(|&i| profiles.types[i] == kind).collect(),
            kind: Some(kind),
        })
        .collect();
    if let Some(kind) = groups.iter().position(|group| group.places.is_empty()) {
        return Err(DensityError::Labels(format!(
            "no profile of type {kind} ({}) counts; leave that --shape out",
            types.types()[kind].name
        )));
    }
    unfold_groups(&fitting, &groups, progress)
}

/// Unfolds each colour category by itself with the kernel of `types`, on common bins, and their sum; whether or not size and colour go together.
///
/// If the types of the profiles are known too (`profiles.types`), every type of every category has its own kernel, and `found.types` holds them category by
/// category. `None` if there are fewer than two categories.
///
/// # Errors
///
/// [`DensityError`], as [`type_densities`].
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, category_densities};
/// let cuts = |i: i32| 10.0 * (1.0 - ((f64::from(i % 300) + 0.5) / 300.0).powi(2)).sqrt();
/// let sizes: Vec<f64> = (0..600).map(cuts).collect();
/// let categories = (0..600).map(|i| if i < 300 { 0 } else { 2 }).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 600], categories, area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let spheres = ParticleTypes::parse(&["sphere"])?;
/// let found = category_densities(&profiles, &spheres, &DensityOptions::default(), &|_| ControlFlow::Continue(()))?.ok_or("one category")?;
/// assert_eq!(found.categories, [0, 2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn category_densities(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    options: &DensityOptions,
    progress: Progress<'_>,
) -> Result<Option<CategoryDensities>, DensityError> {
    let fitting = Fitting::new(profiles, types, options)?;
    let counted = fitting.counted();
    let mut categories: Vec<u8> = counted.iter().map(|&i| profiles.categories[i]).collect();
    categories.sort_unstable();
    categories.dedup();
    if categories.len() < 2 {
        return Ok(None);
    }
    let labelled = types.types().len() > 1 && profiles.types.len() == profiles.sizes.len();
    let kinds: Vec<Option<usize>> = if labelled {
        (0..types.types().len()).map(Some).collect()
    } else {
        vec![None]
    };
    let mut groups = Vec::new();
    let mut named = Vec::new();
    for &category in &categories {
        for &kind in &kinds {
            let of =
                |i: &usize| profiles.categories[*i] == category && kind.is_none_or(|kind| profiles.types[*i] == kind);
            let places: Vec<usize> = counted.iter().copied().filter(of).collect();
            // Only profiles above the threshold can be unfolded.
            let least = fitting.unfold.min_size.unwrap_or(0.0);
            if places.iter().any(|&i| profiles.sizes[i] > least) {
                groups.push(Group { places, kind });
                named.push(category);
            }
        }
    }
    if groups.is_empty() {
        return Ok(None);
    }
    let found = unfold_groups(&fitting, &groups, progress)?;
    Ok(Some(CategoryDensities {
        categories: named,
        kinds: groups.iter().map(|group| group.kind).collect(),
        found,
    }))
}

/// Profiles that are unfolded by themselves.
struct Group {
    places: Vec<usize>,
    /// The type of their particles; `None`: all types in their shares.
    kind: Option<usize>,
}

fn unfold_groups(
    fitting: &Fitting<'_>,
    groups: &[Group],
    progress: Progress<'_>,
) -> Result<TypesUnfolding, DensityError> {
    let parts = groups
        .iter()
        .map(|group| fitting.part(&group.places, group.kind))
        .collect::<Result<Vec<_>, DensityError>>()?;
    let mut found = unfold_types_with_progress(&parts, &fitting.unfold, progress)?;
    for (part, group) in found.types.iter_mut().zip(groups) {
        part.findings = fitting.cured(&part.findings, &group.places, group.kind);
    }
    if let Some(edges) = fitting.histogram_edges() {
        found.rebin_profiles(&edges);
    }
    Ok(found)
}
