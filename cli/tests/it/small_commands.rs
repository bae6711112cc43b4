//! The steps one by one, on small data.

use std::fs;

use crate::{answer, path, stereology, write_discs};

#[test]
fn the_kernel_of_spheres_is_saltikovs() {
    let found = answer(&["kmatrix", "sphere", "--bins", "4"]);
    let root = |j: f64, i: f64| (j * j - i * i).sqrt();
    for (i, row) in found["matrix"].as_array().unwrap().iter().enumerate() {
        for (j, k) in row.as_array().unwrap().iter().enumerate() {
            let (i, j) = ((i + 1) as f64, (j + 1) as f64);
            let expected = if j < i {
                0.0
            } else {
                (root(j, i - 1.0) - root(j, i)) / 4.0
            };
            assert!((k.as_f64().unwrap() - expected).abs() < 1e-14);
        }
    }
    assert_eq!(found["cdf"]["x"].as_array().unwrap().len(), 100);
    let cube = answer(&["kmatrix", "box:1,1,1", "--tolerance", "0.01"]);
    assert!((cube["caliper_hull"].as_f64().unwrap() - 1.5).abs() < 1e-9);
    assert!(cube["standard_error"].as_f64().unwrap() <= 0.01 && cube["triangles"] == 12);
}

#[test]
fn profiles_of_one_size_of_sphere() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    // Spheres of diameter 1 cut at evenly spaced depths: N_A = D N_V.
    let sizes: Vec<String> = (0..400)
        .map(|k| 2.0 * (0.25 - ((f64::from(k) + 0.5) / 800.0_f64).powi(2)).sqrt())
        .map(|d| d.to_string())
        .collect();
    fs::write(&table, format!("size\n{}\n", sizes.join("\n"))).unwrap();
    let found = answer(&[
        "unfold",
        &table,
        "--area",
        "200",
        "--bins",
        "10",
        "--max-size",
        "1",
        "--kernel",
        "upper-edge",
        "--bootstrap",
        "50",
    ]);
    let number = |name: &str| found[name].as_f64().unwrap();
    assert!((number("total") - 2.0).abs() < 0.05 && (number("mean_size") - 1.0).abs() < 0.05);
    assert!(number("total_lower") < 2.0 && 2.0 < number("total_upper"));
    assert_eq!(
        (
            found["edges"].as_array().unwrap().len(),
            found["profiles"].as_u64().unwrap()
        ),
        (11, 400)
    );

    // Twice the unit of length: an eighth of the density.
    let scaled = answer(&[
        "unfold",
        &table,
        "--area",
        "200",
        "--max-size",
        "1",
        "--kernel",
        "upper-edge",
        "--scale",
        "2",
    ]);
    assert!((scaled["total"].as_f64().unwrap() * 8.0 / number("total") - 1.0).abs() < 1e-6);

    // From the densities to a packing of just these spheres.
    let (densities, packing) = (path(&folder, "densities.csv"), path(&folder, "packing.json"));
    answer(&[
        "unfold",
        &table,
        "--area",
        "200",
        "--max-size",
        "1",
        "--kernel",
        "upper-edge",
        "-o",
        &densities,
    ]);
    let packed = answer(&[
        "pack",
        "--densities",
        &densities,
        "--count",
        "100",
        "--fraction",
        "0.2",
        "-o",
        &packing,
    ]);
    assert_eq!(
        (
            packed["particles"].as_u64().unwrap(),
            packed["certified"].as_bool().unwrap()
        ),
        (100, true)
    );
    assert!(
        stereology(&["unfold", &table, "--area", "200", "--strict", "--bins", "200"]).0 == 3,
        "few profiles in a bin"
    );
}

