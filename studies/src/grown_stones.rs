//! Acceptance of `grow` on meshes and of `measure` on volumes outside the project: tables for docs/grow.md and
//! docs/measure.md.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use stereology::shape::read_mesh;

use crate::exemplar_solids::timed;
use crate::texture_table::replace_between;

const MARKS: [&str; 2] = [
    "<!-- measured by cargo xtask acceptance -->",
    "<!-- end of what was measured -->",
];

/// Grows stone in the meshes, with and without measurements on their vertices.
pub fn grow(program: &Path, data: &Path, results: &Path, page: &Path) -> Result<()> {
    fs::create_dir_all(results)?;
    let mut text = String::from(
        "\n| mesh | exemplar | resolution | measured | window | voxels inside | filled | changed | cells | CPU µs a voxel |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (mesh, exemplar, resolution, window) in [
        ("spot", "gravel_256", 48, 5),
        ("spot", "gravel_256", 128, 5),
        ("spot", "binary_carbonate_256", 96, 7),
        ("armadillo", "gravel_256", 96, 5),
        ("armadillo", "gravel_256", 128, 5),
        ("armadillo", "gravel_256", 128, 11),
    ] {
        for measured in [0, 40] {
            let path = data.join(format!("meshes/{mesh}.obj"));
            let out = results.join(format!("{mesh}-{exemplar}-{resolution}-{window}-{measured}.npy"));
            let (file, out) = (path.display().to_string(), out.display().to_string());
            let picture = data.join(format!("exemplars/{exemplar}.png")).display().to_string();
            let (side, across) = (resolution.to_string(), window.to_string());
            let csv = results.join(format!("{mesh}-measured.csv")).display().to_string();
            let mut arguments = vec!["grow", &file, &picture, "--resolution", &side, "--window", &across];
            arguments.extend(["--json", "--force", "-o", &out]);
            let vertices = read_mesh(&path)?.vertices;
            if let Some(every) = vertices.len().checked_div(measured) {
                let mut rows = String::from("x,y,z,value\n");
                for (i, v) in vertices.iter().step_by(every.max(1)).take(measured).enumerate() {
                    writeln!(rows, "{},{},{},{}", v.x, v.y, v.z, if i % 2 == 0 { 0 } else { 255 })?;
                }
                fs::write(&csv, rows)?;
                arguments.extend(["--measured", &csv]);
            }
            let (answer, seconds, _) = timed(program, &arguments)?;
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
                1e6 * seconds / answer["filled"].as_f64().unwrap_or(f64::NAN)
            )?;
        }
    }
    text.push_str(&finishing(program, data, results)?);
    println!("{text}");
    replace_between(page, MARKS, &text)
}

/// Blocks of stone with and without a finishing pass: seams, similarity, and preservation of the measurements.
fn finishing(program: &Path, data: &Path, results: &Path) -> Result<String> {
    let mut text = String::from(
        "\n| block of 64³ | window | finish | steps across seams / inside | SWD 7 (floor) | SWD 16 (floor) | gradient | KL grey | changed | CPU µs a voxel |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let csv = results.join("block-measured.csv").display().to_string();
    let mut rows = String::from("x,y,z,value\n");
    for i in 0..30_u32 {
        writeln!(
            rows,
            "{},{},{},{}",
            i * 37 % 64,
            i * 23 % 64,
            i * 11 % 64,
            if i % 2 == 0 { 0 } else { 255 }
        )?;
    }
    fs::write(&csv, rows)?;
    for (exemplar, window) in [("gravel_256", "5"), ("gravel_256", "11"), ("binary_sandstone_256", "5")] {
        let picture = data.join(format!("exemplars/{exemplar}.png")).display().to_string();
        for finish in ["0", "10"] {
            let out = results
                .join(format!("block-{exemplar}-{window}-{finish}.npy"))
                .display()
                .to_string();
            let arguments = [
                "grow",
                "box:1,1,1",
                &picture,
                "--resolution",
                "64",
                "--window",
                window,
                "--measured",
                &csv,
                "--measured-in",
                "voxels",
                "--finish",
                finish,
                "-o",
                &out,
                "--force",
                "--json",
            ];
            let (made, seconds, _) = timed(program, &arguments)?;
            ensure!(made["fixed_changed"] == 0, "{exemplar}: a measurement changed");
            let (found, ..) = timed(program, &["measure", &picture, &out, "--at-most", "32", "--json"])?;
            let number = |value: &Value| value.as_f64().map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
            writeln!(
                text,
                "| {exemplar} | {window} | {finish} | {} | {} ({}) | {} ({}) | {} | {} | {} | {:.1} |",
                number(&made["seams"]),
                number(&found["swd7"]),
                number(&found["swd7_floor"]),
                number(&found["swd16"]),
                number(&found["swd16_floor"]),
                number(&found["gradient_ratio"]),
                number(&found["kl_grey"]),
                made["fixed_changed"],
                1e6 * seconds / made["filled"].as_f64().unwrap_or(f64::NAN)
            )?;
        }
    }
    Ok(text)
}

/// Measures the CT volume of sand: its slices against one of them, its halves against each other, and the binary of its
/// labels.
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
