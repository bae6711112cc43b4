//! Stone grown in meshes, and solids judged by their slices.

use std::fs;

use crate::{answer, path, stereology, write_discs};

/// A grey texture of 48² pixels.
fn write_texture(file: &str) {
    image::GrayImage::from_fn(48, 48, |x, y| image::Luma([((x / 3 * 7 + y / 4 * 5) % 11 * 20) as u8]))
        .save(file)
        .unwrap();
}

#[test]
fn a_block_is_filled_around_its_measurements() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_texture(&at("stone.png"));
    fs::write(
        at("drilled.csv"),
        "x,y,z,value\n-0.9,-0.4,0.1,255\n-0.85,-0.4,0.1,255\n0.5,0.2,-0.1,0\n",
    )
    .unwrap();
    let arguments = [
        "grow",
        "box:2,1,1",
        &at("stone.png"),
        "--resolution",
        "16",
        "--measured",
        &at("drilled.csv"),
    ];
    let found = answer(
        &[
            &arguments[..],
            &[
                "-o",
                &at("a.npy"),
                "--cells",
                &at("cells.nrrd"),
                "--sources",
                &at("sources.npy"),
            ],
        ]
        .concat(),
    );
    assert_eq!(
        (&found["voxels_inside"], &found["filled"]),
        (&1024.into(), &1024.into())
    );
    assert_eq!((&found["fixed_changed"], &found["cells"]), (&0.into(), &2.into()));
    let grown = stereology::grid::read_npy::<u8>(at("a.npy")).unwrap();
    assert_eq!(grown.shape(), [8, 8, 16]);
    assert_eq!((grown[[4, 0, 0]], grown[[3, 5, 12]]), (255, 0));
    let cells = stereology::grid::read_volume(at("cells.nrrd")).unwrap().samples;
    assert_eq!((cells[[4, 0, 0, 0]], cells[[3, 5, 12, 0]]), (2.0, 1.0));
    // The same bytes at another number of threads.
    answer(&[&arguments[..], &["-o", &at("b.npy"), "--threads", "3"]].concat());
    assert!(fs::read(at("a.npy")).unwrap() == fs::read(at("b.npy")).unwrap());
    // What was grown can be judged, with its sources.
    let judged = answer(&[
        "measure",
        &at("stone.png"),
        &at("a.npy"),
        "--slices",
        "xz",
        "--sources",
        &at("sources.npy"),
    ]);
    assert!(judged["coverage"].as_f64().unwrap() > 0.05 && judged["longest_copy"].as_u64().unwrap() > 0);
}

/// Stone in a ball is measured inside it, and finished where it is asked.
#[test]
fn masks_and_finishing() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_texture(&at("stone.png"));
    let arguments = [
        "grow",
        "sphere",
        &at("stone.png"),
        "--resolution",
        "26",
        "--seeds",
        "6",
        "--finish",
        "2",
    ];
    let grown = answer(&[&arguments[..], &["-o", &at("a.npy"), "--cells", &at("cells.npy")]].concat());
    assert!(grown["seams"].as_f64().unwrap() > 0.0 && grown["seams_before_finish"].as_f64().unwrap() > 0.0);
    assert_eq!(
        (&grown["finish"], &grown["filled"]),
        (&2.into(), &grown["voxels_inside"])
    );
    let measured = |more: &[&str]| answer(&[&["measure", &at("stone.png"), &at("a.npy")], more].concat());
    let (inside, all) = (measured(&["--mask", &at("cells.npy")]), measured(&[]));
    // The black corners of the box are no stone.
    assert!(
        inside["kl_grey"].as_f64().unwrap() < 0.5 * all["kl_grey"].as_f64().unwrap(),
        "{inside} {all}"
    );
    assert!(
        inside["warnings"]
            .as_array()
            .unwrap()
            .iter()
            .any(|w| w["code"] == "slices-left-out")
    );
    let (code, _, error) = stereology(&["measure", &at("stone.png"), &at("a.npy"), "--mask", &at("stone.png")]);
    assert!(code == 1 && error.contains("stone.png"), "{error}");
}

