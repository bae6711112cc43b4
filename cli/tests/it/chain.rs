//! From step to step: what a step needs from the one before is in its files, in the unit of the run.

use std::fs;

use serde_json::Value;

use crate::{answer, path, stereology, write_discs};

const SMALL: [&str; 10] = [
    "--count",
    "150",
    "--texture-voxels",
    "32",
    "--voxels",
    "24",
    "--bootstrap",
    "5",
    "--iterations",
    "2",
];

/// Rows of a table without its head, as numbers by column; empty fields are `None`.
fn column(table: &str, name: &str) -> Vec<Option<f64>> {
    let mut rows = table.lines().filter(|line| !line.starts_with('#'));
    let place = rows.next().unwrap().split(',').position(|of| of == name).unwrap();
    rows.map(|row| row.split(',').nth(place).unwrap().parse().ok())
        .collect()
}

fn sum(densities: &Value) -> f64 {
    densities.as_array().unwrap().iter().filter_map(Value::as_f64).sum()
}

/// `unfold` of the folder, `synthesize`, its table and its packing give one density, in the unit of the run.
#[test]
fn all_steps_give_one_density() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, seg, out) = (path(&folder, "discs.png"), path(&folder, "seg"), path(&folder, "out"));
    write_discs(&photo);
    let segmented = answer(&["segment", &photo, "-o", &seg, "--scale", "0.05mm"]);
    assert_eq!(segmented["unit"], "mm");
    let window = &segmented["window"];
    let of = |key: &str| window[key].as_f64().unwrap();
    assert!((of("area") - of("width") * of("height")).abs() < 1e-9 && of("counted_area") <= of("area"));

    let unfolded = answer(&["unfold", &seg]);
    let made = answer(
        &[
            &["synthesize", &photo, "-o", &out, "--scale", "0.05", "--unit", "mm"],
            &SMALL[..],
        ]
        .concat(),
    );
    assert_eq!((&unfolded["unit"], &made["unit"]), (&"mm".into(), &"mm".into()));
    let total = unfolded["total"].as_f64().unwrap();
    assert!((made["unfold"]["total"].as_f64().unwrap() / total - 1.0).abs() < 1e-12);
    assert_eq!(made["unfold"]["number_density"], unfolded["number_density"]);

    // Categories are parts of the same density, in the answers and in the table.
    let parts = unfolded["by_category"].as_array().unwrap();
    assert!(parts.len() > 1);
    let categories: f64 = parts.iter().map(|part| sum(&part["number_density"])).sum();
    assert!((categories / total - 1.0).abs() < 1e-9);
    let table = fs::read_to_string(format!("{out}/densities.csv")).unwrap();
    assert!(table.starts_with("# unit=mm\n"), "{table}");
    let (density, category) = (column(&table, "number_density"), column(&table, "category"));
    let of = |labelled: bool| -> f64 {
        let rows = density
            .iter()
            .zip(&category)
            .filter(|(_, category)| category.is_some() == labelled);
        rows.filter_map(|(density, _)| *density).sum()
    };
    assert!((of(true) / total - 1.0).abs() < 1e-9 && (of(false) / total - 1.0).abs() < 1e-9);

    let packing: Value = serde_json::from_str(&fs::read_to_string(format!("{out}/packing.json")).unwrap()).unwrap();
    assert_eq!(packing["unit"], "mm");
    let volume: f64 = packing["box"]
        .as_array()
        .unwrap()
        .iter()
        .map(|side| side.as_f64().unwrap())
        .product();
    let packed = packing["particles"].as_array().unwrap().len() as f64 / volume;
    let factor = made["pack"]["density_factor"].as_f64().unwrap();
    assert!(
        (packed / (total * factor) - 1.0).abs() < 0.02,
        "{packed} for {}",
        total * factor
    );

    let report = fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(report.contains("cubic mm") && !report.contains("units"));
    let profiles = fs::read_to_string(format!("{seg}/profiles.csv")).unwrap();
    assert!(profiles.lines().any(|line| line == "# unit=mm"), "{profiles}");
    let sliced = answer(&["slice", &out, "--size", "20", "-o", &path(&folder, "cut.png")]);
    assert_eq!(sliced["unit"], "mm");
    let nrrd = path(&folder, "solid.nrrd");
    assert_eq!(answer(&["export", &out, "--voxels", "8", "-o", &nrrd])["unit"], "mm");
    assert!(String::from_utf8_lossy(&fs::read(nrrd).unwrap()).contains("space units: \"mm\" \"mm\" \"mm\""));
}

