//! The released program on real photographs and on drawn ones whose truth is known: a table for docs/acceptance.md.
//!
//! The photographs stay outside the project; only this table of what was measured on them is kept.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use stereology::shape::{Body, UnitBody};

struct Case {
    /// File in the folder of images.
    photo: &'static str,
    /// Label map to import, if any.
    labels: Option<&'static str>,
    shape: &'static str,
    /// Further options.
    options: &'static [&'static str],
    /// Truth beside it.
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

const STEPS: [&str; 5] = ["segment", "unfold", "pack", "texture", "verify"];

/// Runs every case with `program`, its results into `results`, and writes the table to `table`.
pub fn run(program: &Path, data: &Path, results: &Path, table: &Path) -> Result<()> {
    if !program.is_file() {
        bail!("{}: build it first, cargo build --release", program.display());
    }
    fs::create_dir_all(results)?;
    let images = data.join("images");
    let mut text = String::from(
        "# Acceptance on photographs\n\nMade by `cargo xtask acceptance --data FOLDER` with the released program; the photographs are not part of the project.\n\n\
         | photograph | shape | profiles | area photo | area solid | size W1 exact | size W1 again | colour | warnings |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut times = String::from(
        "\nSeconds by step, two cores:\n\n| photograph | segment | unfold | pack | texture | verify | particles |\n|---|---|---|---|---|---|---|\n",
    );
    let mut truths = String::from(
        "\nDrawn photographs against their truth (sizes as equal-volume diameters, converted by the assumed shape's ratio):\n\n| photograph | density / true | mean size / true | volume fraction / true |\n|---|---|---|---|\n",
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
            // The size of a body is that of its largest section; equal volume is another diameter.
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
    text.push_str(&times);
    fs::write(table, &text)?;
    println!("{text}");
    Ok(())
}

fn number(value: &Value) -> String {
    value.as_f64().map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"))
}