#[test]
fn measurements_may_be_numbered_by_voxel_or_lie_on_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_texture(&at("stone.png"));
    let warned = |rows: &str, more: &[&str]| {
        fs::write(at("m.csv"), rows).unwrap();
        let out = at("o.npy");
        let arguments = [
            "grow",
            "box:1,1,1",
            &at("stone.png"),
            "--resolution",
            "8",
            "--measured",
            &at("m.csv"),
            "-o",
            &out,
            "--force",
        ];
        let found = answer(&[&arguments[..], more].concat());
        found["warnings"]
            .as_array()
            .unwrap()
            .iter()
            .map(|w| w["code"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(warned("7,7,7,9\n0,0,0,9\n", &[]), ["measured-as-voxels"]);
    assert!(warned("7,7,7,9\n0,0,0,9\n", &["--measured-in", "voxels"]).is_empty());
    assert_eq!(warned("value,z,y,x\n9,0,0,0.5\n", &[]), ["measured-moved"]);
    assert!(warned("0.1,0.1,0.1,9\n", &["--window", "0", "--seeds", "2"]).is_empty());
}

#[test]
fn chemistry_grows_beside_grey() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 30, 30, 2), }";
    let padded = format!("{header:<117}\n");
    let mut bytes = [
        b"\x93NUMPY\x01\0",
        &(padded.len() as u16).to_le_bytes()[..],
        padded.as_bytes(),
    ]
    .concat();
    for i in 0..900_u16 {
        let grey = f32::from(i % 7);
        bytes.extend([grey.to_le_bytes(), (-0.5 * grey).to_le_bytes()].concat());
    }
    fs::write(at("both.npy"), bytes).unwrap();
    fs::write(at("m.csv"), "0,0,0,3,-1.5\n").unwrap();
    answer(&[
        "grow",
        "sphere",
        &at("both.npy"),
        "--resolution",
        "12",
        "--measured",
        &at("m.csv"),
        "-o",
        &at("o.npy"),
    ]);
    let grown = stereology::grid::read_npy::<f32>(at("o.npy")).unwrap();
    assert_eq!(grown.shape(), [12, 12, 12, 2]);
    assert!(grown.rows().into_iter().all(|v| v[1] == -0.5 * v[0]));
}

#[test]
fn pictures_grow_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_discs(at("discs.png"));
    let found = answer(&[
        "grow",
        "picture:40,50",
        &at("discs.png"),
        "--window",
        "7",
        "-o",
        &at("a.png"),
    ]);
    assert_eq!(found["filled"], 2000);
    answer(&[
        "grow",
        "picture:40,50",
        &at("discs.png"),
        "--levels",
        "2",
        "-o",
        &at("b.png"),
    ]);
    for name in ["a.png", "b.png"] {
        assert_eq!(image::open(at(name)).unwrap().into_rgb8().dimensions(), (50, 40));
    }
}

#[test]
fn every_figure_has_its_ideal_and_floor() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_discs(at("discs.png"));
    answer(&["texture", &at("discs.png"), "--size", "32", "-o", &at("v.tif")]);
    let report = at("r.html");
    let found = answer(&[
        "measure",
        &at("discs.png"),
        &at("v.tif"),
        "--slices",
        "xz,yz",
        "--report",
        &report,
    ]);
    for name in [
        "kl_grey",
        "std_ratio",
        "skewness",
        "kl_orientation",
        "coherence",
        "fringe_length",
        "tortuosity",
        "s2",
        "swd7",
        "swd16",
        "gradient_ratio",
    ] {
        for key in [name.to_owned(), format!("{name}_ideal"), format!("{name}_floor")] {
            assert!(found.get(&key).is_some(), "{key}");
        }
    }
    assert!(found["swd7"].as_f64().unwrap() > 0.0 && found["slices"] == 64);
    let page = fs::read_to_string(&report).unwrap();
    assert!(
        page.contains("<svg")
            && page.contains("Sharpness")
            && !page.contains("<script")
            && !page.contains("could not be drawn")
    );
    // A volume beside itself is ideal but for the draw of patches.
    let itself = answer(&["measure", &at("v.tif"), &at("v.tif")]);
    assert_eq!((&itself["kl_grey"], &itself["s2"]), (&0.0.into(), &0.0.into()));
}

