//! Errors are one message with exit code 1 (2 for wrong usage), never a panic or a partial file.

use std::fs;

use crate::{answer, path, stereology, write_discs};

/// Runs, expects a refusal, gives the message.
fn refused(code: i32, arguments: &[&str]) -> String {
    let (found, out, error) = stereology(arguments);
    assert_eq!(found, code, "{arguments:?}: {error}");
    assert_eq!(out, "");
    assert!(
        error.len() > 20 && !error.contains("panicked"),
        "{arguments:?}: {error}"
    );
    error
}

#[test]
fn pictures_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    write_discs(at("whole.png"));
    let whole = fs::read(at("whole.png")).unwrap();
    fs::write(at("empty.png"), b"").unwrap();
    fs::write(at("text.jpg"), b"hello").unwrap();
    fs::write(at("cut.png"), &whole[..whole.len() / 2]).unwrap();
    image::RgbImage::new(1, 1).save(at("one.png")).unwrap();
    image::RgbImage::from_pixel(64, 64, image::Rgb([9, 9, 9]))
        .save(at("flat.png"))
        .unwrap();
    for name in ["missing.png", "empty.png", "text.jpg", "cut.png", "one.png", "flat.png"] {
        let out = at(&format!("out_{name}"));
        let message = refused(1, &["segment", &at(name), "-o", &out]);
        assert!(message.contains(name), "{message}");
        refused(1, &["texture", &at(name), "--size", "7", "-o", &at("t.npy")]);
        if name != "flat.png" {
            refused(1, &["pyramid", &at(name)]);
        }
    }
    let left: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert_eq!(left.len(), 6, "nothing half-written stays: {left:?}");
}

#[test]
fn tables_that_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let table = path(&folder, "profiles.csv");
    for text in [
        "1\n2\n",
        "size\nnan\n",
        "size\n-1\n",
        "size\n",
        "size\nabc\n",
        "size\n1e400\n",
        "",
        "size,weight\n1,0\n",
    ] {
        fs::write(&table, text).unwrap();
        let message = refused(1, &["unfold", &table, "--area", "100"]);
        assert!(message.contains("profiles.csv"), "{message}");
    }
    fs::write(&table, "size\n1\n2\n3\n").unwrap();
    for area in ["--area=0", "--area=-3", "--area=nan", "--area=inf"] {
        assert!(refused(2, &["unfold", &table, area]).contains("above zero"));
    }
    refused(2, &["unfold", &table, "--area", "10", "--bins", "0"]);
    refused(2, &["unfold", &table, "--area", "10", "--edges", "3,2"]);
    refused(2, &["unfold", &table, "--area", "10", "--shape", "blob"]);
    refused(2, &["unfold", &table, "--area", "10", "--shape", "box:1,-2,3"]);
    refused(1, &["unfold", &table, "--area", "10", "--max-size", "2"]);
    refused(1, &["unfold", &table, "--area", "10", "--min-size", "5"]);
    fs::write(&table, "size,type\n1,0\n2,7\n").unwrap();
    assert!(refused(1, &["unfold", &table, "--area", "10"]).contains("type 7"));
    assert!(refused(1, &["unfold", "nowhere.csv", "--area", "10"]).contains("nowhere.csv"));
}

#[test]
fn meshes_that_enclose_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = path(&folder, "mesh.obj");
    for text in [
        "",
        "hello\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 nan\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    ] {
        fs::write(&mesh, text).unwrap();
        refused(1, &["kmatrix", &mesh]);
    }
    // Two boxes that overlap: closed and manifold by their edges.
    let boxes = [0.0, 0.4].map(|shift| {
        (0..8)
            .map(move |i| {
                format!(
                    "v {} {} {}\n",
                    f64::from(i & 1) + shift,
                    f64::from(i >> 1 & 1) + shift,
                    f64::from(i >> 2)
                )
            })
            .collect::<String>()
    });
    let faces = |first: usize| {
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        quads
            .map(|q| {
                format!(
                    "f {} {} {} {}\n",
                    q[0] + first,
                    q[1] + first,
                    q[2] + first,
                    q[3] + first
                )
            })
            .concat()
    };
    fs::write(&mesh, format!("{}{}{}{}", boxes[0], boxes[1], faces(1), faces(9))).unwrap();
    assert!(refused(1, &["kmatrix", &mesh]).contains("cuts through itself"));
    refused(1, &["kmatrix", &path(&folder, "missing.stl")]);
    refused(2, &["kmatrix", "donut"]);
    let out = path(&folder, "out.obj");
    refused(2, &["shape", "donut", "-o", &out]);
    refused(2, &["shape", "rock:1,7", "-o", &out]);
    refused(2, &["shape", "box:1,1,1", "-o", &path(&folder, "out.json")]);
    refused(2, &["shape", "sphere", "-o", &path(&folder, "out.xyz")]);
    refused(1, &["shape", &mesh, "-o", &out]);
    assert!(!std::path::Path::new(&out).exists());
    refused(2, &["kmatrix", "sphere", "--tolerance", "0"]);
}