/// The choices of the model from the data, and what the answer holds beside the densities.
#[test]
fn unfolding_finds_what_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    // Spheres of diameters 0.3 to 1, one of each of 40, cut at 25 depths; ten slices.
    let rows: String = (0..1000)
        .filter_map(|k| {
            let size = 0.3 + 0.7 * (f64::from(k % 40) + 0.5) / 40.0;
            let depth = (f64::from(k / 40) + 0.5) / 50.0;
            let chord = size * size - 4.0 * depth * depth;
            (chord > 0.0).then(|| format!("{},{}\n", chord.sqrt(), k % 10))
        })
        .collect();
    fs::write(&table, format!("size,slice\n{rows}")).unwrap();
    let area = ["unfold", &table, "--area", "1000"];
    let run = |more: &[&str]| answer(&[&area[..], more].concat());
    let found = run(&[
        "--bins",
        "8",
        "--max-size",
        "likelihood",
        "--bootstrap",
        "60",
        "--resample",
        "slices",
    ]);
    let largest = found["max_size"]["value"].as_f64().unwrap();
    assert!((largest - 1.0).abs() < 0.05, "{largest}");
    assert!(
        (found["total"].as_f64().unwrap() - 1.0).abs() < 0.1,
        "{}",
        found["total"]
    );
    let list = |value: &serde_json::Value| value.as_array().unwrap().len();
    assert_eq!(
        (
            list(&found["observed"]),
            list(&found["refolded"]),
            list(&found["passing"]["lower"])
        ),
        (8, 8, 9)
    );
    assert_eq!(list(&found["by_volume"]["percentiles"]["value"]), 5);
    assert!(found["surface_density_lower"].as_f64().unwrap() < found["surface_density"].as_f64().unwrap());
    let check = &found["checks"]["area_fraction"];
    assert!((check["observed"].as_f64().unwrap() / check["expected"].as_f64().unwrap() - 1.0).abs() < 0.1);
    let capped = run(&["--capping-angle", "fit"]);
    assert!(capped["capping_angle"]["value"].as_f64().unwrap() < 30.0);
    assert!(
        run(&["--bins", "auto", "--max-size", "corrected"])["edges"]
            .as_array()
            .unwrap()
            .len()
            > 4
    );
    assert_eq!(list(&run(&["--spacing", "phi", "--min-size", "0.25"])["edges"]), 6);
    for method in ["penalised", "sparse", "em", "ems", "nnls", "paper"] {
        assert_eq!(run(&["--method", method])["method"], method);
    }
    // Spheres and near-spheres show the same profiles: no pretending.
    let refused = stereology(
        &[
            &area[..],
            &[
                "--shape",
                "sphere",
                "--shape",
                "ellipsoid:1,1,1.2",
                "--unknown-fractions",
            ],
        ]
        .concat(),
    );
    assert!(refused.0 == 1 && refused.2.contains("do not determine"), "{refused:?}");
    let two = path(&folder, "two.csv");
    fs::write(&two, "size\n0.5\n0.7\n").unwrap();
    let few = answer(&["unfold", &two, "--area", "10"]);
    assert_eq!(few["edges"].as_array().unwrap().len(), 3);
    assert!(
        few["warnings"]
            .as_array()
            .unwrap()
            .iter()
            .any(|of| of["code"] == "fewer-bins")
    );
}

#[test]
fn labelled_types_are_unfolded_apart() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    let rows: String = (0..200)
        .map(|k| format!("{},{}\n", 0.2 + 0.004 * f64::from(k), k % 2))
        .collect();
    fs::write(&table, format!("size,type\n{rows}")).unwrap();
    let found = answer(&[
        "unfold",
        &table,
        "--area",
        "100",
        "--shape",
        "sphere",
        "--shape",
        "ellipsoid:1,1,2",
        "--bins",
        "5",
    ]);
    let types = found["types"].as_array().unwrap();
    let sum = |bin: usize| {
        types
            .iter()
            .filter_map(|of| of["number_density"][bin].as_f64())
            .sum::<f64>()
    };
    assert_eq!(types[1]["shape"], "ellipsoid:1,1,2");
    for bin in 0..5 {
        assert!((sum(bin) - found["number_density"][bin].as_f64().unwrap()).abs() < 1e-9);
    }
}

