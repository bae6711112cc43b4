//! Solids from images: fixed voxels keep their values, masked voxels stay empty, phases keep their fractions, and
//! mistakes are errors.

use std::fs;
use std::path::Path;

use crate::{answer, path, stereology};

/// A grey picture of wavy layers, 40² pixels.
fn write_layers(file: &str) {
    image::GrayImage::from_fn(40, 40, |x, y| {
        let wave = (0.9 * f64::from(y) + (0.2 * f64::from(x)).sin()).sin();
        image::Luma([(128.0 + 100.0 * wave) as u8])
    })
    .save(file)
    .unwrap();
}

/// An array of bytes as NumPy writes it.
fn write_npy(file: &str, shape: [usize; 3], value: impl Fn(usize, usize, usize) -> u8) {
    let [nz, ny, nx] = shape;
    let header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({nz}, {ny}, {nx}), }}");
    let padded = format!("{header:<117}\n");
    let mut bytes = [
        b"\x93NUMPY\x01\0",
        &(padded.len() as u16).to_le_bytes()[..],
        padded.as_bytes(),
    ]
    .concat();
    for z in 0..nz {
        for y in 0..ny {
            bytes.extend((0..nx).map(|x| value(z, y, x)));
        }
    }
    fs::write(file, bytes).unwrap();
}

/// Few iterations: what is tested holds after any number.
const QUICK: [&str; 4] = ["--iterations", "1", "--levels", "1"];

#[test]
fn given_voxels_stay_and_masks_stay_empty() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_layers(&at("layers.png"));
    let inside = |z: usize, y: usize, x: usize| z + y + x < 24 && z > 1;
    write_npy(&at("mask.npy"), [10, 11, 12], |z, y, x| 7 * u8::from(inside(z, y, x)));
    // Columns in another order than x, y, z.
    fs::write(at("fixed.csv"), "value,z,y,x\n255,2,3,4\n1,9,0,11\n77,5,5,5\n").unwrap();
    let found = answer(
        &[
            &["exemplar", &at("layers.png"), "--size", "10,11,12"][..],
            &["--mask", &at("mask.npy"), "--fixed", &at("fixed.csv"), "--open"],
            &["-o", &at("a.npy"), "--sources", &at("s.npy")],
            &QUICK,
        ]
        .concat(),
    );
    for key in [
        "shape",
        "method",
        "solver",
        "views",
        "phases",
        "levels",
        "voxel_iterations",
        "microseconds_per_voxel_iteration",
        "coverage",
        "perplexity",
        "seconds",
    ] {
        assert!(found.get(key).is_some(), "{key}");
    }
    assert_eq!(
        (&found["method"], &found["solver"], &found["views"]),
        (&"best".into(), &"batch".into(), &3.into())
    );
    assert_eq!(found["levels"][0]["energies"].as_array().unwrap().len(), 1);
    let made = stereology::grid::read_npy::<u8>(at("a.npy")).unwrap();
    let sources = stereology::grid::read_npy::<u32>(at("s.npy")).unwrap();
    assert_eq!(made.shape(), [10, 11, 12]);
    assert_eq!((made[[2, 3, 4]], made[[9, 0, 11]], made[[5, 5, 5]]), (255, 1, 77));
    for (i, (value, source)) in made.iter().zip(&sources).enumerate() {
        let here = inside(i / 132, i / 12 % 11, i % 12);
        assert!(
            if here {
                *source < 1600
            } else {
                *value == 0 && *source == u32::MAX
            },
            "{i}"
        );
    }
}

#[test]
fn a_mesh_masks_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_layers(&at("layers.png"));
    // Two units high, one wide: as large as fits into the box.
    let corners = (0..8).map(|i| format!("v {} {} {}\n", i & 1, i >> 1 & 1, 2 * (i >> 2)));
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(at("post.obj"), corners.collect::<String>() + faces).unwrap();
    let arguments = ["exemplar", &at("layers.png"), "--size", "16", "--views", "2"];
    answer(&[&arguments[..], &["--mask", &at("post.obj"), "-o", &at("a.npy")], &QUICK].concat());
    let made = stereology::grid::read_npy::<u8>(at("a.npy")).unwrap();
    let inside = made.indexed_iter().filter(|(_, v)| **v > 0).count();
    assert_eq!(inside, 16 * 8 * 8, "the picture is nowhere black");
    assert!(made[[0, 4, 4]] > 0 && made[[15, 11, 11]] > 0 && made[[8, 3, 8]] == 0);
    answer(&[&arguments[..], &["--mask", "sphere", "-o", &at("b.npy")], &QUICK].concat());
    let ball = stereology::grid::read_npy::<u8>(at("b.npy")).unwrap();
    let share = ball.iter().filter(|v| **v > 0).count() as f64 / 4096.0;
    assert!((share - std::f64::consts::PI / 6.0).abs() < 0.03, "{share}");
}

