//! The released program on real photographs and on synthetic test images with known true values: docs/acceptance.md.
//!
//! The photographs are not part of the project; only the results are kept.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use stereology::metrics::label_scores;
use stereology::segment::read_labels;
use stereology::shape::{Body, UnitBody};

struct Case {
    /// File in the folder of images.
    photo: &'static str,
    /// Label map to import, if there is one.
    labels: Option<&'static str>,
    shape: &'static str,
    /// Further options.
    options: &'static [&'static str],
    /// File of true values in the same folder.
    truth: Option<&'static str>,
}

const fn case(photo: &'static str, shape: &'static str) -> Case {
    Case {
        photo,
        labels: None,
        shape,
        options: &[],
        truth: None,
    }
}

const CASES: [Case; 7] = [
    case("terrazzo009_cc0.jpg", "rock:1"),
    Case {
        truth: Some("synth_easy_101_truth.json"),
        ..case("synth_easy_101.jpg", "sphere")
    },
    Case {
        truth: Some("synth_medium_102_truth.json"),
        ..case("synth_medium_102.jpg", "ellipsoid:1,0.8,0.65")
    },
    Case {
        truth: Some("synth_hard_103_truth.json"),
        ..case("synth_hard_103.jpg", "rock:1")
    },
    case("coins.png", "sphere"),
    Case {
        labels: Some("conglomerate_1_P1060330_1_labels.png"),
        ..case("conglomerate_1_P1060330_1.jpg", "rock:1")
    },
    case("sandstone_thin_section_miocene.jpg", "rock:1"),
];

/// Images that are only segmented; those with a label map in the same folder are scored.
const SEGMENTED: [&str; 14] = [
    "synth_easy_101.jpg",
    "synth_medium_102.jpg",
    "synth_hard_103.jpg",
    "coins.png",
    "sand_ct_slice50.png",
    "terrazzo009_cc0.jpg",
    "exposed_aggregate_concrete018_cc0.jpg",
    "sandstone_thin_section_miocene.jpg",
    "conglomerate_1_P1060330_1.jpg",
    "conglomerate_2_P1060338_0.jpg",
    "conglomerate_5_P1060351_2.jpg",
    "gravel04_cc0.png",
    "dark_stone_rock035_cc0_negative.jpg",
    "pebbles_torrey_pines.jpg",
];

/// Segments every image with `program` and scores it against its label map, if it has one.
fn segmentation(program: &Path, images: &Path, results: &Path) -> Result<String> {
    let mut text = String::from(
        "\nSegmentation against label maps (average precision at overlaps of 1/2 and 3/4, area and count relative to the truth, Kolmogorov-Smirnov distance of sizes; profiles of at least 20 pixels). \
         The conglomerates, gravel, pebbles and the dark stone have no binder that colour distinguishes: they must be refused or give warnings.\n\n\
         | image | profiles | area fraction | AP50 | AP75 | area error | count error | KS | warnings |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for photo in SEGMENTED {
        let stem = photo.split('.').next().unwrap_or(photo);
        let out = results.join(format!("segment_{stem}"));
        let answer = Command::new(program)
            .arg("segment")
            .arg(images.join(photo))
            .arg("-o")
            .arg(&out)
            .args(["--force", "--json", "--min-area", "20"])
            .output()
            .with_context(|| format!("{} cannot be run", program.display()))?;
        if !answer.status.success() {
            writeln!(
                text,
                "| {photo} | refused: no particles distinguishable from a binder | | | | | | | |"
            )?;
            continue;
        }
        let answer: Value = serde_json::from_slice(&answer.stdout)?;
        let truth = images.join(format!("{stem}_labels.png"));
        let scores = if truth.is_file() {
            let s = label_scores(read_labels(&truth)?.view(), read_labels(out.join("labels.tif"))?.view())?;
            let percent = |v: f64| format!("{:+.1} %", 100.0 * v);
            format!(
                "{:.3} | {:.3} | {} | {} | {:.3}",
                s.ap50,
                s.ap75,
                percent(s.area),
                percent(s.count),
                s.sizes
            )
        } else {
            " | | | | ".to_owned()
        };
        let warnings = answer["warnings"].as_array().into_iter().flatten();
        let warnings: Vec<&str> = warnings.filter_map(|w| w["code"].as_str()).collect();
        writeln!(
            text,
            "| {photo} | {} | {} | {scores} | {} |",
            answer["profiles"]
                .as_array()
                .map_or_else(|| answer["profiles"].to_string(), |p| p.len().to_string()),
            number(&answer["area_fraction"]),
            warnings.join(", ")
        )?;
    }
    Ok(text)
}

