//! The study of urs-2012: methods and scans on one laminar image, evaluated at each iteration and at the end.

use std::fmt::Write as _;
use std::ops::ControlFlow;

use anyhow::{Result, ensure};
use ndarray::{Array2, Array4, ArrayView3, Axis};
use rayon::prelude::*;
use stereology::exemplar::{
    Domain, Exemplar, Method, Scan, SolidOptions, Views, synthesize_solid, synthesize_solid_watched,
};
use stereology::metrics::{
    Comparison, Family, Figure, grey, histogram, kl_divergence, moments, orientation_field, sections,
};
use stereology::pipeline::{CompareOptions, compare_solid};
use stereology::spectrum::BandPass;

/// The methods by name.
pub const METHODS: [(&str, Method); 3] = [
    ("wei-levoy", Method::WeiLevoy),
    ("kopf", Method::Kopf),
    ("chen-wang", Method::ChenWang),
];

/// The scans by name.
pub const SCANS: [(&str, Scan); 4] = [
    ("lexicographic", Scan::Lexicographic),
    ("random", Scan::Random),
    ("morton", Scan::Morton),
    ("hilbert", Scan::Hilbert),
];

/// Parameters of a synthesised solid.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub method: Method,
    pub scan: Scan,
    /// Voxels per side.
    pub size: usize,
    pub levels: usize,
    pub neighbourhood: usize,
    pub iterations: usize,
    /// Number k of similar pixels; `None` takes the method's own.
    pub similar: Option<usize>,
    pub seed: u64,
}

impl Case {
    /// The paper's setting: 5 levels, 7 × 7, 10 iterations, k = 15 (Chen and Wang).
    pub fn new(method: Method, scan: Scan, size: usize) -> Self {
        Self {
            method,
            scan,
            size,
            levels: 5,
            neighbourhood: 7,
            iterations: 10,
            similar: None,
            seed: 0,
        }
    }

    fn options(&self) -> SolidOptions {
        let options = SolidOptions::default()
            .with_method(self.method)
            .with_scan(self.scan)
            .with_views(Views::Two)
            .with_neighbourhood(self.neighbourhood)
            .with_iterations(self.iterations)
            .with_seed(self.seed);
        // Our method chooses its levels itself.
        let options = if self.method == Method::Best {
            options
        } else {
            options.with_levels(self.levels)
        };
        match self.similar {
            Some(k) => options.with_similar(k),
            None => options,
        }
    }
}

/// The solid compared with its exemplar after one iteration of the finest level.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub kl_grey: f64,
    pub std_ratio: f64,
    pub skewness: f64,
    pub kl_orientation: f64,
}

/// Result of a case.
pub struct Outcome {
    pub case: Case,
    pub moments: Vec<Moment>,
    pub found: Comparison,
    /// The middle slice of constant y.
    pub slice: Array2<f32>,
}

/// Statistics of the exemplar by which iterations are evaluated.
struct Shown {
    grey: Vec<f64>,
    deviation: f64,
    skewness: f64,
    orientation: Vec<f64>,
}

fn shown(pictures: &[Array2<f32>]) -> Shown {
    let n = pictures.len() as f64;
    let mean = |of: &dyn Fn(&Array2<f32>) -> Vec<f64>| {
        let mut sum = of(&pictures[0]);
        for picture in &pictures[1..] {
            sum.iter_mut().zip(of(picture)).for_each(|(s, v)| *s += v);
        }
        sum.into_iter().map(|s| s / n).collect::<Vec<f64>>()
    };
    let both = mean(&|p| {
        let m = moments(p);
        vec![m.deviation, m.skewness]
    });
    Shown {
        grey: mean(&|p| histogram(p.iter().copied(), 64)),
        deviation: both[0],
        skewness: both[1],
        orientation: mean(&|p| orientation_field(p).histogram(36)),
    }
}

/// Every fourth slice of the two families that resemble the exemplar.
fn slices(values: &Array4<f32>) -> Vec<ArrayView3<'_, f32>> {
    [Family::Xz, Family::Yz]
        .iter()
        .flat_map(|family| sections(values.view(), *family).into_iter().step_by(4))
        .collect()
}