#[test]
fn a_packing_is_the_same_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str, threads: &str| {
        let (json, csv) = (
            path(&folder, &format!("{name}.json")),
            path(&folder, &format!("{name}.csv")),
        );
        let found = answer(&[
            "pack",
            "--lognormal",
            "0.3",
            "--count",
            "300",
            "--fraction",
            "0.45",
            "-o",
            &json,
            "--also",
            &csv,
            "--threads",
            threads,
        ]);
        assert!((found["fraction"].as_f64().unwrap() - 0.45).abs() < 1e-9 && found["max_overlap"] == 0.0);
        (fs::read(json).unwrap(), fs::read(csv).unwrap())
    };
    assert_eq!(bytes("one", "1"), bytes("two", "2"));
}

#[test]
fn a_photograph_of_discs() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, out) = (path(&folder, "discs.png"), path(&folder, "out"));
    write_discs(&photo);
    let found = answer(&["segment", &photo, "-o", &out, "--edge-rule", "all"]);
    assert_eq!(found["profiles"], 80);
    let drawn = (27.0 * 100.0 + 53.0 * 6.5 * 6.5) * std::f64::consts::PI / (260.0 * 200.0);
    assert!(
        (found["area_fraction"].as_f64().unwrap() / drawn - 1.0).abs() < 0.05,
        "{found}"
    );
    let mut files: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            ".stereology-files",
            "binder.png",
            "labels.tif",
            "means.png",
            "overlay.png",
            "profiles.csv",
            "residual.png",
            "residual.tif",
            "summary.json"
        ]
    );
    let table = fs::read_to_string(format!("{out}/profiles.csv")).unwrap();
    let rows: Vec<&str> = table.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(table.starts_with("# area=52000\n# min_size=") && table.contains("# edge_rule=all\n"));
    assert_eq!(
        rows[0],
        "id,x,y,area,size,r,g,b,category,touches_edge,weight,left,top,right,bottom,pixels,axis_ratio,ellipticity,solidity,orientation"
    );
    assert_eq!(rows.len(), 81);
    // Discs are ellipses.
    for row in &rows[1..] {
        let ellipticity: f64 = row.split(',').nth(17).unwrap().parse().unwrap();
        assert!((ellipticity - 1.0).abs() < 0.02, "{row}");
    }

    // Its own label map, imported again, gives the same profiles; its table can be unfolded.
    let again = path(&folder, "again");
    let imported = answer(&[
        "segment",
        &photo,
        "-o",
        &again,
        "--edge-rule",
        "all",
        "--labels",
        &format!("{out}/labels.tif"),
    ]);
    assert_eq!(imported["area_fraction"], found["area_fraction"]);
    answer(&[
        "unfold",
        &format!("{out}/profiles.csv"),
        "--area",
        "52000",
        "--bins",
        "5",
    ]);
}