#[test]
fn more_than_fits() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(&folder, "packing.json");
    refused(
        1,
        &["pack", "--constant", "--count", "100", "--fraction", "0.9", "-o", &out],
    );
    refused(2, &["pack", "--constant", "--fraction", "1.5", "-o", &out]);
    refused(2, &["pack", "-o", &out]);
    refused(2, &["pack", "--constant", "--also", "a.doc", "-o", &out]);
    refused(1, &["pack", "--densities", "nowhere.csv", "-o", &out]);
    let picture = path(&folder, "discs.png");
    write_discs(&picture);
    let volume = path(&folder, "t.npy");
    refused(1, &["texture", &picture, "--size", "1000000", "-o", &volume]);
    refused(2, &["texture", &picture, "--size", "32", "-o", &path(&folder, "t.raw")]);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "only the picture");
}

#[test]
fn outputs_in_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let photo = path(&folder, "discs.png");
    write_discs(&photo);
    let file = path(&folder, "file");
    fs::write(&file, "precious").unwrap();
    assert!(refused(1, &["segment", &photo, "-o", &file]).contains("is a file"));
    assert_eq!(fs::read_to_string(&file).unwrap(), "precious");
    assert!(
        refused(
            1,
            &["pack", "--constant", "--count", "8", "--fraction", "0.1", "-o", &file]
        )
        .contains("--force")
    );

    let out = path(&folder, "out");
    assert_eq!(stereology(&["segment", &photo, "-o", &out]).0, 0);
    assert!(refused(1, &["segment", &photo, "-o", &out]).contains("--force"));
    assert_eq!(stereology(&["segment", &photo, "-o", &out, "--force"]).0, 0);
    refused(1, &["slice", &out, "-o", &path(&folder, "s.png")]);
    refused(
        1,
        &[
            "export",
            &path(&folder, "nowhere"),
            "--voxels",
            "8",
            "-o",
            &path(&folder, "v.npy"),
        ],
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

/// What a texture cannot be made of or made to is said with its numbers; what can be mended is mended and said.
#[test]
fn textures_out_of_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| path(&folder, name);
    image::RgbImage::from_fn(7, 20, |x, y| image::Rgb([(31 * x + 17 * y) as u8; 3]))
        .save(at("narrow.png"))
        .unwrap();
    let error = refused(1, &["texture", &at("narrow.png"), "--size", "16", "-o", &at("a.npy")]);
    assert!(error.contains("20 x 7") && error.contains("8 x 8"), "{error}");
    let error = refused(1, &["pyramid", &at("narrow.png"), "--levels", "1"]);
    assert!(error.contains('7'), "{error}");

    write_discs(at("discs.png"));
    let error = refused(1, &["texture", &at("discs.png"), "--size", "4000", "-o", &at("a.npy")]);
    let bytes = error.split_whitespace().filter_map(|word| word.parse::<u128>().ok());
    assert!(bytes.max() > Some(10_u128.pow(12)), "{error}");
    let error = refused(
        1,
        &["texture", &at("discs.png"), "--size", "16,7,16", "-o", &at("a.npy")],
    );
    assert!(error.contains("at least 8"), "{error}");

    let warned = |picture: &str, levels: &str, code: &str| {
        let (file, out) = (at(picture), at(&format!("{code}.npy")));
        let made = answer(&[
            "texture",
            &file,
            "--size",
            "16",
            "--iterations",
            "1",
            "--levels",
            levels,
            "-o",
            &out,
        ]);
        assert_eq!(made["warnings"][0]["code"], code, "{made}");
        made
    };
    let made = warned("discs.png", "30", "levels-reduced");
    assert_eq!(made["levels"], 2);
    image::RgbImage::from_pixel(20, 20, image::Rgb([90, 140, 40]))
        .save(at("flat.png"))
        .unwrap();
    warned("flat.png", "1", "constant-exemplar");
    // One channel constant, the others not.
    image::RgbImage::from_fn(20, 20, |x, y| {
        image::Rgb([(31 * x + 17 * y * y) as u8, 128, (7 * x * y) as u8])
    })
    .save(at("green.png"))
    .unwrap();
    answer(&[
        "texture",
        &at("green.png"),
        "--size",
        "16",
        "--iterations",
        "1",
        "-o",
        &at("green.npy"),
    ]);
    let volume = fs::read(at("green.npy")).unwrap();
    let values = &volume[volume.len() - 16 * 16 * 16 * 3..];
    assert!(values.chunks(3).all(|colour| colour[1] == 128));
}
