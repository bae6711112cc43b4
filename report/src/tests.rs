//! The report of a made-up result.

use image::{Rgb, RgbImage};
use stereology::metrics::Finding;
use stereology::pipeline::{
    Comparison, Evidence, Level, OutlineComparison, OutlineDistance, ResidualSpectra, ShapeDensity, ShapeEstimates,
    Verdict,
};
use stereology::unfold::{Estimate, Interval};

use super::{
    CategoryFigures, ComparisonFigures, PackingFigures, PhotoFigures, Remark, SectionFigures, SizeFigures,
    SynthesisReport, synthesis_page,
};

/// Discs on a binder.
fn picture(width: u32, height: u32, shift: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let (u, v) = ((x + 3 * shift) % 48, (y + 7 * shift) % 40);
        let near = (f64::from(u) - 24.0).hypot(f64::from(v) - 20.0);
        let grain = ((x * 7919 + y * 104_729) % 23) as u8;
        if near < 14.0 {
            Rgb([170 + grain, 120 + grain, 90])
        } else {
            Rgb([90 + grain, 92 + grain, 96 + grain])
        }
    })
}

fn outlines() -> OutlineComparison {
    let distance = |photo: f64| OutlineDistance {
        photo,
        synthetic: photo + 0.01,
        distance: 0.012,
        expected: 0.01,
    };
    OutlineComparison {
        profiles_photo: 300,
        profiles_synthetic: 900,
        axis_ratio: distance(0.71),
        solidity: distance(0.95),
    }
}

fn made_up_verdict(findings: &[Finding]) -> Verdict {
    let exact = Comparison {
        profiles_photo: 335,
        profiles_synthetic: 5200,
        size_w1: 0.046,
        area_fraction_photo: 0.41,
        area_fraction_synthetic: 0.405,
        colour_distance: 0.011,
    };
    Verdict::new(&Evidence {
        findings: findings.to_vec(),
        profiles: 335,
        deviance: 8.1,
        degrees_of_freedom: 7,
        total: Estimate {
            value: 2.4e-4,
            interval: Some(Interval {
                lower: 2.1e-4,
                upper: 2.8e-4,
            }),
        },
        volume_fraction: 0.43,
        area_fraction: 0.41,
        smallest_gap: 2e-4,
        exact,
        resegmented: Some(Comparison { size_w1: 0.12, ..exact }),
        outlines: Some(outlines()),
        texture_error: Some(0.08),
    })
}

fn made_up() -> SynthesisReport {
    let warnings = vec![Finding::new(
        "near-minimum",
        "14 % of the profiles are below twice the smallest area (30 px)",
    )];
    let edges: Vec<f64> = (0..=10).map(|i| 4.0 * f64::from(i)).collect();
    let observed = vec![12.0, 40.0, 66.0, 71.0, 58.0, 44.0, 25.0, 12.0, 5.0, 2.0];
    let exact = SectionFigures {
        profiles: 5200,
        size_w1: 0.046,
        area_fraction_photo: 0.41,
        area_fraction_synthetic: 0.405,
        colour_distance: 0.011,
    };
    SynthesisReport {
        photo_name: "a <made-up> photograph.png".to_owned(),
        unit: "px".to_owned(),
        command: "stereology synthesize photograph.png -o out --shape rock:1".to_owned(),
        parameters: vec![
            ("--bins".to_owned(), "10".to_owned()),
            ("--seed".to_owned(), "0".to_owned()),
        ],
        verdict: made_up_verdict(&warnings),
        remarks: warnings
            .iter()
            .map(|of| Remark {
                code: of.code.to_owned(),
                message: of.message.clone(),
                advice: None,
            })
            .collect(),
        photo: PhotoFigures {
            picture: picture(480, 320, 0),
            overlay: picture(480, 320, 0),
            profiles: 335,
            profiles_found: 371,
            area_fraction: 0.41,
            number_per_area: 0.00218,
            categories: vec![
                CategoryFigures {
                    colour: [0.7, 0.5, 0.35],
                    profiles: 210,
                    mean_size: 14.2,
                },
                CategoryFigures {
                    colour: [0.3, 0.32, 0.4],
                    profiles: 125,
                    mean_size: 19.9,
                },
            ],
            binder: [0.4, 0.4, 0.42],
        },
        sizes: SizeFigures {
            profile_edges: edges.clone(),
            refolded: observed.iter().map(|n| 0.95 * n + 1.0).collect(),
            observed: observed.clone(),
            particle_edges: edges,
            number_density: [
                None,
                Some(3e-5),
                Some(5e-5),
                Some(5.5e-5),
                Some(4e-5),
                Some(3e-5),
                Some(2e-5),
                Some(1e-5),
                Some(4e-6),
                Some(1e-6),
            ]
            .to_vec(),
            interval: Some(
                (0..10)
                    .map(|i| (1e-6 * f64::from(i), 7e-5 - 5e-6 * f64::from(i)))
                    .collect(),
            ),
            packed: vec![0.0, 2.9e-5, 5e-5, 5.4e-5, 4e-5, 3e-5, 2e-5, 1e-5, 4e-6, 1e-6],
            total: 2.4e-4,
            total_interval: Some((2.1e-4, 2.8e-4)),
            mean_size: 15.3,
            volume_fraction: 0.43,
            shapes: vec![("rock:1".to_owned(), 0.7), ("sphere".to_owned(), 0.3)],
            by_shape: vec![
                ShapeDensity {
                    shape: "sphere".to_owned(),
                    estimates: Some(ShapeEstimates {
                        total: 3.6e-4,
                        mean_size: 13.1,
                        volume_fraction: 0.42,
                        p_value: Some(0.31),
                    }),
                },
                ShapeDensity {
                    shape: "box:1,1,1".to_owned(),
                    estimates: None,
                },
            ],
            method: "em, integrated kernel".to_owned(),
            deviance: 8.1,
            degrees_of_freedom: 7.0,
            condition_number: 14.2,
            clamped_bins: 0,
        },
        packing: PackingFigures {
            particles: 5012,
            sides: [256.0; 3],
            fraction: 0.41,
            requested_fraction: 0.41,
            iterations: 214,
            cube: picture(300, 300, 5),
        },
        comparison: ComparisonFigures {
            sections: vec![picture(480, 320, 1), picture(480, 320, 2)],
            exact,
            resegmented: Some(SectionFigures { size_w1: 0.12, ..exact }),
            outlines: Some(outlines()),
            profiles_synthetic: observed.iter().map(|n| 1.03 * n).collect(),
            spectrum: Some(ResidualSpectra {
                frequency: (1..=32).map(|i| f64::from(i) / 64.0).collect(),
                photo: (1..=32).map(|i| 1.0 / f64::from(i * i)).collect(),
                sections: (1..=32).map(|i| 1.2 / f64::from(i * i)).collect(),
            }),
        },
    }
}