/// Without a unit none is reported, and lengths in pixels are named so.
#[test]
fn no_unit_is_reported_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, seg) = (path(&folder, "discs.png"), path(&folder, "seg"));
    write_discs(&photo);
    assert_eq!(answer(&["segment", &photo, "-o", &seg])["unit"], Value::Null);
    assert!(
        fs::read_to_string(format!("{seg}/profiles.csv"))
            .unwrap()
            .contains("# unit=px\n")
    );
    assert_eq!(answer(&["unfold", &seg])["unit"], Value::Null);
    // A scale that comes later gives the same numbers in its unit.
    let (pixels, millimetres) = (answer(&["unfold", &seg]), answer(&["unfold", &seg, "--scale", "0.5mm"]));
    assert_eq!(millimetres["unit"], "mm");
    let total = |of: &Value| of["total"].as_f64().unwrap();
    assert!((total(&millimetres) * 0.125 / total(&pixels) - 1.0).abs() < 1e-6);
}

/// The option and the value of the table are both in the message.
#[test]
fn options_that_contradict_the_table_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, seg) = (path(&folder, "discs.png"), path(&folder, "seg"));
    write_discs(&photo);
    answer(&["segment", &photo, "-o", &seg, "--scale", "0.5mm"]);
    let head = fs::read_to_string(format!("{seg}/profiles.csv")).unwrap();
    let stated = |key: &str| {
        let line = head.lines().find_map(|line| line.strip_prefix(&format!("# {key}=")));
        line.unwrap_or_else(|| panic!("no {key}")).to_owned()
    };
    for (options, both) in [
        (&["--area", "1"][..], ["--area 1", "area="]),
        (&["--min-size", "0.001"], ["--min-size 0.00100", "min_size="]),
        (&["--unit", "um"], ["--unit um", "unit=mm"]),
        (&["--scale", "0.5mm"], ["--scale 0.5mm", "unit=mm"]),
        (&["--edge-rule", "all"], ["--edge-rule all", "edge_rule=frame"]),
        (&["--window", "3,4"], ["--window 3.00,4.00", "width,height="]),
    ] {
        let (code, _, error) = stereology(&[&["unfold", &seg], options].concat());
        assert!(
            code == 1 && both.iter().all(|part| error.contains(part)),
            "{options:?}: {code} {error}"
        );
    }
    // What repeats the table is no contradiction.
    let (area, min_size) = (stated("area"), stated("min_size"));
    let repeated = answer(&[
        "unfold",
        &seg,
        "--area",
        &area,
        "--min-size",
        &min_size,
        "--edge-rule",
        "frame",
    ]);
    assert_eq!(repeated["total"], answer(&["unfold", &seg])["total"]);
    // A larger threshold ignores some of the profiles.
    answer(&["unfold", &seg, "--min-size", "5"]);
}

/// Units, areas and folders that are none.
#[test]
fn what_is_missing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, table) = (path(&folder, "discs.png"), path(&folder, "profiles.csv"));
    write_discs(&photo);
    fs::write(&table, "size\n1\n2\n3\n").unwrap();
    let out = path(&folder, "out");
    for (arguments, code, what) in [
        (&["unfold", &table][..], 2, "--area"),
        (
            &["unfold", folder.path().to_str().unwrap(), "--area", "9", "--bins", "2"],
            0,
            "",
        ),
        (&["unfold", &out], 1, "out"),
        (
            &["segment", &photo, "-o", &out, "--scale", "1ell"],
            2,
            "not a known unit of length",
        ),
        (&["segment", &photo, "-o", &out, "--unit", "mm"], 2, "--scale"),
        (
            &["segment", &photo, "-o", &out, "--scale", "1mm", "--unit", "um"],
            2,
            "--unit is um",
        ),
    ] {
        let (found, _, error) = stereology(arguments);
        assert!(found == code && error.contains(what), "{arguments:?}: {found} {error}");
    }
    fs::create_dir(&out).unwrap();
    let (code, _, error) = stereology(&["unfold", &out]);
    assert!(code == 1 && error.contains("no profiles.csv"), "{error}");
    fs::write(&table, "# area=-3\nsize\n1\n").unwrap();
    let (code, _, error) = stereology(&["unfold", &table]);
    assert!(code == 1 && error.contains("line 1"), "{error}");
}

/// A category whose profiles are all below the threshold is counted with another, and that is reported.
#[test]
fn a_category_without_profiles_is_merged() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    let row = |k: u32| {
        let depth = (f64::from(k) + 0.5) / 300.0;
        let size = 10.0 * (1.0 - depth * depth).sqrt();
        match k % 3 {
            0 if size < 4.0 => format!("{size},2,250,250,250\n"),
            0 => format!("{size},0,10,10,10\n"),
            _ => format!("{size},1,200,200,200\n"),
        }
    };
    let rows: String = (0..300).map(row).collect();
    fs::write(&table, format!("size,category,r,g,b\n{rows}")).unwrap();
    let found = answer(&["unfold", &table, "--area", "1e5", "--min-size", "4"]);
    let warnings = found["warnings"].as_array().unwrap();
    let merged = warnings
        .iter()
        .find(|warning| warning["code"] == "merged-category")
        .unwrap();
    let message = merged["message"].as_str().unwrap();
    assert!(
        message.contains("category 2") && message.contains("category 1, the nearest in colour"),
        "{message}"
    );
    let parts = found["by_category"].as_array().unwrap();
    assert_eq!(
        parts
            .iter()
            .map(|part| part["category"].as_u64().unwrap())
            .collect::<Vec<_>>(),
        [0, 1]
    );
    let sums: f64 = parts.iter().map(|part| sum(&part["number_density"])).sum();
    assert!((sums / found["total"].as_f64().unwrap() - 1.0).abs() < 1e-9);
}

