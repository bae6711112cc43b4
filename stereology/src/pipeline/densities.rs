//! From measured profiles to particles per volume: all particles together, by particle type and by colour category.

use std::ops::ControlFlow;

use crate::pipeline::fitting::Fitting;
use crate::pipeline::{
    Association, DensityError, DensityOptions, LargestSize, MeasuredProfiles, ParticleTypes, SeparateCategories,
    Settled, association,
};
use stereology_kmatrix::Sizes;
use stereology_metrics::{Finding, Progress};
use stereology_unfold::{
    TypesUnfolding, UnfoldOptions, Unfolding, profile_findings, unfold_types_with_progress, unfold_with_progress,
};

/// Particles per volume: all together, by particle type, by colour category; and what was chosen on the way.
#[derive(Clone, Debug)]
pub struct ParticleDensities {
    /// All particles together.
    pub all: Unfolding,
    /// Each particle type, if there are several and the type of every profile is known; `all` is then their sum.
    pub by_type: Vec<Unfolding>,
    /// Each colour category unfolded separately, if that was requested or sizes differ between categories.
    pub categories: Option<CategoryDensities>,
    /// Number density by category and size bin, from which a solid is populated; `None` in bins wholly below the
    /// threshold. Category c is entry c.
    pub by_category: Vec<Vec<Option<f64>>>,
    /// Whether sizes differ between colour categories.
    pub association: Association,
    /// The particle types, with the fractions of the fit.
    pub types: ParticleTypes,
    /// Sizes of the particles within a bin.
    pub sizes: Sizes,
    /// Edges of the bins in which `all.observed` and `all.refolded` count profiles.
    pub profile_edges: Vec<f64>,
    /// What was chosen or estimated before the fit.
    pub settled: Settled,
    /// Remarks: those of `all` and of each type, then `fewer-bins` and `largest-uncorrected`.
    pub findings: Vec<Finding>,
}

/// Colour categories unfolded separately, on common bins.
#[derive(Clone, Debug)]
pub struct CategoryDensities {
    /// Category of each entry of `found.types`, in increasing order.
    pub categories: Vec<u8>,
    /// Particle type of each entry, if the types of the profiles are known.
    pub kinds: Vec<Option<usize>>,
    /// Each entry separately, and their sum, with intervals if requested.
    pub found: TypesUnfolding,
}

/// Unfolds profiles to particles per volume.
///
/// First the size bins, the threshold, the capping angle and the fractions of the types are settled
/// ([`DensityOptions`]). Then:
///
/// - If the type of every profile is known (`profiles.types`) and there are several types, each type is unfolded with
///   its own kernel, eq. (9), and `all` is their sum. Otherwise all profiles are unfolded with the joint kernel of
///   `types`, eqs. (10)-(12).
/// - Where sizes differ between colour categories (Kruskal-Wallis, p below 0.01), each category is also unfolded
///   separately on the same bins, section 4.2. Otherwise all categories have the same size distribution, and each has
///   its fraction of the profiles.
///
/// A category with no profile above the threshold has zero density.
///
/// # Errors
///
/// [`DensityError`]: no counted profile, sizes beyond the largest, invalid bins, profiles of unknown types, types
/// without profiles, a cancelled run.
///
/// # Examples
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, unfold_profiles};
///
/// // Cuts through spheres of diameter 10, at evenly spread depths: N_A = D N_V.
/// let sizes: Vec<f64> = (0..300).map(|i| 10.0 * (1.0 - ((f64::from(i) + 0.5) / 300.0).powi(2)).sqrt()).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 300], categories: vec![0; 300], area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let options = DensityOptions { bins: 5, ..DensityOptions::default() };
/// let found = unfold_profiles(&profiles, &ParticleTypes::parse(&["sphere"])?, &options, &|_| ControlFlow::Continue(()))?;
/// assert!((found.all.total.value / (300.0 / 1e5 / 10.0) - 1.0).abs() < 0.15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Profiles of two known types, each with its own kernel:
///
/// ```
/// use std::ops::ControlFlow;
/// use stereology::pipeline::{DensityOptions, MeasuredProfiles, ParticleTypes, unfold_profiles};
///
/// let cuts = |i: i32| 10.0 * (1.0 - ((f64::from(i % 300) + 0.5) / 300.0).powi(2)).sqrt();
/// let sizes: Vec<f64> = (0..600).map(cuts).collect();
/// let types = (0..600).map(|i| i / 300).collect();
/// let profiles = MeasuredProfiles { weights: vec![1.0; 600], categories: vec![0; 600], types, area: 1e5, sizes, ..MeasuredProfiles::default() };
/// let spheres = ParticleTypes::parse(&["sphere", "sphere"])?;
/// let found = unfold_profiles(&profiles, &spheres, &DensityOptions::default(), &|_| ControlFlow::Continue(()))?;
/// assert!((found.all.total.value - 2.0 * found.by_type[0].total.value).abs() < 1e-9 * found.all.total.value);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # References
///
/// Jagnow, Dorsey & Rushmeier 2004, sections 3.3 and 4.2.
pub fn unfold_profiles(
    profiles: &MeasuredProfiles,
    types: &ParticleTypes,
    options: &DensityOptions,
    progress: Progress<'_>,
) -> Result<ParticleDensities, DensityError> {
    check_types(profiles, types)?;
    let fitting = Fitting::new(profiles, types, options)?;
    let counted = profiles.counted()?;
    let labelled = types.types().len() > 1 && profiles.have_types();
    let by_colour = by_category(profiles, &counted);
    let sizes_of = |places: &Vec<usize>| places.iter().map(|&i| profiles.sizes[i]).collect::<Vec<f64>>();
    let association = association(&by_colour.iter().map(sizes_of).collect::<Vec<_>>());

    let several = by_colour.iter().filter(|places| !places.is_empty()).count() > 1;
    let separate = several && options.categories == SeparateCategories::Always;
    // Fits with intervals take nearly all of the time.
    let part = if separate { 0.5 } else { 1.0 };
    let first = |done: f64| progress(part * done);
    let (all, by_type) = if labelled {
        let found = unfold_types(&fitting, &counted, &first)?;
        (found.summed(), found.types)
    } else {
        (unfold_together(&fitting, &counted, &first)?, Vec::new())
    };
    let categories = if separate {
        let groups = category_groups(&fitting, &by_colour, labelled);
        unfold_categories(&fitting, groups, &fitting.unfold, &|done| progress(part + part * done))?
    } else if association.together {
        let groups = category_groups(&fitting, &by_colour, false);
        let without_intervals = UnfoldOptions {
            bootstrap: None,
            ..fitting.unfold
        };
        unfold_categories(&fitting, groups, &without_intervals, &|_| ControlFlow::Continue(()))?
    } else {
        None
    };
    let by_category = match &categories {
        Some(separate) if association.together => summed_by_category(separate, &all, by_colour.len()),
        _ => fractions_by_category(profiles, &all, &by_colour),
    };
    Ok(ParticleDensities {
        findings: findings(profiles, &all, &by_type, counted.len(), &fitting.settled, options),
        by_type,
        categories,
        by_category,
        association,
        types: fitting.types.into_owned(),
        sizes: options.sizes,
        profile_edges: all.profile_edges.clone(),
        settled: fitting.settled,
        all,
    })
}