#[test]
fn textures_and_their_bands() {
    let folder = tempfile::tempdir().unwrap();
    let photo = path(&folder, "discs.png");
    write_discs(&photo);
    let bands = answer(&["pyramid", &photo, "--levels", "3"]);
    assert!(bands["reconstruction_error"].as_f64().unwrap() < 1e-12);
    assert_eq!(bands["bands"].as_array().unwrap().len(), 3 * 4 + 2);

    let (volume, picture) = (path(&folder, "t.npy"), path(&folder, "t.png"));
    let made = answer(&[
        "texture",
        &photo,
        "--size",
        "16,20,24",
        "--iterations",
        "1",
        "-o",
        &volume,
    ]);
    assert_eq!(made["shape"], serde_json::json!([16, 20, 24, 3]));
    assert_eq!(made["slice_errors"].as_array().unwrap().len(), 1);
    // Matching the colours of so few voxels at the end undoes a part; the remaining error is reported.
    let errors = [&made["slice_errors"][0], &made["final_error"]].map(|error| error.as_f64().unwrap());
    assert!(
        errors.iter().all(|error| (0.0..1.0).contains(error)) && made["settled"].is_boolean(),
        "{errors:?}"
    );
    assert!(fs::metadata(&volume).unwrap().len() > 16 * 20 * 24 * 3);
    answer(&[
        "texture",
        &photo,
        "--size",
        "40,24",
        "--iterations",
        "1",
        "-o",
        &picture,
    ]);
    assert_eq!(image::open(&picture).unwrap().into_rgb8().dimensions(), (24, 40));
    let oriented = path(&folder, "o.npy");
    let made = answer(&[
        "texture",
        &photo,
        &photo,
        &photo,
        "--size",
        "16",
        "--iterations",
        "1",
        "-o",
        &oriented,
    ]);
    assert_eq!(made["mode"], "oriented");
    assert_eq!(made["slice_errors"].as_array().unwrap().len(), 1);
}

/// What `shape` writes is a SHAPE of the same measures.
#[test]
fn shapes_are_written_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let control = path(&folder, "pebble.json");
    answer(&["shape", "sphere", "-o", &control]);
    for (spec, name) in [
        ("rock:3", "a.obj"),
        ("rock:3,0.05", "b.ply"),
        ("superellipsoid:1,1,1,0.5,0.5", "c.stl"),
        (&control, "d.obj"),
    ] {
        let file = path(&folder, name);
        let written = answer(&["shape", spec, "-o", &file]);
        let read = answer(&["kmatrix", &file, "--directions", "64", "--paper"]);
        for key in ["volume", "surface_area", "caliper_hull", "max_area"] {
            let (a, b) = (written[key].as_f64().unwrap(), read[key].as_f64().unwrap());
            assert!((a / b - 1.0).abs() < 1e-5, "{spec} {key} {a} {b}");
        }
        assert_eq!(read["paper"]["caliper"], read["caliper_hull"]);
    }
    let fine = answer(&[
        "shape",
        "box:1,2,3",
        "--subdivide",
        "2",
        "--scheme",
        "loop",
        "-o",
        &path(&folder, "e.obj"),
    ]);
    assert_eq!(fine["triangles"], 12 * 16);
    let (code, _, error) = stereology(&["shape", "rock:3", "-o", &path(&folder, "a.obj")]);
    assert!(code == 1 && error.contains("--force"), "{error}");
}

/// A hull of points in a text file is a SHAPE; a file that holds none is refused with its line.
#[test]
fn hulls_of_points_in_text_files() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let file = path(&folder, name);
        std::fs::write(&file, text).unwrap();
        format!("hull:{file}")
    };
    let corners = "0 0 0\n2 0 0\n0 3 0\n2 3 0\n0 0 1\n2 0 1\n0 3 1\n2 3 1\n1 1 0.5\n";
    for spec in [
        write("brick.xyz", corners),
        write("brick.csv", &format!("x,y,z\n{}", corners.replace(' ', ","))),
    ] {
        let brick = answer(&["kmatrix", &spec, "--directions", "64"]);
        assert!((brick["volume"].as_f64().unwrap() - 6.0).abs() < 1e-9);
        assert!((brick["caliper_hull"].as_f64().unwrap() - 3.0).abs() < 1e-9);
    }
    for (spec, says) in [
        (write("flat.csv", "0,0,0\n1,0,0\n0,1,0\n1,1,0\n"), "one plane"),
        (write("few.csv", "0,0,0\n1,0,0\n"), "at least four points"),
        (write("words.csv", "x,y,z\n1,2,3\n1,two,3\n"), "line 3: `two`"),
        (format!("hull:{}", path(&folder, "none.csv")), "none.csv"),
    ] {
        let (code, _, error) = stereology(&["kmatrix", &spec]);
        assert!(code == 1 && error.contains(says), "{code} {error}");
    }
}