/// An assembled packing has the ids of its solid, and a bare packing.json too; colours and texture can be added.
#[test]
fn packings_are_opened_and_assembled() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, out, again) = (path(&folder, "discs.png"), path(&folder, "out"), path(&folder, "again"));
    write_discs(&photo);
    answer(&[&["synthesize", &photo, "-o", &out, "--scale", "2um"], &SMALL[..]].concat());
    let packing = format!("{out}/packing.json");
    let assembled = answer(&[
        "assemble",
        &packing,
        "-o",
        &again,
        "--texture",
        &format!("{out}/texture.npy"),
        "--colours",
        &format!("{out}/profiles.csv"),
        "--binder",
        "200,195,180",
    ]);
    assert_eq!(
        (&assembled["unit"], &assembled["texture_voxel"]),
        (&"um".into(), &2.0.into())
    );
    let exported = |from: &str, channel: &str| {
        let file = path(&folder, "export.npy");
        answer(&[
            "export",
            from,
            "--voxels",
            "24",
            "--channel",
            channel,
            "--force",
            "-o",
            &file,
        ]);
        fs::read(file).unwrap()
    };
    for from in [&again, &packing] {
        assert!(exported(from, "id") == exported(&out, "id"), "{from}");
    }
    // Colours are drawn as for the solid of the photograph.
    let colours = |folder: &str| {
        let solid: Value = serde_json::from_str(&fs::read_to_string(format!("{folder}/solid.json")).unwrap()).unwrap();
        solid["colours"].as_array().unwrap().len()
    };
    assert_eq!(colours(&again), colours(&out));
    assert!(fs::read(format!("{again}/texture.npy")).unwrap() == fs::read(format!("{out}/texture.npy")).unwrap());
    answer(&["slice", &packing, "--size", "30", "-o", &path(&folder, "slice.png")]);
    answer(&["render", &packing, "--size", "30", "-o", &path(&folder, "cube.png")]);
    // Only outputs of this program are replaced, and what is no packing is refused.
    answer(&["assemble", &packing, "-o", &again, "--force"]);
    assert!(!folder.path().join("again/texture.npy").exists());
    answer(&["slice", &again, "--size", "30", "-o", &path(&folder, "plain.png")]);
    let (code, _, error) = stereology(&["slice", &photo, "-o", &path(&folder, "none.png")]);
    assert!(code == 1 && error.contains("discs.png"), "{error}");
    let (code, _, error) = stereology(&["assemble", &packing, "-o", &path(&folder, "x"), "--texture", &photo]);
    assert!(code == 1 && error.contains("discs.png"), "{error}");
}

/// A run that takes up finished steps writes the bytes of a fresh one, and reports which steps these were.
#[test]
fn finished_steps_are_taken_up() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, old) = (path(&folder, "discs.png"), path(&folder, "old"));
    write_discs(&photo);
    answer(&[&["synthesize", &photo, "-o", &old], &SMALL[..]].concat());
    let bytes = |folder: &str| -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
        let mut files: Vec<_> = entries
            .map(|entry| {
                (
                    entry.file_name().into_string().unwrap(),
                    fs::read(entry.path()).unwrap(),
                )
            })
            .collect();
        files.sort();
        files
    };
    let run = |name: &str, extra: &[&str]| {
        let out = path(&folder, name);
        let made = answer(&[&["synthesize", &photo, "-o", &out], &SMALL[..], extra].concat());
        (made["taken_up"].clone(), bytes(&out))
    };
    let (steps, files) = run("same", &["--from", &old]);
    assert_eq!(steps, serde_json::json!(["pack", "texture"]));
    assert!(files == bytes(&old));
    // Another confidence level changes neither; another seed changes both.
    assert_eq!(
        run("level", &["--from", &old, "--level", "0.8"]).0,
        serde_json::json!(["pack", "texture"])
    );
    let (steps, files) = run("seed", &["--from", &old, "--seed", "3"]);
    assert_eq!(steps, serde_json::json!([]));
    assert!(files == run("fresh", &["--seed", "3"]).1);
    // A changed file is not taken up.
    fs::write(format!("{old}/texture.npy"), "changed").unwrap();
    assert_eq!(run("changed", &["--from", &old]).0, serde_json::json!(["pack"]));
    let (code, _, error) = stereology(&[
        "synthesize",
        &photo,
        "-o",
        &path(&folder, "x"),
        "--from",
        folder.path().to_str().unwrap(),
    ]);
    assert!(code == 1 && error.contains("steps.json"), "{error}");
}
