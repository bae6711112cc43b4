//! Acceptance of `exemplar` on images outside the project: similarity, speed and the study of urs-2012, for
//! docs/exemplar.md.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use ndarray::Array2;
use serde_json::Value;

use crate::laminar_study::{HEAD, band_passed, table};
use crate::texture_table::replace_between;

/// A command's JSON result, its CPU seconds and its peak memory in MB, by GNU time.
pub fn timed(program: &Path, arguments: &[&str]) -> Result<(Value, f64, f64)> {
    let output = Command::new("/usr/bin/time")
        .args(["-f", "%U %S %M"])
        .arg(program)
        .args(arguments)
        .output()
        .context("/usr/bin/time cannot be run: install GNU time")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{arguments:?}: {said}");
    let last: Vec<f64> = said
        .lines()
        .last()
        .unwrap_or_default()
        .split(' ')
        .filter_map(|n| n.parse().ok())
        .collect();
    ensure!(last.len() == 3, "{said}");
    Ok((
        serde_json::from_slice(&output.stdout)?,
        last[0] + last[1],
        last[2] / 1024.0,
    ))
}

/// Compares solids of the best method with their exemplars, and measures its speed.
pub fn solids(program: &Path, data: &Path, results: &Path, page: &Path) -> Result<()> {
    fs::create_dir_all(results)?;
    let mut text = String::from(
        "\n| pictures | voxels | SWD 7 | SWD 16 | KL grey | KL orientation | deviation | gradient | perplexity | phase off | CPU s | µs | MB |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (names, size, views) in [
        (&["gravel_256"][..], 64, "3"),
        (&["binary_sandstone_256"], 64, "3"),
        (&["binary_carbonate_256"], 64, "3"),
        (&["fringe_synth_a_xz", "fringe_synth_a_yz"], 64, "2"),
        (&["hrtem_soot_a_128"], 64, "2"),
        (&["wood_rosewood_256"], 64, "2"),
        (&["hrtem_soot_a_128"], 128, "2"),
        (&["hrtem_soot_a_128"], 128, "3"),
    ] {
        let files: Vec<String> = names
            .iter()
            .map(|name| data.join(format!("exemplars/{name}.png")).display().to_string())
            .collect();
        let solid = results
            .join(format!("exemplar-{}-{size}-{views}.npy", names[0]))
            .display()
            .to_string();
        let side = size.to_string();
        let mut arguments = vec!["exemplar"];
        arguments.extend(files.iter().map(String::as_str));
        arguments.extend(["--size", &side, "--views", views, "-o", &solid, "--force", "--json"]);
        let (made, seconds, memory) = timed(program, &arguments)?;
        let slices = if views == "2" { "xz,yz" } else { "xz,yz,xy" };
        let judge = [
            "measure",
            &files[0],
            &solid,
            "--slices",
            slices,
            "--at-most",
            "48",
            "--json",
        ];
        let (found, ..) = timed(program, &judge)?;
        let number = |key: &str| {
            found[key]
                .as_f64()
                .map_or_else(|| "-".to_owned(), |v| format!("{v:.4}"))
        };
        let floored = |key: &str| format!("{} ({})", number(key), number(&format!("{key}_floor")));
        // The mean of a phase map is its phase fraction.
        let off = if made["phases"] == true {
            let values = stereology::grid::read_npy::<u8>(&solid)?;
            let share = values.iter().filter(|v| **v > 127).count() as f64 / values.len() as f64;
            let picture = image::open(&files[0])?.into_luma8();
            let own =
                picture.pixels().filter(|p| p[0] > 127).count() as f64 / f64::from(picture.width() * picture.height());
            format!("{:.5}", (share - own).abs())
        } else {
            String::new()
        };
        let each = 1e6 * seconds / made["voxel_iterations"].as_f64().unwrap_or(f64::NAN);
        writeln!(
            text,
            "| {}, {views} views | {size}³ | {} | {} | {} | {} | {} | {} | {:.2} | {off} | {seconds:.1} | {each:.2} | {memory:.0} |",
            names.join(", "),
            floored("swd7"),
            floored("swd16"),
            number("kl_grey"),
            number("kl_orientation"),
            number("std_ratio"),
            number("gradient_ratio"),
            made["perplexity"].as_f64().unwrap_or(f64::NAN),
        )?;
        println!("{}", text.lines().last().unwrap_or_default());
    }
    text.push('\n');
    let marks = [
        "<!-- measured by cargo xtask acceptance: solids -->",
        "<!-- end of solids -->",
    ];
    replace_between(page, marks, &text)
}

/// The study of urs-2012 on images outside the project, raw and band-passed, 128³ as in the paper, one seed.
pub fn laminar(data: &Path, page: &Path) -> Result<()> {
    let mut text = format!("\n{HEAD}");
    for name in ["fringe_synth_a_xz", "hrtem_soot_a_128"] {
        let file = data.join(format!("exemplars/{name}.png"));
        let picture = image::open(&file)
            .with_context(|| file.display().to_string())?
            .into_luma8();
        let raw = Array2::from_shape_fn((picture.height() as usize, picture.width() as usize), |(y, x)| {
            f32::from(picture.get_pixel(x as u32, y as u32)[0]) / 255.0
        });
        text.push_str(&table(name, &raw, 128, 1, false)?);
        text.push_str(&table(
            &format!("{name}, band-passed"),
            &band_passed(&raw)?,
            128,
            1,
            false,
        )?);
    }
    println!("{text}");
    text.push('\n');
    let marks = [
        "<!-- measured by cargo xtask acceptance: laminar -->",
        "<!-- end of laminar -->",
    ];
    replace_between(page, marks, &text)
}
