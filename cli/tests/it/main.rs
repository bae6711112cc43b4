//! The program as people call it.

#![allow(clippy::unwrap_used)] // a test that cannot set itself up should stop there

mod bad_input;
mod chain;
mod contract;
mod exemplars;
mod nothing_lost;
mod packings;
mod reliefs;
mod schemas;
mod small_commands;
mod solid;
mod stones;
mod tables;
mod unfolding;

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Exit code, standard output, standard error.
fn stereology(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("stereology")
        .unwrap()
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The JSON answer of a command that must be done.
fn answer(arguments: &[&str]) -> Value {
    let (code, out, error) = stereology(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {error}");
    assert_eq!(error, "", "nothing on standard error if it is no terminal");
    assert!(
        out.starts_with(&format!(
            "{{\"schema\":\"stereology.{}/1\",\"warnings\":[",
            arguments[0]
        )),
        "{out}"
    );
    serde_json::from_str(&out).unwrap()
}

/// The file's path as an argument.
fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

/// A photograph of dark discs of two sizes on a light, grained ground.
fn write_discs(file: impl AsRef<Path>) {
    let picture = image::RgbImage::from_fn(260, 200, |x, y| {
        let (u, v) = (f64::from(x % 26) - 13.0, f64::from(y % 25) - 12.5);
        let large = (x / 26 + y / 25) % 3 == 0;
        let grain = ((x * 7919 + y * 104_729) % 13) as u8;
        let inside = u.hypot(v) < if large { 10.0 } else { 6.5 };
        image::Rgb(match (inside, large) {
            (true, true) => [60 + grain, 50 + grain, 40],
            (true, false) => [40, 60 + grain, 90 + grain],
            (false, _) => [190 + grain, 188 + grain, 180 + grain],
        })
    });
    picture.save(file).unwrap();
}
