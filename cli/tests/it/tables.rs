//! Tables of other programs give the answers of the plain table, and state what was understood.

use std::fs;

use serde_json::Value;

use crate::{answer, path, stereology};

/// Areas between 100 and 900, with five decimals, which decide the decimal mark.
fn areas() -> Vec<f64> {
    (1..=60_u32)
        .map(|k| (1e5 * (100.0 + 800.0 * (f64::from(k) * 0.618_033_988_749_895).fract())).round() / 1e5)
        .collect()
}

/// A row for each area, below a header.
fn table(header: &str, row: impl Fn(usize, f64) -> String) -> String {
    let rows = areas().into_iter().enumerate().map(|(k, area)| row(k, area) + "\n");
    format!("{header}\n{}", rows.collect::<String>())
}

fn codes(found: &Value) -> Vec<&str> {
    let warnings = found["warnings"].as_array().unwrap().iter();
    warnings.filter_map(|warning| warning["code"].as_str()).collect()
}

#[test]
fn dialects_give_the_answer_of_the_plain_table() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(&folder, "table.txt");
    let unfold = |bytes: &[u8], more: &[&str]| {
        fs::write(&file, bytes).unwrap();
        answer(&[&["unfold", &file, "--area", "1e6", "--bins", "4"], more].concat())
    };
    let plain = unfold(table("area", |_, a| a.to_string()).as_bytes(), &[]);
    assert!(!codes(&plain).iter().any(|code| code.starts_with("table-")), "{plain}");
    let comma = |value: f64| value.to_string().replace('.', ",");
    let german = table(" ;Label;Area;Mean", |k, a| {
        format!("{k};D\u{fc}nn 1,tif;{};120,5", comma(a))
    })
    .replace('\n', "\r\n");
    let latin = |text: &str| text.chars().map(|c| u8::try_from(c).unwrap()).collect::<Vec<u8>>();
    let utf16: Vec<u8> = [0xFF, 0xFE]
        .into_iter()
        .chain(german.encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    let imagej =
        table(" \tLabel\tArea\tSlice", |k, a| format!("{k}\tone\t{a}\t{}", k % 3)) + "61\tMean\t1\t0\n62\tSD\t1\t0\n";
    let dream3d = format!(
        "60\n{}",
        table("Feature_ID,EquivalentDiameters", |k, a| {
            format!("{k},{}", (4.0 * a / std::f64::consts::PI).sqrt())
        })
    );
    for (bytes, code, what) in [
        (
            german.clone().into_bytes(),
            "table-format",
            "separator semicolon, decimal mark comma",
        ),
        (latin(&german), "table-format", "encoding Latin-1"),
        (utf16, "table-format", "encoding UTF-16"),
        (imagej.into_bytes(), "table-layout", "the last 2 rows"),
        (
            dream3d.into_bytes(),
            "table-layout",
            "`EquivalentDiameters` was read as equivalent circular diameters",
        ),
        (
            table("Area [um^2],Type", |_, a| format!("{a},Polygon")).into_bytes(),
            "table-unit",
            "lengths are in \u{b5}m",
        ),
        (
            table("area,category", |_, a| format!("{a},quartz")).into_bytes(),
            "words-as-numbers",
            "0 = quartz",
        ),
    ] {
        let found = unfold(&bytes, &[]);
        let (total, expected) = (found["total"].as_f64().unwrap(), plain["total"].as_f64().unwrap());
        assert!((total / expected - 1.0).abs() < 1e-9, "{what}: {total} for {expected}");
        let warnings = found["warnings"].as_array().unwrap();
        let stated = |warning: &Value| warning["code"] == code && warning["message"].as_str().unwrap().contains(what);
        assert!(warnings.iter().any(stated), "{what}: {warnings:?}");
    }
    // Areas in square micrometres on an area in square millimetres.
    fs::write(&file, table("Area [um^2]", |_, a| a.to_string())).unwrap();
    let found = answer(&["unfold", &file, "--area", "1", "--bins", "4", "--unit", "mm"]);
    let ratio = found["total"].as_f64().unwrap() / plain["total"].as_f64().unwrap();
    assert!((ratio * 1e-9 - 1.0).abs() < 1e-5 && found["unit"] == "mm", "{ratio}");
}

#[test]
fn slices_are_labels() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(&folder, "table.csv");
    let ends = |name: &dyn Fn(usize) -> String| {
        fs::write(&file, table("area,slice", |k, a| format!("{a},{}", name(k % 3)))).unwrap();
        let resampled = ["--bins", "4", "--resample", "slices", "--bootstrap", "50"];
        let found = answer(&[&["unfold", &file, "--area", "1e6"][..], &resampled].concat());
        [found["total_lower"].clone(), found["total_upper"].clone()]
    };
    let expected = ends(&|k| k.to_string());
    assert_eq!(ends(&|k| (k + 1).to_string()), expected);
    assert_eq!(ends(&|k| (10 * (k + 1)).to_string()), expected);
    assert_eq!(ends(&|k| format!("section {k}")), expected);
}

#[test]
fn invalid_rows_are_refused_or_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (path(&folder, "table.csv"), path(&folder, "packing.json"));
    let rows = table("Label;Area;Feret", |_, a| format!("a;{a};1"));
    fs::write(&file, rows.clone() + "b;x;1\n").unwrap();
    let (code, _, error) = stereology(&["unfold", &file, "--area", "1e6"]);
    let understood = "line 62: `x` in column `Area` is not a number (read as: encoding UTF-8, separator semicolon, decimal mark point, columns Label | Area | Feret)";
    assert!(code == 1 && error.contains(understood), "{error}");
    let found = answer(&["unfold", &file, "--area", "1e6", "--skip-invalid"]);
    assert!(
        codes(&found).contains(&"invalid-rows") && found["profiles"] == 60,
        "{found}"
    );
    // Programs write NaN for what they could not measure.
    fs::write(&file, rows + "b;NaN;NaN\n").unwrap();
    let found = answer(&["unfold", &file, "--area", "1e6"]);
    assert!(
        codes(&found).contains(&"invalid-rows") && found["profiles"] == 60,
        "{found}"
    );
    fs::write(&file, "Label;Feret\na;1\n").unwrap();
    assert!(
        stereology(&["unfold", &file, "--area", "1e6"])
            .2
            .contains("`Feret` is a caliper (Feret) diameter")
    );
    for text in [
        "size\n1\n2\n3\n",
        "1\n2\n3\n",
        "id;Diameter\n1;1,0\n2;2,0\n3;3,0\n",
        "size\n1\n2\nx\n3\n",
    ] {
        fs::write(&file, text).unwrap();
        let found = answer(&[
            "pack",
            "--sizes",
            &file,
            "--skip-invalid",
            "--fraction",
            "0.1",
            "-o",
            &out,
            "--force",
        ]);
        assert_eq!(found["particles"], 3, "{text}");
    }
    assert_eq!(
        stereology(&["pack", "--constant", "--skip-invalid", "-o", &out, "--force"]).0,
        2
    );
}
