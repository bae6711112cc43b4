//! `unfold` on tables that tell more than sizes: boxes, categories, types.

use std::fmt::Write as _;
use std::fs;

use crate::{answer, path, stereology};

/// Circles of diameter 4 whose middles are spread evenly over a window of 20 by 10 and beyond; those that meet it.
fn circles() -> String {
    let mut rows = String::from("size,left,top,right,bottom,touches_edge\n");
    for k in 0..4000_u32 {
        let (u, v) = (
            f64::from(k) * 0.618_033_988_749_895,
            f64::from(k) * 0.754_877_666_246_693,
        );
        let (x, y) = (-2.0 + 24.0 * u.fract(), -2.0 + 14.0 * v.fract());
        let [left, top, right, bottom] = [x - 2.0, y - 2.0, x + 2.0, y + 2.0];
        let inside = left > 0.0 && top > 0.0 && right < 20.0 && bottom < 10.0;
        writeln!(rows, "4,{left},{top},{right},{bottom},{}", u8::from(!inside)).unwrap();
    }
    rows
}

/// The three right rules count the circles by area as there are, 4000 on 24 × 14; the two naive ones do not.
#[test]
fn edge_rules_weigh_profiles_by_their_boxes() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    fs::write(&table, circles()).unwrap();
    let counted = |rule: &str| {
        let found = answer(&[
            "unfold",
            &table,
            "--area",
            "200",
            "--max-size",
            "4",
            "--bins",
            "2",
            "--edge-rule",
            rule,
            "--window",
            "20,10",
        ]);
        found["checks"]["profiles_per_area"]["observed"].as_f64().unwrap() / (4000.0 / (24.0 * 14.0))
    };
    for right in ["miles-lantuejoul", "frame", "plus"] {
        assert!((counted(right) - 1.0).abs() < 0.02, "{right}: {}", counted(right));
    }
    assert!((counted("all") - 24.0 * 14.0 / 200.0).abs() < 0.02);
    assert!((counted("inside") - 16.0 * 6.0 / 200.0).abs() < 0.02);
}

/// What a rule needs and is not there is named.
#[test]
fn edge_rules_name_the_columns_they_miss() {
    let folder = tempfile::tempdir().unwrap();
    let (table, plain) = (path(&folder, "boxes.csv"), path(&folder, "sizes.csv"));
    fs::write(&table, circles()).unwrap();
    fs::write(&plain, "size,touches_edge\n1,0\n2,0\n3,1\n").unwrap();
    let (code, _, error) = stereology(&["unfold", &table, "--area", "200", "--edge-rule", "frame"]);
    assert!(code == 2 && error.contains("--window"), "{code} {error}");
    let (code, _, error) = stereology(&[
        "unfold",
        &plain,
        "--area",
        "200",
        "--edge-rule",
        "miles-lantuejoul",
        "--window",
        "20,10",
    ]);
    assert!(
        code == 1 && error.contains("left, top, right, bottom"),
        "{code} {error}"
    );
    let found = answer(&[
        "unfold",
        &plain,
        "--area",
        "200",
        "--bins",
        "2",
        "--edge-rule",
        "inside",
    ]);
    assert_eq!(found["profiles"], 2);
}

/// Two categories of one distribution: each has its fraction of the profiles, and they sum to all particles;
/// densities.csv holds their rows.
#[test]
fn categories_are_parts_of_one_density() {
    let folder = tempfile::tempdir().unwrap();
    let (table, output) = (path(&folder, "profiles.csv"), path(&folder, "densities.csv"));
    let rows: String = (0..300)
        .map(|k| {
            let depth = (f64::from(k / 3) + 0.5) / 100.0;
            format!(
                "{},{}\n",
                5.0 * (1.0 - depth * depth).sqrt(),
                if k % 3 == 0 { 4 } else { 1 }
            )
        })
        .collect();
    fs::write(&table, format!("size,category\n{rows}")).unwrap();
    let found = answer(&[
        "unfold",
        &table,
        "--area",
        "1000",
        "--bins",
        "4",
        "--bootstrap",
        "20",
        "-o",
        &output,
    ]);
    let of = found["by_category"].as_array().unwrap();
    assert_eq!(
        (of.len(), &of[0]["category"], &of[1]["category"]),
        (2, &1.into(), &4.into())
    );
    let total = |value: &serde_json::Value| value["total"].as_f64().unwrap();
    assert!(((total(&of[0]) + total(&of[1])) / total(&found) - 1.0).abs() < 1e-9);
    assert!((total(&of[0]) / total(&found) - 2.0 / 3.0).abs() < 1e-9);
    assert!(of[0]["total_lower"].as_f64().unwrap() < of[0]["total_upper"].as_f64().unwrap());
    let table = fs::read_to_string(&output).unwrap();
    assert_eq!(table.lines().count(), 1 + 3 * 4);
    assert!(table.lines().any(|line| line.ends_with(",,4")));
}

