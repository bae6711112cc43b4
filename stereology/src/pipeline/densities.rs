//! From measured profiles to particles per volume: all particles together, by particle type and by colour category.

use crate::pipeline::fitting::{Fitting, Group};
use crate::pipeline::{
    Association, Clusters, DensityError, DensityOptions, LargestSize, MeasuredProfiles, ParticleTypes, Settled,
    association,
};
use stereology_kmatrix::Sizes;
use stereology_metrics::{Finding, Progress};
use stereology_unfold::{
    CategoryDensity, CategoryModel, TypesUnfolding, UnfoldError, Unfolding, profile_findings,
    unfold_types_with_progress,
};

/// Particles per volume: all together, by particle type, by colour category; and what was chosen on the way.
#[derive(Clone, Debug)]
pub struct ParticleDensities {
    /// All particles together.
    pub all: Unfolding,
    /// Each particle type, if there are several and the type of every profile is known; `all` is then their sum.
    pub by_type: Vec<Unfolding>,
    /// Parts of `all` by colour category, in increasing order; they sum to it. A category with no profile above the
    /// threshold has none. Where the types of the profiles are known, each category has a part of each type.
    pub by_category: Vec<CategoryPart>,
    /// Edges of the fine bins of every part, of which the reported bins consist.
    pub fine_edges: Vec<f64>,
    /// Whether sizes differ between colour categories.
    pub association: Association,
    /// The particle types, with the fractions of the fit.
    pub types: ParticleTypes,
    /// Sizes of the particles within a bin.
    pub sizes: Sizes,
    /// Edges of the bins in which `all.observed` and `all.refolded` count profiles.
    pub profile_edges: Vec<f64>,
    /// Clustering of the profiles, and what the intervals resample.
    pub clusters: Clusters,
    /// What was chosen or estimated before the fit.
    pub settled: Settled,
    /// Remarks: those of `all` and of each type, then `few-profiles`, `fewer-bins`, `largest-uncorrected`, `clustered`
    /// and `merged-category`.
    pub findings: Vec<Finding>,
}

/// The particles of a colour category, of all types or of one.
#[derive(Clone, Debug)]
pub struct CategoryPart {
    /// The category.
    pub category: u8,
    /// The type of these particles, if the types of the profiles are known; otherwise all types in their fractions.
    pub kind: Option<usize>,
    /// Counted profiles.
    pub profiles: usize,
    /// Particles per unit volume.
    pub density: CategoryDensity,
}

/// Unfolds profiles to particles per volume.
///
/// First the size bins, the threshold, the capping angle and the fractions of the types are settled
/// ([`DensityOptions`]). Then:
///
/// - If the type of every profile is known (`profiles.types`) and there are several types, each type is unfolded with
///   its own kernel, eq. (9), and `all` is their sum. Otherwise all profiles are unfolded with the joint kernel of
///   `types`, eqs. (10)-(12).
/// - Colour categories are labels of these particles: p(category | size) is estimated from the labels of the profiles
///   ([`unfold_categories`](stereology_unfold::unfold_categories)) where sizes differ between categories
///   (Kruskal-Wallis, p below 0.01). Otherwise each category has its fraction of the profiles at every size. Either way
///   the categories sum to all particles. Section 4.2 unfolds each category separately instead, whose sum is too large
///   where the category follows the size of the profile.
///
/// A category with no profile above the threshold is merged into the nearest in colour, or in size if colours are not
/// known (`merged-category`).
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
    let observed: Vec<Group> = (0..=u8::MAX)
        .zip(&by_colour)
        .filter(|(_, places)| fitting.observed(places))
        .map(|(category, places)| Group {
            category,
            places: places.clone(),
        })
        .collect();
    if observed.is_empty() {
        let threshold = fitting.unfold.min_size.unwrap_or(0.0);
        return Err(UnfoldError::Threshold(threshold).into());
    }
    let model = if association.together {
        CategoryModel::BySize
    } else {
        CategoryModel::Constant
    };
    let (mut all, by_type, by_category, fine_edges) = if labelled {
        // Fits with intervals take nearly all of the time.
        let found = unfold_types(&fitting, &counted, &|done| progress(0.5 * done))?;
        let (parts, edges) = split_types(&fitting, &counted, &observed, model, &|done| progress(0.5 + 0.5 * done))?;
        (found.summed(), found.types, parts, edges)
    } else {
        let found = fitting.categories(&counted, &observed, None, model, progress)?;
        let parts = parts(&observed, None, &found.categories, |group| group.places.len());
        (found.all, Vec::new(), parts, found.fine_edges)
    };
    if !labelled {
        all.findings = fitting.cured(&all.findings, &counted, None);
        if let Some(edges) = fitting.histogram_edges() {
            all.rebin_profiles(&edges);
        }
    }
    let mut findings = findings(profiles, &all, &by_type, counted.len(), &fitting.settled, options);
    findings.extend(fitting.clusters.finding());
    findings.extend(merged_categories(profiles, &by_colour, &observed, all.threshold));
    Ok(ParticleDensities {
        findings,
        by_type,
        by_category,
        fine_edges,
        association,
        types: fitting.types.into_owned(),
        sizes: options.sizes,
        profile_edges: all.profile_edges.clone(),
        clusters: fitting.clusters,
        settled: fitting.settled,
        all,
    })
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