const STEPS: [&str; 5] = ["segment", "unfold", "pack", "texture", "verify"];

/// Runs every case with `program`, writes the solids to `results` and the tables to the page `table`.
pub fn run(program: &Path, data: &Path, results: &Path, table: &Path) -> Result<()> {
    if !program.is_file() {
        bail!(
            "{}: does not exist; build it with cargo build --release",
            program.display()
        );
    }
    fs::create_dir_all(results)?;
    let images = data.join("images");
    let mut text = String::from(
        "# Acceptance\n\nWritten by `cargo xtask acceptance --data FOLDER` with the released program, on photographs and synthetic test images (`synth_*`); the images are not part of the project.\n\n\
         | image | shape | profiles | area fraction, image | area fraction, solid | size W1, exact profiles | size W1, segmented again | colour difference | warnings |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut times = String::from(
        "\nSeconds per step, two cores:\n\n| image | segment | unfold | pack | texture | verify | particles |\n|---|---|---|---|---|---|---|\n",
    );
    let mut truths = String::from(
        "\nSynthetic test images against their true values (sizes as equal-volume diameters, converted by the ratio of the assumed shape):\n\n| image | density / true | mean size / true | volume fraction / true |\n|---|---|---|---|\n",
    );
    for case in &CASES {
        println!("{}", case.photo);
        let out = results.join(case.photo.split('.').next().unwrap_or(case.photo));
        let mut command = Command::new(program);
        command
            .arg("synthesize")
            .arg(images.join(case.photo))
            .arg("-o")
            .arg(&out)
            .args(["--force", "--json", "--shape", case.shape])
            .args(case.options);
        if let Some(labels) = case.labels {
            command.arg("--labels").arg(images.join(labels));
        }
        let answer = command
            .output()
            .with_context(|| format!("{} cannot be run", program.display()))?;
        if !answer.status.success() {
            let why = String::from_utf8_lossy(&answer.stderr).trim().replace('\n', " ");
            writeln!(text, "| {} | {} | refused: {why} | | | | | | |", case.photo, case.shape)?;
            continue;
        }
        let answer: Value = serde_json::from_slice(&answer.stdout)?;
        let compared = &answer["verification"];
        let warnings: Vec<&str> = answer["warnings"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|w| w["code"].as_str())
            .collect();
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            case.photo,
            case.shape,
            compared["profiles_photo"],
            number(&compared["area_fraction_photo"]),
            number(&compared["area_fraction_synthetic"]),
            number(&compared["size_w1"]),
            number(&compared["resegmented"]["size_w1"]),
            number(&compared["colour_distance"]),
            warnings.join(", ")
        )?;
        let seconds: Vec<String> = STEPS
            .iter()
            .map(|step| {
                answer["seconds"][step]
                    .as_f64()
                    .map_or("-".into(), |s| format!("{s:.1}"))
            })
            .collect();
        writeln!(
            times,
            "| {} | {} | {} |",
            case.photo,
            seconds.join(" | "),
            answer["pack"]["particles"]
        )?;
        if let Some(truth) = case.truth {
            let truth: BTreeMap<String, Value> = serde_json::from_slice(&fs::read(images.join(truth))?)?;
            // The size of a particle is that of its largest section; the true sizes are equal-volume diameters.
            let ratio = (6.0 * UnitBody::new(&Body::parse(case.shape)?).volume() / std::f64::consts::PI).cbrt();
            let over = |found: &Value, truth: &Value, factor: f64| match (found.as_f64(), truth.as_f64()) {
                (Some(found), Some(truth)) => format!("{:.3}", factor * found / truth),
                _ => "-".to_owned(),
            };
            writeln!(
                truths,
                "| {} | {} | {} | {} |",
                case.photo,
                over(&answer["unfold"]["total"], &truth["NV_per_px3"], 1.0),
                over(&answer["unfold"]["mean_size"], &truth["d_eq_mean"], ratio),
                over(&answer["unfold"]["volume_fraction"], &truth["VV"], 1.0)
            )?;
        }
    }
    text.push_str(&truths);
    text.push_str(&crate::sand::compare(data)?);
    text.push_str(&segmentation(program, &images, results)?);
    text.push_str(&times);
    fs::write(table, &text)?;
    println!("{text}");
    Ok(())
}

fn number(value: &Value) -> String {
    value.as_f64().map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"))
}