/// Symptoms name the number of bins that cures them for each labelled type too.
#[test]
fn symptoms_of_labelled_types_are_cured() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    // All large: nothing explains the few small ones with coarse bins but negative densities.
    let rows: String = (0..400)
        .map(|k| {
            let depth = (f64::from(k / 2) + 0.5) / 200.0;
            format!("{},{}\n", (1.0 - depth * depth * 0.5).sqrt(), k % 2)
        })
        .collect();
    fs::write(&table, format!("size,type\n{rows}")).unwrap();
    let found = answer(&[
        "unfold", &table, "--area", "100", "--shape", "sphere", "--shape", "sphere", "--bins", "12", "--method",
        "paper",
    ]);
    let negative: Vec<&str> = found["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|warning| warning["code"] == "negative-bins")
        .map(|warning| warning["message"].as_str().unwrap())
        .collect();
    assert_eq!(negative.len(), 2);
    for (kind, message) in negative.iter().enumerate() {
        assert!(message.starts_with(&format!("type {kind}: ")), "{message}");
        assert!(
            message.contains("equal bins without it is ") || message.ends_with("bins without it is 1"),
            "{message}"
        );
    }
}

/// Codes of the warnings.
fn codes(found: &serde_json::Value) -> Vec<&str> {
    let warnings = found["warnings"].as_array().unwrap().iter();
    warnings.filter_map(|of| of["code"].as_str()).collect()
}

/// Chords of spheres at even depths.
fn chord(k: u32) -> f64 {
    (1.0 - (f64::from(k % 97) / 97.0).powi(2)).sqrt()
}

/// Profiles in four heaps are clustered, and tiles are resampled; the same profiles evenly spread are not.
#[test]
fn clustered_profiles_are_found_by_their_positions() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    let run = |heaps: bool| {
        let mut rows = String::from("size,x,y\n");
        for k in 0..400_u32 {
            let (x, y) = (f64::from(k % 20), f64::from(k / 20));
            let gather = |of: f64| if heaps { 0.2 * of + 60.0 * (of % 2.0) } else { 5.0 * of };
            writeln!(rows, "{},{},{}", chord(k), gather(x), gather(y)).unwrap();
        }
        fs::write(&table, rows).unwrap();
        answer(&["unfold", &table, "--area", "10000", "--bootstrap", "40"])
    };
    let (even, heaps) = (run(false), run(true));
    assert_eq!(even["clustering"]["resampled"], "counts");
    assert_eq!(heaps["clustering"]["resampled"], "blocks");
    assert!(!codes(&even).contains(&"clustered") && codes(&heaps).contains(&"clustered"));
    assert_eq!(even["total"], heaps["total"]);
    assert!(heaps["total_upper"].as_f64() > even["total_upper"].as_f64());
}

/// A category that a type does not have, a threshold above all profiles, and options without an effect.
#[test]
fn what_is_missing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    let rows: String = (0..200_u32)
        .map(|k| format!("{},{},{}\n", chord(k), k % 2, k % 2))
        .collect();
    fs::write(&table, format!("size,type,category\n{rows}")).unwrap();
    let both = [
        "unfold",
        &table,
        "--area",
        "100",
        "--shape",
        "sphere",
        "--shape",
        "box:1,1,1",
    ];
    let found = answer(&both);
    assert_eq!(found["by_category"].as_array().unwrap().len(), 4);
    let (code, _, error) = stereology(&[&both[..], &["--min-size", "2"]].concat());
    assert!(
        code == 1 && error.contains("the threshold 2 leaves no profiles"),
        "{error}"
    );
    let found = answer(&[&both[..], &["--level", "0.8"]].concat());
    assert!(codes(&found).contains(&"unused-option"));
}