impl ParticleDensities {
    /// Number density of a size bin, summed over the categories; `None` below the threshold.
    #[must_use]
    pub fn combined(&self, bin: usize) -> Option<f64> {
        let known: Vec<f64> = self.by_category.iter().filter_map(|category| category[bin]).collect();
        (!known.is_empty()).then(|| known.iter().sum())
    }
}

/// Checks the types of the profiles, if they are known.
fn check_types(profiles: &MeasuredProfiles, types: &ParticleTypes) -> Result<(), DensityError> {
    if profiles.types.is_empty() {
        return Ok(());
    }
    if !profiles.have_types() {
        return Err(DensityError::SomeTypes {
            types: profiles.types.len(),
            profiles: profiles.sizes.len(),
        });
    }
    let types = types.types().len();
    match profiles.types.iter().find(|&&kind| kind >= types) {
        Some(&found) => Err(DensityError::UnknownType { found, types }),
        None => Ok(()),
    }
}

/// The counted profiles of each category; entry c is category c.
fn by_category(profiles: &MeasuredProfiles, counted: &[usize]) -> Vec<Vec<usize>> {
    let category = |i: usize| usize::from(profiles.categories[i]);
    let categories = counted.iter().map(|&i| category(i) + 1).max().unwrap_or(1);
    let mut groups = vec![Vec::new(); categories];
    counted.iter().for_each(|&i| groups[category(i)].push(i));
    groups
}

/// All profiles with the joint kernel of the types.
fn unfold_together(
    fitting: &Fitting<'_>,
    counted: &[usize],
    progress: Progress<'_>,
) -> Result<Unfolding, DensityError> {
    let (counts, kernel) = fitting.part(counted, None)?;
    let mut all = unfold_with_progress(&counts, &kernel, &fitting.unfold, progress)?;
    all.findings = fitting.cured(&all.findings, counted, None);
    if let Some(edges) = fitting.histogram_edges() {
        all.rebin_profiles(&edges);
    }
    Ok(all)
}

/// Each type with its own kernel.
fn unfold_types(
    fitting: &Fitting<'_>,
    counted: &[usize],
    progress: Progress<'_>,
) -> Result<TypesUnfolding, DensityError> {
    let types = fitting.types.types();
    let of_type = |kind: usize| Group {
        places: fitting.of_type(counted, kind),
        kind: Some(kind),
    };
    let groups: Vec<Group> = (0..types.len()).map(of_type).collect();
    if let Some(index) = groups.iter().position(|group| group.places.is_empty()) {
        return Err(DensityError::EmptyType {
            index,
            name: types[index].name.clone(),
        });
    }
    unfold_groups(fitting, &groups, &fitting.unfold, progress)
}