#[test]
fn phases_have_exactly_the_pictures_fractions() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    // Three phases, 0, 90 and 200; and two greys, which need not be said to be phases.
    let three = |x: u32, y: u32| match (x * x + 3 * y) % 7 {
        0 => 200,
        1 | 2 => 90,
        _ => 0_u8,
    };
    image::GrayImage::from_fn(28, 28, |x, y| image::Luma([three(x, y)]))
        .save(at("three.png"))
        .unwrap();
    image::GrayImage::from_fn(28, 28, |x, y| image::Luma([u8::from(three(x, y) > 0) * 255]))
        .save(at("two.png"))
        .unwrap();
    for (picture, greys, more) in [
        ("three.png", vec![0, 90, 200], &["--kind", "phases"][..]),
        ("two.png", vec![0, 255], &[]),
    ] {
        let arguments = [
            "exemplar",
            &at(picture),
            "--size",
            "9,10,11",
            "-o",
            &at("a.npy"),
            "--force",
        ];
        let found = answer(&[&arguments[..], more, &QUICK].concat());
        assert_eq!(found["phases"], true);
        let made = stereology::grid::read_npy::<u8>(at("a.npy")).unwrap();
        let shown = image::open(at(picture)).unwrap().into_luma8();
        for grey in &greys {
            let share = shown.pixels().filter(|p| p[0] == *grey).count() as f64 / 784.0;
            let voxels = made.iter().filter(|v| **v == *grey).count() as f64;
            assert!(
                (voxels - 990.0 * share).abs() < 1.0,
                "{picture} {grey}: {voxels} of 990, share {share}"
            );
        }
        assert!(made.iter().all(|v| greys.contains(v)));
    }
}

#[test]
fn every_picture_has_its_axis_and_every_method_its_solid() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_layers(&at("layers.png"));
    image::RgbImage::from_fn(36, 40, |x, y| image::Rgb([(6 * x) as u8, (6 * y) as u8, 9]))
        .save(at("colours.png"))
        .unwrap();
    let two = answer(
        &[
            &[
                "exemplar",
                &at("layers.png"),
                &at("layers.png"),
                "--size",
                "12",
                "-o",
                &at("a.npy"),
            ][..],
            &QUICK,
        ]
        .concat(),
    );
    assert_eq!((&two["views"], &two["shape"][3]), (&2.into(), &1.into()));
    // A colour picture beside a grey one: both are taken as colours.
    let images = [at("layers.png"), at("colours.png"), at("layers.png")];
    let three = answer(
        &[
            &[
                "exemplar",
                &images[0],
                &images[1],
                &images[2],
                "--size",
                "8",
                "-o",
                &at("b.nrrd"),
            ][..],
            &QUICK,
        ]
        .concat(),
    );
    assert_eq!((&three["views"], &three["shape"][3]), (&3.into(), &3.into()));
    for (method, scan) in [
        ("wei-levoy", "morton"),
        ("kopf", "random"),
        ("chen-wang", "lexicographic"),
    ] {
        let arguments = [
            "exemplar",
            &at("layers.png"),
            "--size",
            "8",
            "--method",
            method,
            "--scan",
            scan,
            "--search",
            "tsvq",
        ];
        let one = answer(&[&arguments[..], &["-o", &at("c.npy"), "--force"], &QUICK].concat());
        assert_eq!((&one["method"], &one["solver"]), (&method.into(), &"sequential".into()));
        let bytes = fs::read(at("c.npy")).unwrap();
        answer(
            &[
                &arguments[..],
                &["-o", &at("c.npy"), "--force", "--threads", "3"],
                &QUICK,
            ]
            .concat(),
        );
        assert!(
            fs::read(at("c.npy")).unwrap() == bytes,
            "the same bytes at any number of threads"
        );
    }
}

