//! Files of every format that we write, opened by the programs that people read them with.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::workspace::root;

/// The Python program that opens the files.
const SCRIPT: &str = include_str!("readers.py");
/// What it imports; the packages that provide it are in readers.txt.
const MODULES: [&str; 8] = ["numpy", "h5py", "zarr", "tifffile", "nrrd", "vtk", "damask", "ovito"];

/// Writes files of every format and checks them with readers that are not ours.
///
/// With `python` every reader must be installed there. Without it the readers are installed by pip into an environment
/// under target/; where that is impossible the check is skipped, which is reported.
///
/// # Errors
///
/// If a file cannot be written, or a reader refuses one or finds other contents.
pub fn run(python: Option<&Path>) -> Result<()> {
    let folder = root()?.join("target/readers");
    let python = match python {
        Some(python) => python.to_owned(),
        None => match installed(&folder.join("venv")) {
            Ok(python) => python,
            Err(reason) => {
                println!("readers: skipped, as the readers cannot be installed: {reason:#}");
                return Ok(());
            }
        },
    };
    let files = folder.join("files");
    if files.exists() {
        std::fs::remove_dir_all(&files)?;
    }
    std::fs::create_dir_all(&files)?;
    write(&files)?;
    succeed(Command::new(&python).args(["-c", SCRIPT]).arg(&files).arg("--all"))
        .context("a reader does not get what was written")
}

/// Python of an environment that has all readers, installed there if need be.
fn installed(environment: &Path) -> Result<PathBuf> {
    let python = environment.join("bin/python");
    let has_all = || {
        let import = format!("import {}", MODULES.join(", "));
        succeed(Command::new(&python).args(["-c", &import])).is_ok()
    };
    if !has_all() {
        println!("readers: installing them into {}", environment.display());
        succeed(Command::new("python3").args(["-m", "venv"]).arg(environment))?;
        succeed(
            Command::new(&python)
                .args([
                    "-m",
                    "pip",
                    "install",
                    "--quiet",
                    "--retries",
                    "1",
                    "--timeout",
                    "15",
                    "-r",
                ])
                .arg(root()?.join("xtask/src/readers.txt")),
        )?;
        ensure!(has_all(), "they are installed and cannot be imported");
    }
    Ok(python)
}

/// Fills a folder with files of every format.
fn write(folder: &Path) -> Result<()> {
    let root = root()?;
    // With the whole workspace selected, what the tests built is used again.
    let arguments = [
        "build",
        "--locked",
        "--quiet",
        "--workspace",
        "--bin",
        "stereology",
        "--example",
        "ramp",
    ];
    succeed(Command::new("cargo").args(arguments).current_dir(root))?;
    let target = root.join("target/debug");
    succeed(Command::new(target.join("examples/ramp")).arg(folder))?;
    let stereology = |line: &str| {
        let arguments = line.split_whitespace();
        succeed(
            Command::new(target.join("stereology"))
                .args(arguments)
                .current_dir(folder),
        )
    };
    for mesh in ["box.ply", "box.obj", "box.stl"] {
        stereology(&format!("shape box:1,2,3 -o {mesh}"))?;
    }
    stereology(
        "pack --constant --count 40 --fraction 0.2 --shape ellipsoid:1,1,0.6 -o packing.json --also packing.csv \
         --also packing.xyz --also packing.vtp --surfaces surfaces.vtp",
    )?;
    stereology("synthesize -o solid --count 150 --texture-voxels 32 --voxels 24 --bins 5 --iterations 2")?;
    for carved in ["carved.ply", "carved.glb"] {
        stereology(&format!("carve solid box.ply --triangles 2000 -o {carved}"))?;
    }
    stereology("carve solid box.ply --atlas 64 -o atlas.glb")
}

/// Runs a command; its output is shown if it fails.
fn succeed(command: &mut Command) -> Result<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    let done = command.output().with_context(|| format!("{name} cannot be run"))?;
    print!("{}", String::from_utf8_lossy(&done.stdout));
    ensure!(
        done.status.success(),
        "{name}: {}",
        String::from_utf8_lossy(&done.stderr).trim_end()
    );
    Ok(())
}