fn go(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Synthesises and evaluates every case, one per core at a time, as the sequential solver uses one core.
pub fn run(picture: &Array2<f32>, cases: &[Case]) -> Result<Vec<Outcome>> {
    let wanted = shown(std::slice::from_ref(picture));
    let column = picture.view().insert_axis(Axis(2));
    cases
        .par_iter()
        .map(|case| {
            let mut found = Vec::new();
            let exemplar = [Exemplar::grey(picture.view())?];
            let domain = Domain::new([case.size; 3])?;
            let solid = synthesize_solid_watched(&exemplar, &domain, &case.options(), &go, &mut |now| {
                if now.coarser_by > 0 {
                    return;
                }
                let values = now.values();
                let pictures: Vec<Array2<f32>> = slices(&values).into_iter().map(grey).collect();
                let here = shown(&pictures);
                found.push(Moment {
                    kl_grey: kl_divergence(&here.grey, &wanted.grey),
                    std_ratio: here.deviation / wanted.deviation,
                    skewness: here.skewness,
                    kl_orientation: kl_divergence(&here.orientation, &wanted.orientation),
                });
            })?;
            let options = CompareOptions {
                patches: Some(8192),
                ..CompareOptions::default()
            };
            Ok(Outcome {
                case: *case,
                moments: found,
                found: compare_solid(&[column], &slices(&solid.values), &options, &go)?,
                slice: solid
                    .values
                    .index_axis(Axis(1), case.size / 2)
                    .index_axis_move(Axis(2), 0)
                    .to_owned(),
            })
        })
        .collect()
}

/// The image filtered to its fringes (the paper's figure 5b, d), with mean 0.5 and 6 standard deviations from black to
/// white.
pub fn band_passed(picture: &Array2<f32>) -> Result<Array2<f32>> {
    let picture = picture.mapv(f64::from);
    let filtered = BandPass::of(&picture)?.filter(&picture)?;
    let deviation = filtered.std(0.0);
    Ok(filtered.mapv(|v| (0.5 + v / (6.0 * deviation)).clamp(0.0, 1.0) as f32))
}

/// CPU seconds that this process has used; NaN if the system does not report them.
pub fn cpu_seconds() -> f64 {
    let ticks = std::fs::read_to_string("/proc/self/stat").ok().and_then(|stat| {
        // After the name in brackets: fields 14 and 15 of the line, in hundredths of a second.
        let fields: Vec<String> = stat.rsplit(')').next()?.split_whitespace().map(String::from).collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    });
    ticks.map_or(f64::NAN, |ticks| ticks / 100.0)
}

/// CPU microseconds per voxel and iteration of a method and scan without learning: from the difference of three
/// iterations and one.
pub fn cost(picture: &Array2<f32>, method: Method, scan: Scan) -> Result<f64> {
    let exemplar = [Exemplar::grey(picture.view())?];
    let domain = Domain::new([64; 3])?;
    let seconds = |iterations| -> Result<(f64, u64)> {
        let case = Case {
            iterations,
            ..Case::new(method, scan, 64)
        };
        let begin = cpu_seconds();
        let solid = synthesize_solid(&exemplar, &domain, &case.options(), &go)?;
        Ok((cpu_seconds() - begin, solid.voxel_iterations))
    };
    let ((short, few), (long, many)) = (seconds(1)?, seconds(5)?);
    Ok(1e6 * (long - short) / (many - few) as f64)
}

/// CPU seconds to learn the `k` pixels most similar to each pixel of an image at its own resolution.
pub fn learning(picture: &Array2<f32>, k: usize) -> Result<f64> {
    let exemplar = [Exemplar::grey(picture.view())?];
    let options = SolidOptions::default()
        .with_method(Method::ChenWang)
        .with_views(Views::Two)
        .with_levels(1)
        .with_similar(k);
    let (domain, begin) = (Domain::new([2; 3])?, cpu_seconds());
    // Progress is first reported when learning is complete.
    let stopped = synthesize_solid(&exemplar, &domain, &options, &|_| ControlFlow::Break(()));
    ensure!(stopped.is_err(), "learning was to be stopped");
    Ok(cpu_seconds() - begin)
}

/// Mean of a value over outcomes; NaN if one of them has none.
pub fn mean(outcomes: &[&Outcome], figure: impl Fn(&Comparison) -> Option<f64>) -> f64 {
    let sum: f64 = outcomes.iter().map(|o| figure(&o.found).unwrap_or(f64::NAN)).sum();
    sum / outcomes.len() as f64
}

/// A value divided by its ideal.
pub fn ratio(figure: Figure) -> Option<f64> {
    Some(figure.value? / figure.ideal?)
}

/// A table of all methods and scans on an image, means over `seeds`: solids of `size`³ voxels; the best method last.
pub fn table(name: &str, picture: &Array2<f32>, size: usize, seeds: u64, costs: bool) -> Result<String> {
    let mut cases = Vec::new();
    for (_, method) in METHODS {
        for (_, scan) in SCANS {
            cases.extend((0..seeds).map(|seed| Case {
                seed,
                ..Case::new(method, scan, size)
            }));
        }
    }
    cases.extend((0..seeds).map(|seed| Case {
        seed,
        ..Case::new(Method::Best, Scan::Hilbert, size)
    }));
    let outcomes = run(picture, &cases)?;
    let mut text = String::new();
    let number = |v: f64| if v.is_nan() { "-".to_owned() } else { format!("{v:.3}") };
    for of in outcomes.chunks_exact(seeds as usize) {
        let case = of[0].case;
        let all: Vec<&Outcome> = of.iter().collect();
        let method = METHODS.iter().find(|(_, m)| *m == case.method).map_or("best", |m| m.0);
        let scan = SCANS.iter().find(|(_, s)| *s == case.scan).map_or("", |s| s.0);
        let scan = if case.method == Method::Best { "batch" } else { scan };
        let cost = if costs && case.method != Method::Best {
            format!("{:.1}", cost(picture, case.method, case.scan)?)
        } else {
            String::new()
        };
        writeln!(
            text,
            "| {name} | {method} | {scan} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {cost} |",
            number(mean(&all, |f| f.kl_grey.value)),
            number(mean(&all, |f| f.std_ratio.value)),
            number(mean(&all, |f| Some(f.skewness.value? - f.skewness.ideal?))),
            number(mean(&all, |f| f.kl_orientation.value)),
            number(mean(&all, |f| ratio(f.coherence))),
            number(mean(&all, |f| f.gradient_ratio.value)),
            number(mean(&all, |f| ratio(f.fringe_length_by_ends))),
            number(mean(&all, |f| f.tortuosity.value)),
            number(mean(&all, |f| f.swd7.value)),
        )?;
    }
    let own = &outcomes[0].found;
    let said = |v: Option<f64>| v.map_or_else(|| "-".to_owned(), number);
    writeln!(
        text,
        "| {name} | floor | | {} | ± {} | ± {} | {} | ± {} | ± {} | ± {} | {} ± {} | {} | |",
        said(own.kl_grey.floor),
        said(own.std_ratio.floor),
        said(own.skewness.floor),
        said(own.kl_orientation.floor),
        said(own.coherence.floor.zip(own.coherence.ideal).map(|(f, i)| f / i)),
        said(own.gradient_ratio.floor),
        said(
            own.fringe_length_by_ends
                .floor
                .zip(own.fringe_length_by_ends.ideal)
                .map(|(f, i)| f / i)
        ),
        said(own.tortuosity.ideal),
        said(own.tortuosity.floor),
        said(own.swd7.floor),
    )?;
    Ok(text)
}

/// Head of the tables.
pub const HEAD: &str = "| picture | method | scan | KL grey | deviation | skewness off | KL orientation | coherence | gradient | fringe length | tortuosity | SWD 7 | µs |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
