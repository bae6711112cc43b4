//! The released program's reliefs on scanned meshes, and its gallery in a browser: tables for docs/microgeometry.md.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use image::{GrayImage, Luma};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::texture_table::replace_between;

const MARKS: [&str; 2] = [
    "<!-- reliefs measured by cargo xtask acceptance -->\n",
    "<!-- end of reliefs -->\n",
];

/// Meshes, and their scale units.
const MESHES: [(&str, &str); 6] = [
    ("nefertiti-lowres", "60"),
    ("goathead", "40"),
    ("fish", "50"),
    ("hammer", "80"),
    ("wingnut", "50"),
    ("demosthenes-low-res", "50"),
];

/// Candidates of the gallery.
const CANDIDATES: &str = "500";

/// Runs all cases and writes the tables into `page`.
pub fn run(program: &Path, data: &Path, results: &Path, page: &Path) -> Result<()> {
    ensure!(
        program.is_file(),
        "{}: build it first, cargo build --release",
        program.display()
    );
    fs::create_dir_all(results)?;
    let field = results.join("random_field.png");
    random_field().save(&field)?;
    let pictures = [
        ("gravel", data.join("exemplars/gravel_256.png")),
        ("sandstone", data.join("exemplars/binary_sandstone_256.png")),
        ("random field", field),
    ];
    let mut text = String::from(
        "| mesh | triangles | U | distribution | left over | in another bin | violations | EMD labels | EMD measured | paper: left over | paper: EMD measured | crossings | seconds |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, picture) in &pictures {
        let contact = results.join(format!("{}.json", name.replace(' ', "-")));
        answer(
            program,
            &[
                "contact".into(),
                picture.clone(),
                "-o".into(),
                contact.clone(),
                "--force".into(),
            ],
        )?;
        for (mesh, units) in MESHES {
            println!("{mesh} {name}");
            let of = |method: &str| {
                let output = results.join(format!("{mesh}-{}-{method}.ply", name.replace(' ', "-")));
                let path = data.join(format!("meshes/{mesh}.obj"));
                let words = [
                    "--units",
                    units,
                    "--method",
                    method,
                    "--colours",
                    "region",
                    "--force",
                    "--contact",
                ];
                let mut all: Vec<PathBuf> = vec!["displace".into(), path, "-o".into(), output];
                all.extend(words.map(PathBuf::from));
                all.push(contact.clone());
                answer(program, &all)
            };
            let (tight, paper) = (of("tight")?, of("paper")?);
            let number = |of: &Value, key: &str| of[key].as_f64().map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
            let share = |of: &Value, key: &str| {
                of[key]
                    .as_f64()
                    .map_or_else(|| "-".to_owned(), |v| format!("{:.2} %", 100.0 * v))
            };
            writeln!(
                text,
                "| {mesh} | {} | {units} | {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                tight["triangles"],
                share(&tight, "left_over_fraction"),
                share(&tight, "misplaced_fraction"),
                tight["violations"],
                number(&tight, "emd_labels"),
                number(&tight, "emd_measured"),
                share(&paper, "left_over_fraction"),
                number(&paper, "emd_measured"),
                tight["self_intersections"],
                tight["seconds"]
                    .as_f64()
                    .map_or_else(|| "-".to_owned(), |s| format!("{s:.2}")),
            )?;
        }
    }
    println!("gallery");
    let gallery = results.join("gallery");
    let words = ["--count", CANDIDATES, "--force", "-o"];
    let mut all: Vec<PathBuf> = vec!["explore".into(), data.join("meshes/goathead.obj")];
    all.extend(words.map(PathBuf::from));
    all.push(gallery.clone());
    let made = answer(program, &all)?;
    writeln!(
        text,
        "\nGallery of {} candidates on the goat's head ({} triangles): {:.0} s, labels {} bins off on average.",
        made["candidates"],
        made["triangles"],
        made["seconds"].as_f64().unwrap_or_default(),
        made["mean_emd_labels"]
            .as_f64()
            .map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"))
    )?;
    screenshot(&gallery.join("index.html"), &results.join("gallery.png"))?;
    replace_between(page, MARKS, &text)?;
    println!("{text}");
    Ok(())
}

/// Opens the gallery in chromium and keeps a screenshot for inspection.
fn screenshot(page: &Path, picture: &Path) -> Result<()> {
    let page = fs::canonicalize(page)?;
    let status = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--window-size=1400,900",
        ])
        .arg(format!("--screenshot={}", picture.display()))
        .arg(format!("file://{}#0042", page.display()))
        .output();
    match status {
        Ok(done) if picture.is_file() => {
            ensure!(done.status.success(), "chromium failed on {}", page.display());
            println!("look at {}", picture.display());
        }
        Ok(_) => anyhow::bail!("chromium made no picture of {}", page.display()),
        Err(error) => println!("no chromium here ({error}): open {} by hand", page.display()),
    }
    Ok(())
}

fn answer(program: &Path, words: &[PathBuf]) -> Result<Value> {
    let done = Command::new(program)
        .args(words)
        .arg("--json")
        .output()
        .with_context(|| format!("{} cannot be run", program.display()))?;
    ensure!(
        done.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
    Ok(serde_json::from_slice(&done.stdout)?)
}

/// A sum of waves of about 30 pixels in all directions, thresholded at zero.
fn random_field() -> GrayImage {
    let mut random = ChaCha8Rng::seed_from_u64(10);
    let waves: Vec<[f64; 3]> = (0..100)
        .map(|_| {
            let (turn, k) = (
                TAU * random.random::<f64>(),
                TAU / 30.0 * (0.6 + 0.8 * random.random::<f64>()),
            );
            [k * turn.cos(), k * turn.sin(), TAU * random.random::<f64>()]
        })
        .collect();
    GrayImage::from_fn(512, 512, |x, y| {
        let sum: f64 = waves
            .iter()
            .map(|[ky, kx, phase]| (ky * f64::from(y) + kx * f64::from(x) + phase).cos())
            .sum();
        Luma([if sum > 0.0 { 255 } else { 0 }])
    })
}
