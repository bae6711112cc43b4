//! `stereology pack`: every mode, shapes that are not convex, and all that can be written of a packing.

use std::fs;

use crate::{answer, path, stereology};

/// A U of three bars, as faces of four corners.
const HOOK: &str = "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\n\
v 0 0 1\nv 3 0 1\nv 3 3 1\nv 2 3 1\nv 2 1 1\nv 1 1 1\nv 1 3 1\nv 0 3 1\n\
f 1 8 6\nf 8 7 6\nf 1 6 5\nf 1 5 2\nf 2 5 4\nf 2 4 3\n\
f 9 14 16\nf 16 14 15\nf 9 13 14\nf 9 10 13\nf 10 12 13\nf 10 11 12\n\
f 1 2 10 9\nf 2 3 11 10\nf 3 4 12 11\nf 4 5 13 12\nf 5 6 14 13\nf 6 7 15 14\nf 7 8 16 15\nf 8 1 9 16\n";

#[test]
fn every_mode_packs_hooks_and_spheres() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = path(&folder, "hook.obj");
    fs::write(&mesh, HOOK).unwrap();
    for mode in ["fast", "paper", "anneal", "sequential"] {
        let out = path(&folder, &format!("{mode}.json"));
        let found = answer(&[
            "pack",
            "--lognormal",
            "0.2",
            "--count",
            "40",
            "--fraction",
            "0.15",
            "--mode",
            mode,
            "--shape",
            &mesh,
            "--shape",
            "sphere",
            "-o",
            &out,
        ]);
        assert_eq!(
            (&found["certified"], &found["particles"]),
            (&true.into(), &40.into()),
            "{mode}"
        );
        assert_eq!(found["mode"], mode);
    }
    for proxy in ["hull", "outline"] {
        let out = path(&folder, &format!("{proxy}.json"));
        let found = answer(&[
            "pack",
            "--constant",
            "--count",
            "40",
            "--fraction",
            "0.12",
            "--proxy",
            proxy,
            "--shape",
            &mesh,
            "-o",
            &out,
        ]);
        assert_eq!(found["certified"], true, "{proxy}");
    }
}

#[test]
fn a_packing_is_judged_drawn_and_traced() {
    let folder = tempfile::tempdir().unwrap();
    let [out, xyz, vtp, png, csv] = ["p.json", "p.xyz", "p.vtp", "p.png", "p.csv"].map(|name| path(&folder, name));
    let found = answer(&[
        "pack",
        "--constant",
        "--box",
        "5,4,6",
        "--fraction",
        "0.4",
        "--shape",
        "ellipsoid:1,1,0.6",
        "--quality",
        "-o",
        &out,
        "--also",
        &xyz,
        "--also",
        &vtp,
        "--picture",
        &png,
        "--trace",
        &csv,
    ]);
    assert_eq!(found["box"], serde_json::json!([5.0, 4.0, 6.0]));
    let quality = &found["quality"];
    assert_eq!(quality["radial_distribution"]["g"].as_array().unwrap().len(), 120);
    assert!(quality["sections"]["p_value"].as_f64().unwrap() > 1e-6);
    assert!(quality["bingham"].as_f64().unwrap() < 35.9);
    assert!(image::open(&png).unwrap().width() > 100);
    let rows = fs::read_to_string(&csv).unwrap().lines().count();
    assert_eq!(rows, found["iterations"].as_u64().unwrap() as usize + 1);
    assert!(fs::read_to_string(&xyz).unwrap().contains("aspherical_shape"));
}

#[test]
fn a_jam_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(&folder, "p.json");
    let (code, _, error) = stereology(&[
        "pack",
        "--constant",
        "--count",
        "200",
        "--fraction",
        "0.55",
        "--mode",
        "sequential",
        "--iterations",
        "500",
        "-o",
        &out,
    ]);
    assert_eq!(code, 1);
    assert!(
        error.contains("jammed at a volume fraction of 0.") && error.contains("of 200 particles"),
        "{error}"
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