/// Profiles that are unfolded separately.
struct Group {
    places: Vec<usize>,
    /// The type of their particles; `None`: all types in their fractions.
    kind: Option<usize>,
}

/// The categories, and within each the types if `labelled`, that have a profile above the threshold.
fn category_groups(fitting: &Fitting<'_>, by_colour: &[Vec<usize>], labelled: bool) -> Vec<(u8, Group)> {
    let kinds: Vec<Option<usize>> = if labelled {
        (0..fitting.types.types().len()).map(Some).collect()
    } else {
        vec![None]
    };
    let mut groups = Vec::new();
    for (category, places) in (0..=u8::MAX).zip(by_colour) {
        for &kind in &kinds {
            let places = kind.map_or_else(|| places.clone(), |kind| fitting.of_type(places, kind));
            if fitting.observed(&places) {
                groups.push((category, Group { places, kind }));
            }
        }
    }
    groups
}

/// Unfolds the categories; `None` if none has a profile above the threshold.
fn unfold_categories(
    fitting: &Fitting<'_>,
    groups: Vec<(u8, Group)>,
    options: &UnfoldOptions,
    progress: Progress<'_>,
) -> Result<Option<CategoryDensities>, DensityError> {
    let (categories, groups): (Vec<u8>, Vec<Group>) = groups.into_iter().unzip();
    if categories.is_empty() {
        return Ok(None);
    }
    let found = unfold_groups(fitting, &groups, options, progress)?;
    Ok(Some(CategoryDensities {
        categories,
        kinds: groups.iter().map(|group| group.kind).collect(),
        found,
    }))
}

fn unfold_groups(
    fitting: &Fitting<'_>,
    groups: &[Group],
    options: &UnfoldOptions,
    progress: Progress<'_>,
) -> Result<TypesUnfolding, DensityError> {
    let parts = groups
        .iter()
        .map(|group| fitting.part(&group.places, group.kind))
        .collect::<Result<Vec<_>, DensityError>>()?;
    let mut found = unfold_types_with_progress(&parts, options, progress)?;
    for (part, group) in found.types.iter_mut().zip(groups) {
        part.findings = fitting.cured(&part.findings, &group.places, group.kind);
    }
    if let Some(edges) = fitting.histogram_edges() {
        found.rebin_profiles(&edges);
    }
    Ok(found)
}

/// Separate densities of every category, zero for those with no profile above the threshold.
fn summed_by_category(separate: &CategoryDensities, all: &Unfolding, categories: usize) -> Vec<Vec<Option<f64>>> {
    let none: Vec<Option<f64>> = all.number_density.iter().map(|density| density.map(|_| 0.0)).collect();
    let mut sums = vec![none; categories];
    for (&category, part) in separate.categories.iter().zip(&separate.found.types) {
        for (sum, density) in sums[usize::from(category)].iter_mut().zip(&part.number_density) {
            *sum = match (*sum, *density) {
                (Some(sum), Some(density)) => Some(sum + density),
                (sum, density) => sum.or(density),
            };
        }
    }
    sums
}

/// The density of all, in proportion to the profiles of every category.
fn fractions_by_category(
    profiles: &MeasuredProfiles,
    all: &Unfolding,
    by_colour: &[Vec<usize>],
) -> Vec<Vec<Option<f64>>> {
    let weight_of = |places: &[usize]| places.iter().map(|&i| profiles.weights[i]).sum::<f64>();
    let whole: f64 = profiles.weights.iter().filter(|weight| **weight > 0.0).sum();
    let of_category = |places: &Vec<usize>| {
        let fraction = weight_of(places) / whole;
        let densities = all.number_density.iter();
        densities.map(|density| density.map(|n| n * fraction)).collect()
    };
    by_colour.iter().map(of_category).collect()
}

fn findings(
    profiles: &MeasuredProfiles,
    all: &Unfolding,
    by_type: &[Unfolding],
    counted: usize,
    settled: &Settled,
    options: &DensityOptions,
) -> Vec<Finding> {
    let mut findings = all.findings.clone();
    findings.extend(profile_findings(
        &profiles.sizes,
        Some(&profiles.weights),
        profiles.area,
    ));
    for (kind, part) in by_type.iter().enumerate() {
        let of_type = |finding: &Finding| Finding::new(finding.code, format!("type {kind}: {}", finding.message));
        findings.extend(part.findings.iter().map(of_type));
    }
    if let Some(requested) = settled.reduced_from {
        findings.push(Finding::new(
            "fewer-bins",
            format!("{counted} profiles are too few for {requested} bins: {counted} equal bins were used"),
        ));
    }
    let uncorrected = |largest: &crate::pipeline::LargestParticle| largest.method != options.max_size;
    if settled.largest.as_ref().is_some_and(uncorrected) && options.max_size == LargestSize::Corrected {
        findings.push(Finding::new(
            "largest-uncorrected",
            "the largest profiles all have the same size, so the largest size could not be extrapolated: the size of the largest profile was used",
        ));
    }
    findings
}