/// Each type with its own kernel.
fn unfold_types(
    fitting: &Fitting<'_>,
    counted: &[usize],
    progress: Progress<'_>,
) -> Result<TypesUnfolding, DensityError> {
    let types = fitting.types.types();
    let places: Vec<Vec<usize>> = (0..types.len()).map(|kind| fitting.of_type(counted, kind)).collect();
    if let Some(index) = places.iter().position(Vec::is_empty) {
        return Err(DensityError::EmptyType {
            index,
            name: types[index].name.clone(),
        });
    }
    let fits = places
        .iter()
        .enumerate()
        .map(|(kind, places)| fitting.part(places, Some(kind)))
        .collect::<Result<Vec<_>, DensityError>>()?;
    let mut found = unfold_types_with_progress(&fits, &fitting.unfold, progress)?;
    for (kind, (part, places)) in found.types.iter_mut().zip(&places).enumerate() {
        part.findings = fitting.cured(&part.findings, places, Some(kind));
    }
    if let Some(edges) = fitting.histogram_edges() {
        found.rebin_profiles(&edges);
    }
    Ok(found)
}

/// The categories of each type, and the edges of their fine bins.
fn split_types(
    fitting: &Fitting<'_>,
    counted: &[usize],
    observed: &[Group],
    model: CategoryModel,
    progress: Progress<'_>,
) -> Result<(Vec<CategoryPart>, Vec<f64>), DensityError> {
    let kinds = fitting.types.types().len();
    let (mut found, mut edges) = (Vec::new(), Vec::new());
    for kind in 0..kinds {
        let part = |done: f64| progress((kind as f64 + done) / kinds as f64);
        let of_type = fitting.categories(&fitting.of_type(counted, kind), observed, Some(kind), model, &part)?;
        let profiles = |group: &Group| fitting.of_type(&group.places, kind).len();
        found.extend(parts(observed, Some(kind), &of_type.categories, profiles));
        edges = of_type.fine_edges;
    }
    found.sort_by_key(|part| (part.category, part.kind));
    Ok((found, edges))
}

fn parts(
    observed: &[Group],
    kind: Option<usize>,
    densities: &[CategoryDensity],
    profiles: impl Fn(&Group) -> usize,
) -> Vec<CategoryPart> {
    let groups = observed.iter().zip(densities);
    groups
        .map(|(group, density)| CategoryPart {
            category: group.category,
            kind,
            profiles: profiles(group),
            density: density.clone(),
        })
        .collect()
}

/// A remark for each category whose profiles are all below the threshold.
fn merged_categories(
    profiles: &MeasuredProfiles,
    by_colour: &[Vec<usize>],
    observed: &[Group],
    threshold: f64,
) -> Vec<Finding> {
    let mean_size =
        |places: &[usize]| places.iter().map(|&i| profiles.sizes[i]).sum::<f64>() / places.len().max(1) as f64;
    let is_observed = |category: usize| observed.iter().any(|group| usize::from(group.category) == category);
    let merged = (0..by_colour.len()).filter(|&category| !by_colour[category].is_empty() && !is_observed(category));
    merged
        .filter_map(|category| {
            let colour = |category: usize| profiles.colours.get(category);
            let distance = |group: &&Group| match (colour(category), colour(usize::from(group.category))) {
                (Some(a), Some(b)) => a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>(),
                _ => (mean_size(&by_colour[category]) - mean_size(&group.places)).abs(),
            };
            let nearest = observed.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            let by = if colour(category).is_some() { "colour" } else { "size" };
            Some(Finding::new(
                "merged-category",
                format!(
                    "none of the {} profiles of category {category} is above the threshold {threshold:.4}: its particles are counted in category {}, the nearest in {by}",
                    by_colour[category].len(),
                    nearest.category
                ),
            ))
        })
        .collect()
}

/// Fewer profiles than this do not determine a distribution of sizes.
const FEW: usize = 10;

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
    if counted < FEW {
        findings.push(Finding::new(
            "few-profiles",
            format!("{counted} profiles: the densities are hardly more than a guess; examine a larger area"),
        ));
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