#[test]
fn what_cannot_be_made_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_layers(&at("layers.png"));
    let (layers, out) = (at("layers.png"), at("o.npy"));
    image::GrayImage::from_pixel(30, 30, image::Luma([7]))
        .save(at("flat.png"))
        .unwrap();
    image::GrayImage::from_fn(6, 6, |x, _| image::Luma([9 * x as u8]))
        .save(at("tiny.png"))
        .unwrap();
    image::RgbImage::from_fn(30, 30, |x, y| image::Rgb([x as u8, y as u8, 0]))
        .save(at("colours.png"))
        .unwrap();
    fs::write(
        at("open.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n",
    )
    .unwrap();
    write_npy(&at("empty.npy"), [8, 8, 8], |_, _, _| 0);
    write_npy(&at("other.npy"), [8, 8, 9], |_, _, _| 1);
    write_npy(&at("half.npy"), [8, 8, 8], |z, _, _| u8::from(z < 4));
    for (name, rows) in [
        ("far.csv", "8,0,0,1\n"),
        ("part.csv", "0.5,0,0,1\n"),
        ("low.csv", "-1,0,0,1\n"),
        ("two.csv", "0,0,0,1\n0,0,0,2\n"),
        ("rgb.csv", "0,0,0,1,2,3\n"),
        ("bright.csv", "0,0,0,256\n"),
        ("words.csv", "a,b\n1,2\n"),
        ("short.csv", "x,y,z\n0,0,0,9\n"),
        ("none.csv", ""),
        ("masked.csv", "0,0,7,1\n"),
    ] {
        fs::write(at(name), rows).unwrap();
    }
    let fixed = |name: &str| vec!["--fixed".to_owned(), at(name)];
    let mask = |name: &str| vec!["--mask".to_owned(), at(name)];
    let said = |words: &[&str]| words.iter().map(|&w| w.to_owned()).collect::<Vec<String>>();
    let cases: Vec<(&str, Vec<String>, i32, &str)> = vec![
        ("flat.png", vec![], 1, "flat.png"),
        ("tiny.png", vec![], 1, "6 x 6"),
        ("missing.png", vec![], 1, "missing.png"),
        ("colours.png", said(&["--kind", "phases"]), 1, "grey"),
        ("layers.png", said(&["--kind", "phases"]), 1, "16"),
        ("layers.png", said(&["--levels", "9"]), 2, "--levels"),
        ("layers.png", said(&["--neighbourhood", "6"]), 2, "--neighbourhood"),
        ("layers.png", said(&["--causal"]), 2, "--causal"),
        ("layers.png", said(&["--views", "4"]), 2, "2 or 3"),
        ("layers.png", mask("open.obj"), 1, "open.obj"),
        ("layers.png", mask("empty.npy"), 1, "empty.npy"),
        ("layers.png", mask("other.npy"), 1, "other.npy"),
        ("layers.png", said(&["--mask", "blob"]), 2, "blob"),
        ("layers.png", fixed("far.csv"), 1, "far.csv"),
        ("layers.png", fixed("part.csv"), 1, "not a voxel"),
        ("layers.png", fixed("low.csv"), 1, "not a voxel"),
        ("layers.png", fixed("two.csv"), 1, "two.csv"),
        ("layers.png", fixed("rgb.csv"), 1, "1 value(s)"),
        ("layers.png", fixed("bright.csv"), 1, "0 to 255"),
        ("layers.png", fixed("words.csv"), 1, "x, y, z"),
        ("layers.png", fixed("short.csv"), 1, "header"),
        ("layers.png", fixed("none.csv"), 1, "no measurement"),
        (
            "layers.png",
            [fixed("masked.csv"), mask("half.npy")].concat(),
            1,
            "masked.csv",
        ),
    ];
    for (image, more, code, part) in cases {
        let image = at(image);
        let more: Vec<&str> = more.iter().map(String::as_str).collect();
        let (found, said, error) = stereology(&[&["exemplar", &image, "--size", "8", "-o", &out], &more[..]].concat());
        assert!(found == code && error.contains(part), "{more:?}: {found} {error}");
        assert!(said.is_empty() && !Path::new(&out).exists());
    }
    for size in ["0", "8,8", "5000", "4096"] {
        let (code, _, error) = stereology(&["exemplar", &layers, "--size", size, "-o", &out]);
        assert!(code == 2 && error.contains("--size"), "{size}: {error}");
    }
    let (code, _, error) = stereology(&["exemplar", &layers, "--size", "8", "-o", &at("o.bmp")]);
    assert!(code == 2 && error.contains("bmp"), "{error}");
    // What is there is not overwritten unless asked.
    fs::write(&out, "mine").unwrap();
    let (code, _, error) = stereology(&["exemplar", &layers, "--size", "8", "-o", &out]);
    assert!(
        code != 0 && error.contains("--force") && fs::read(&out).unwrap() == b"mine",
        "{error}"
    );
}

/// Ctrl-C: exit 130, and nothing is left behind, not even a part.
#[cfg(unix)]
#[test]
fn stopping_leaves_nothing() {
    use std::process::{Command, Stdio};
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_layers(&at("layers.png"));
    for command in [
        vec!["exemplar", "--size", "48", "--iterations", "1000"],
        vec![
            "grow",
            "box:1,1,1",
            "--resolution",
            "60",
            "--search",
            "exact",
            "--window",
            "9",
        ],
    ] {
        let (layers, out) = (at("layers.png"), at("o.npy"));
        let mut arguments = command.clone();
        arguments.insert(if command[0] == "grow" { 2 } else { 1 }, &layers);
        let running = Command::new(assert_cmd::cargo::cargo_bin("stereology"))
            .args(&arguments)
            .args(["-o", &out])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(1500));
        let asked = Command::new("kill")
            .args(["-INT", &running.id().to_string()])
            .status()
            .unwrap();
        assert!(asked.success());
        let ended = running.wait_with_output().unwrap();
        let error = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), Some(130), "{error}");
        let left: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|f| f.unwrap().file_name())
            .collect();
        assert_eq!(left, ["layers.png"], "{error}");
    }
}