#[test]
fn what_cannot_be_grown_or_measured_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_texture(&at("stone.png"));
    image::GrayImage::from_pixel(30, 30, image::Luma([7]))
        .save(at("flat.png"))
        .unwrap();
    image::GrayImage::from_fn(4, 4, |x, _| image::Luma([x as u8]))
        .save(at("tiny.png"))
        .unwrap();
    fs::write(
        at("open.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n",
    )
    .unwrap();
    fs::write(at("text.npy"), "hello").unwrap();
    fs::write(at("far.csv"), "x,y,z,value\n9.5,0,0,1\n").unwrap();
    fs::write(at("two.csv"), "0.01,0,0,1\n0.012,0,0,2\n").unwrap();
    fs::write(at("odd.csv"), "0,0,0,1.5\n").unwrap();
    fs::write(at("rgb.csv"), "0,0,0,1,2,3\n").unwrap();
    fs::write(at("words.csv"), "a,b\n1,2\n").unwrap();
    fs::write(at("none.csv"), "x,y,z,value\n").unwrap();
    let stone = at("stone.png");
    let grow = |mesh: &str, image: &str, more: &[&str]| {
        let out = at("o.npy");
        let (code, said, error) = stereology(&[&["grow", mesh, image, "-o", &out], more].concat());
        assert!(said.is_empty() && !std::path::Path::new(&out).exists(), "{error}");
        (code, error)
    };
    let sized = |more: &[&'static str]| [&["--resolution", "8"], more].concat();
    let cases: Vec<(i32, String, &str)> = vec![
        (grow(&at("open.obj"), &stone, &sized(&[])), "open.obj"),
        (grow("box:1,1,1", &at("flat.png"), &sized(&[])), "same colour"),
        (grow("box:1,1,1", &at("tiny.png"), &sized(&[])), "no window of 5 x 5"),
        (grow("box:1,1,1", &stone, &[]), "--resolution"),
        (grow("box:1,1,1", &stone, &sized(&["--window", "4"])), "--window"),
        (grow("box:1,1,1", &stone, &sized(&["--seeds", "0"])), "--measured"),
        (grow("blob", &stone, &sized(&[])), "blob"),
    ]
    .into_iter()
    .map(|((code, error), part)| (code, error, part))
    .collect();
    for (code, error, part) in &cases {
        assert!(error.contains(part) && (1..=2).contains(code), "{part}: {code} {error}");
    }
    for (table, part) in [
        ("far.csv", "outside the mesh"),
        ("two.csv", "different values"),
        ("odd.csv", "0 to 255"),
        ("rgb.csv", "1 value(s)"),
        ("words.csv", "x, y, z"),
        ("none.csv", "no measurement"),
        ("missing.csv", "missing.csv"),
    ] {
        let out = at("o.npy");
        let (code, _, error) = stereology(&[
            "grow",
            "box:1,1,1",
            &stone,
            "--resolution",
            "8",
            "--measured",
            &at(table),
            "-o",
            &out,
        ]);
        assert!(
            code == 1 && error.contains(part) && error.contains(table),
            "{table}: {error}"
        );
    }
    for (exemplar, volume, part) in [
        ("stone.png", "text.npy", "text.npy"),
        ("stone.png", "stone.png", "--slices xy"),
        ("flat.png", "stone.png", "same grey level"),
        ("tiny.png", "stone.png", "16 x 16"),
        ("missing.png", "stone.png", "missing.png"),
    ] {
        let more: &[&str] = if part == "--slices xy" {
            &[]
        } else {
            &["--slices", "xy"]
        };
        let (code, _, error) = stereology(&[&["measure", &at(exemplar), &at(volume)], more].concat());
        assert!(code == 1 && error.contains(part), "{exemplar} {volume}: {error}");
    }
    assert_eq!(stereology(&["measure", &stone, &stone, "--slices", "zz"]).0, 2);
}
