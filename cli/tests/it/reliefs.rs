//! Contact distributions, displacement, exploration.

use std::fs;

use crate::{answer, path, stereology};

/// Light discs on a dark ground.
fn write_dots(file: &str) {
    image::GrayImage::from_fn(96, 96, |x, y| {
        let inside = (f64::from(x % 24) - 11.5).hypot(f64::from(y % 24) - 11.5) < 8.0;
        image::Luma([if inside { 220 } else { 40 }])
    })
    .save(file)
    .unwrap();
}

#[test]
fn from_a_picture_to_a_relief() {
    let folder = tempfile::tempdir().unwrap();
    let [picture, contact, ball, relief, labels, design, again] = [
        "dots.png",
        "c.json",
        "ball.obj",
        "relief.ply",
        "labels.csv",
        "design.json",
        "again.glb",
    ]
    .map(|name| path(&folder, name));
    write_dots(&picture);
    let measured = answer(&["contact", &picture, "-o", &contact]);
    let share = measured["positive_share"].as_f64().unwrap();
    assert!((share - std::f64::consts::PI * 64.0 / 576.0).abs() < 0.02, "{share}");
    answer(&["shape", "sphere", "--subdivide", "4", "-o", &ball]);
    let made = answer(&[
        "displace",
        &ball,
        "--contact",
        &contact,
        "--units",
        "30",
        "--labels-out",
        &labels,
        "--design-out",
        &design,
        "-o",
        &relief,
    ]);
    let triangles = made["triangles"].as_u64().unwrap();
    assert!(made["violations"] == 0 && made["left_over_fraction"].as_f64().unwrap() < 0.005);
    assert!(made["emd_labels"].as_f64().unwrap() < 0.1 && made["seconds"].is_f64());
    let text = fs::read_to_string(&labels).unwrap();
    assert!(text.starts_with("triangle,label\n0,") && text.lines().count() as u64 == triangles + 1);
    assert!(fs::read(&relief).unwrap().starts_with(b"ply"));
    // The design alone makes the same; another seed another; paper and colours too.
    let repeat = |more: &[&str]| {
        let labels = path(&folder, "more.csv");
        answer(
            &[
                &[
                    "displace",
                    &ball,
                    "--design",
                    &design,
                    "--labels-out",
                    &labels,
                    "-o",
                    &again,
                    "--force",
                ],
                more,
            ]
            .concat(),
        );
        fs::read_to_string(labels).unwrap()
    };
    assert_eq!(repeat(&["--threads", "1"]), text);
    assert_ne!(repeat(&["--seed", "9"]), text);
    assert_ne!(repeat(&["--method", "paper", "--colours", "label"]), text);
    assert_ne!(repeat(&["--stretch", "0,0,1,3", "--triangles", "1000"]), text);
    assert!(fs::read(&again).unwrap().starts_with(b"glTF"));
    // Finer triangles, and labels for all of them.
    let fine = answer(&[
        "displace",
        &ball,
        "--contact",
        &contact,
        "--preset",
        "fig8-coral",
        "--edge-length",
        "0.02",
        "-o",
        &again,
        "--force",
    ]);
    assert!(fine["triangles"].as_u64().unwrap() > triangles);
}

#[test]
fn distributions_from_formulas_and_edited() {
    let folder = tempfile::tempdir().unwrap();
    let [laws, edited] = ["laws.json", "edited.json"].map(|name| path(&folder, name));
    let made = answer(&[
        "contact",
        "--negative-law",
        "exponential:2",
        "--positive-law",
        "disc:4",
        "--share",
        "0.25",
        "-o",
        &laws,
    ]);
    assert!((made["positive_share"].as_f64().unwrap() - 0.25).abs() < 1e-9);
    let made = answer(&[
        "contact", &laws, "--edit", "0=0", "--edit", "-1=0", "--invert", "-o", &edited,
    ]);
    assert_eq!(
        (made["negative"][0].as_f64(), made["positive"][0].as_f64()),
        (Some(0.0), Some(0.0))
    );
    // A volume of pores.
    let volume = path(&folder, "v.npy");
    let bytes: Vec<u8> = (0..1000_u32).map(|i| if i % 10 < 4 { 200 } else { 10 }).collect();
    let mut header =
        b"\x93NUMPY\x01\x00\x76\x00{'descr': '|u1', 'fortran_order': False, 'shape': (10, 10, 10), }".to_vec();
    header.resize(127, b' ');
    header.push(b'\n');
    fs::write(&volume, [header, bytes].concat()).unwrap();
    let made = answer(&["contact", &volume, "-o", &edited, "--force"]);
    assert!((made["positive_share"].as_f64().unwrap() - 0.4).abs() < 1e-9 && made["pixels"] == 1000);
}

