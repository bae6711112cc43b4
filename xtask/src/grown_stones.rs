//! Acceptance of `grow` on meshes and of `measure` on volumes outside the project: tables for docs/grow.md and docs/measure.md.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use stereology::shape::read_mesh;

use crate::texture_table::replace_between;

const MARKS: [&str; 2] = [
    "<!-- measured by cargo xtask acceptance -->",
    "<!-- end of what was measured -->",
];

/// Grows stone in the meshes, with and without measurements on their vertices.
pub fn grow(program: &Path, data: &Path, results: &Path, page: &Path) -> Result<()> {
    fs::create_dir_all(results)?;
    let mut text = String::from(
        "\n| mesh | exemplar | resolution | measured | window | voxels inside | filled | changed | cells | µs a voxel |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (mesh, exemplar, resolution, window) in [
        ("spot", "gravel_256", 48, 5),
        ("spot", "gravel_256", 128, 5),
        ("armadillo", "gravel_256", 96, 5),
    ] {
        for measured in [0, 40] {
            let path = data.join(format!("meshes/{mesh}.obj"));
            let out = results.join(format!("{mesh}-{exemplar}-{resolution}-{window}-{measured}.npy"));
            let mut command = Command::new(program);
            command
                .arg("grow")
                .arg(&path)
                .arg(data.join(format!("exemplars/{exemplar}.png")));
            command.args(["--resolution", &resolution.to_string(), "--window", &window.to_string()]);
            command.args(["--json", "--force", "-o"]).arg(&out);
            let vertices = read_mesh(&path)?.vertices;
            if let Some(every) = vertices.len().checked_div(measured) {
                let table = results.join(format!("{mesh}-measured.csv"));
                let mut rows = String::from("x,y,z,value\n");
                for (i, v) in vertices.iter().step_by(every.max(1)).take(measured).enumerate() {
                    writeln!(rows, "{},{},{},{}", v.x, v.y, v.z, if i % 2 == 0 { 0 } else { 255 })?;
                }
                fs::write(&table, rows)?;
                command.arg("--measured").arg(&table);
            }
            let answer = answer(&mut command)?;
            ensure!(
                answer["filled"] == answer["voxels_inside"] && answer["fixed_changed"] == 0,
                "{mesh}: not filled, or a measurement changed: {answer}"
            );
            writeln!(
                text,
                "| {mesh} | {exemplar} | {resolution} | {measured} | {window} | {} | {} | {} | {} | {:.1} |",
                answer["voxels_inside"],
                answer["filled"],
                answer["fixed_changed"],
                answer["cells"],
                answer["microseconds_per_voxel"].as_f64().unwrap_or(f64::NAN)
            )?;
        }
    }
    println!("{text}");
    replace_between(page, MARKS, &text)
}

/// Measures the CT volume of sand: its slices beside one of its own slices, halves beside each other, and the binary of its labels.
pub fn measure(program: &Path, data: &Path, results: &Path, page: &Path) -> Result<()> {
    fs::create_dir_all(results)?;
    let mut text = String::from(
        "\n| exemplar | volume | slices | figure | value | ideal | floor |\n|---|---|---|---|---|---|---|\n",
    );
    let file = |name: &str| data.join(name);
    for (exemplar, volume, slices) in [
        ("images/sand_ct_slice50.png", "volumes/sand_100x200x200_u8.npy", "xy"),
        ("images/sand_ct_slice50.png", "volumes/sand_100x200x200_u8.npy", "xz,yz"),
        (
            "volumes/sand_100x200x200_u8.npy",
            "volumes/sand_100x200x200_labels_u16.tif",
            "xy",
        ),
        (
            "exemplars/fringe_synth_a_xz.png",
            "volumes/sand_100x200x200_u8.npy",
            "xz",
        ),
    ] {
        let mut command = Command::new(program);
        command
            .arg("measure")
            .arg(file(exemplar))
            .arg(file(volume))
            .args(["--slices", slices, "--json"]);
        command.args(["--at-most", "40"]);
        let answer = answer(&mut command)?;
        for figure in [
            "kl_grey",
            "std_ratio",
            "kl_orientation",
            "s2",
            "swd7",
            "swd16",
            "gradient_ratio",
        ] {
            let number = |key: &str| {
                answer[key]
                    .as_f64()
                    .map_or_else(|| "-".to_owned(), |v| format!("{v:.4}"))
            };
            writeln!(
                text,
                "| {exemplar} | {volume} | {slices} | {figure} | {} | {} | {} |",
                number(figure),
                number(&format!("{figure}_ideal")),
                number(&format!("{figure}_floor"))
            )?;
        }
    }
    println!("{text}");
    replace_between(page, MARKS, &text)
}

fn answer(command: &mut Command) -> Result<Value> {
    let output = command.output().with_context(|| format!("{command:?} cannot be run"))?;
    ensure!(
        output.status.success(),
        "{command:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(serde_json::from_slice(&output.stdout)?)
}