fn page(report: &SynthesisReport) -> String {
    synthesis_page(report).unwrap()
}

#[test]
fn a_page_stands_alone() {
    let html = page(&made_up());
    if let Ok(path) = std::env::var("REPORT_SAMPLE") {
        std::fs::write(path, &html).unwrap(); // to look at it
    }
    // The text alone: base64 may spell anything.
    let text: String = html
        .split("data:image/")
        .map(|part| part.split_once('"').map_or(part, |(_, rest)| rest))
        .collect();
    for forbidden in ["<script", "http://localhost", "src=\"/", "href=", "<made-up>", "NaN"] {
        assert!(!text.contains(forbidden), "{forbidden}");
    }
    for needed in [
        "data:image/png;base64,",
        "data:image/jpeg;base64,",
        "near-minimum",
        "--seed",
        "rock:1",
        "335",
        "Where the result is weak",
    ] {
        assert!(html.contains(needed), "{needed}");
    }
    assert_eq!(html.matches("<svg").count(), 3);
    assert_eq!(html, page(&made_up()));
}

/// The page shows the level of the verdict, and where it is weak.
#[test]
fn the_page_shows_the_verdict() {
    let mut input = made_up();
    assert_eq!(input.verdict.level(), Level::Care); // a warning about small profiles
    let html = page(&input);
    assert!(html.contains("Trustworthy with care") && html.contains("Numbers: with care"));
    assert!(html.contains("Worst of 11 checks: Outlines of the profiles") && html.contains("Appearance: good"));
    // The reported 2.4e-4 are two thirds of what spheres would be.
    assert!(html.contains("Ratio to the reported number") && html.contains("1.50"));
    assert!(html.contains("smallest gap 2.00e-4 of the mean size"));
    input.verdict = made_up_verdict(&[]);
    let html = page(&input);
    assert!(
        html.contains("All 14 checks are good")
            && html.contains("Numbers: good")
            && html.contains("All 3 checks are good. The nearest to its limit: ")
    );
}

#[test]
fn nothing_found_is_still_a_page() {
    let mut input = made_up();
    input.sizes.observed = vec![0.0; 10];
    input.sizes.refolded = vec![0.0; 10];
    input.sizes.number_density = vec![None; 10];
    input.sizes.packed = vec![0.0; 10];
    input.sizes.interval = None;
    input.comparison.profiles_synthetic = Vec::new();
    input.comparison.spectrum = Some(ResidualSpectra {
        frequency: vec![0.1],
        photo: vec![0.0],
        sections: vec![0.0],
    });
    input.comparison.resegmented = None;
    let html = page(&input);
    assert!(html.ends_with("</html>\n") && !html.contains("could not be drawn"));
}