#[test]
fn a_gallery_opens_from_disk() {
    let folder = tempfile::tempdir().unwrap();
    let [ball, gallery, closer] = ["ball.obj", "gallery", "closer"].map(|name| path(&folder, name));
    answer(&["shape", "sphere", "--subdivide", "3", "-o", &ball]);
    let made = answer(&["explore", &ball, "--count", "3", "--pixels", "32", "-o", &gallery]);
    assert_eq!(made["candidates"], 3);
    let page = fs::read_to_string(format!("{gallery}/index.html")).unwrap();
    assert!(page.contains("\"name\":\"0003\"") && !page.contains("/*DATA*/") && !page.contains("http"));
    assert!(fs::metadata(format!("{gallery}/pictures/0002.png")).unwrap().len() > 100);
    let design = format!("{gallery}/designs/0002.json");
    let relief = path(&folder, "relief.obj");
    answer(&["displace", &ball, "--design", &design, "-o", &relief]);
    answer(&[
        "explore", &ball, "--count", "2", "--pixels", "32", "--near", &design, "--spread", "0.1", "-o", &closer,
    ]);
    // The same seed, the same bytes.
    let twin = path(&folder, "twin");
    answer(&[
        "explore",
        &ball,
        "--count",
        "3",
        "--pixels",
        "32",
        "-o",
        &twin,
        "--threads",
        "1",
    ]);
    for name in ["pictures/0001.png", "designs/0003.json", "index.html"] {
        assert_eq!(
            fs::read(format!("{gallery}/{name}")).unwrap(),
            fs::read(format!("{twin}/{name}")).unwrap(),
            "{name}"
        );
    }
}

#[test]
fn bad_distributions_and_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [contact, mesh, out, white] = ["c.json", "m.obj", "o.ply", "w.png"].map(|name| path(&folder, name));
    fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let refused = |text: &str, words: &[&str]| {
        let (code, out, error) = stereology(words);
        assert_eq!((code, out.as_str()), (1, ""), "{words:?}: {error}");
        assert!(error.contains(text), "{error}");
    };
    let displace: &[&str] = &["displace", &mesh, "--contact", &contact, "--units", "10", "-o", &out];
    fs::write(&contact, r#"{"bin_width": 1, "negative": [1], "positive": [1]}"#).unwrap();
    refused("refine the mesh", displace);
    for (text, what) in [
        ("", "contact distribution"),
        (r#"{"bin_width": 1, "negative": [], "positive": []}"#, "empty"),
        (r#"{"bin_width": 1, "negative": [-1], "positive": [2]}"#, "not negative"),
        (r#"{"bin_width": 0, "negative": [1], "positive": [2]}"#, "width"),
        (
            r#"{"bin_width": 1, "negative": [null], "positive": [2]}"#,
            "contact distribution",
        ),
    ] {
        fs::write(&contact, text).unwrap();
        refused(what, displace);
    }
    image::GrayImage::from_pixel(8, 8, image::Luma([255]))
        .save(&white)
        .unwrap();
    refused("same grey value", &["contact", &white, "-o", &path(&folder, "x.json")]);
    for wrong in [
        &["displace", &mesh, "-o", &out] as &[&str],
        &["displace", &mesh, "--contact", &contact, "--units", "-1", "-o", &out],
        &[
            "displace",
            &mesh,
            "--contact",
            &contact,
            "--units",
            "5",
            "--negative",
            "up,1,x",
            "-o",
            &out,
        ],
        &[
            "displace",
            &mesh,
            "--contact",
            &contact,
            "--preset",
            "nonsense",
            "-o",
            &out,
        ],
        &["contact", "-o", &out],
        &["explore", &mesh, "--units", "9,3", "-o", "g"],
    ] {
        let (code, _, error) = stereology(wrong);
        assert_eq!(code, 2, "{wrong:?}: {error}");
    }
}
