//! From a photograph to a solid, and what can be done with it.

use std::fs;

use crate::{answer, path, stereology, write_discs};

const SMALL: [&str; 10] = [
    "--count",
    "150",
    "--texture-voxels",
    "32",
    "--voxels",
    "24",
    "--bins",
    "5",
    "--iterations",
    "2",
];

#[test]
fn a_small_photograph_becomes_a_solid() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, out, again) = (path(&folder, "discs.png"), path(&folder, "out"), path(&folder, "again"));
    write_discs(&photo);
    let made = answer(&[&["synthesize", &photo, "-o", &out, "--threads", "1"], &SMALL[..]].concat());
    for (step, key) in [
        ("segment", "area_fraction"),
        ("unfold", "total"),
        ("pack", "fraction"),
        ("verification", "size_w1"),
    ] {
        assert!(made[step][key].as_f64().unwrap() > 0.0, "{step}: {made}");
    }
    assert_eq!(made["pack"]["certified"], true);
    assert!(made["seconds"]["pack"].as_f64().unwrap() >= 0.0);

    // The same bytes elsewhere, with other threads; and no time, path or thread count in them.
    let (code, _, error) = stereology(
        &[
            &["synthesize", &photo, "-o", &again, "--threads", "2", "--quiet"],
            &SMALL[..],
        ]
        .concat(),
    );
    assert_eq!(code, 0, "{error}");
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for name in &names {
        let bytes = |folder: &str| fs::read(format!("{folder}/{name}")).unwrap();
        assert!(bytes(&out) == bytes(&again), "{name} differs");
        let place = folder.path().to_str().unwrap().as_bytes();
        assert!(
            !bytes(&out).windows(place.len()).any(|window| window == place),
            "{name} holds a path"
        );
    }
    assert_eq!(
        names,
        [
            ".stereology-files",
            "binder.png",
            "comparison.png",
            "cube.png",
            "densities.csv",
            "labels.tif",
            "means.png",
            "overlay.png",
            "packing.json",
            "profiles.csv",
            "report.html",
            "residual.png",
            "residual.tif",
            "solid.json",
            "steps.json",
            "summary.json",
            "texture.npy",
            "volume.npy",
        ]
    );
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(format!("{out}/summary.json")).unwrap()).unwrap();
    assert!(summary.get("seconds").is_none() && summary["pack"] == made["pack"]);

    // Looked at, cut and exported.
    let cut = answer(&[
        "slice",
        &out,
        "--axis",
        "y",
        "--at",
        "0.3",
        "--size",
        "40",
        "-o",
        &path(&folder, "y.png"),
    ]);
    assert_eq!(cut["width"], 40);
    answer(&[
        "slice",
        &out,
        "--normal",
        "1,1,-1",
        "--offset",
        "3",
        "--size",
        "40",
        "-o",
        &path(&folder, "n.png"),
    ]);
    answer(&["render", &out, "--size", "48", "-o", &path(&folder, "cube.png")]);
    let mesh = path(&folder, "tetrahedron.obj");
    fs::write(
        &mesh,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    )
    .unwrap();
    answer(&[
        "render",
        &out,
        "--mesh",
        &mesh,
        "--camera",
        "1,-2,1",
        "--size",
        "48",
        "-o",
        &path(&folder, "mesh.png"),
    ]);
    for (channel, bytes) in [("rgb", 3), ("id", 4), ("category", 1), ("distance", 4)] {
        for ending in ["npy", "nrrd", "vti", "tif", "h5"] {
            let file = path(&folder, &format!("{channel}.{ending}"));
            answer(&["export", &out, "--voxels", "16", "--channel", channel, "-o", &file]);
            assert!(fs::metadata(&file).unwrap().len() >= 16 * 16 * 16 * bytes);
        }
    }
    // Only --force replaces a folder, and an interrupted write is resumed.
    let zarr = path(&folder, "rgb.zarr");
    answer(&["export", &out, "--voxels", "16", "--resume", "-o", &zarr]);
    let (code, _, error) = stereology(&["export", &out, "--voxels", "16", "-o", &zarr]);
    assert!(code == 1 && error.contains("--force"), "{error}");
    answer(&[
        "export",
        &out,
        "--voxels",
        "16",
        "--samples",
        "2",
        "--force",
        "-o",
        &zarr,
    ]);
    let carved = answer(&[
        "carve",
        &out,
        &mesh,
        "--triangles",
        "5000",
        "-o",
        &path(&folder, "mesh.glb"),
    ]);
    assert!(carved["vertices"].as_u64().unwrap() > 4);
    assert!(fs::read(path(&folder, "mesh.glb")).unwrap().starts_with(b"glTF"));
    assert_eq!(
        stereology(&["carve", &out, &mesh, "-o", &path(&folder, "mesh.obj")]).0,
        2
    );
    let atlas = path(&folder, "atlas.glb");
    let baked = answer(&["carve", &out, &mesh, "--atlas", "64", "-o", &atlas]);
    assert!(baked["texel"].as_f64().unwrap() > 0.0 && fs::read(&atlas).unwrap().starts_with(b"glTF"));
    let ply = path(&folder, "atlas.ply");
    assert_eq!(stereology(&["carve", &out, &mesh, "--atlas", "64", "-o", &ply]).0, 2);
    let (code, _, error) = stereology(&["carve", &out, &mesh, "--atlas", "2", "--force", "-o", &atlas]);
    assert!(code == 1 && error.contains("at least"), "{error}");

    // volume.npy is what export gives.
    answer(&["export", &out, "--voxels", "24", "-o", &path(&folder, "volume.npy")]);
    assert!(fs::read(path(&folder, "volume.npy")).unwrap() == fs::read(format!("{out}/volume.npy")).unwrap());

    // A damaged solid is an error.
    fs::write(format!("{out}/texture.npy"), b"short").unwrap();
    let (code, _, error) = stereology(&["slice", &out, "-o", &path(&folder, "z.png")]);
    assert!(
        code == 1 && error.contains("texture.npy") && !error.contains("panicked"),
        "{error}"
    );
}

#[test]
fn bubbles_are_holes() {
    let folder = tempfile::tempdir().unwrap();
    let (photo, out) = (path(&folder, "discs.png"), path(&folder, "out"));
    write_discs(&photo);
    let (code, _, error) = stereology(&["synthesize", &photo, "-o", &out, "--void", "1"]);
    assert!(code == 2 && error.contains("numbered from 0"), "{code} {error}");
    answer(&[&["synthesize", &photo, "-o", &out, "--void", "0"], &SMALL[..]].concat());
    let file = |name: &str| path(&folder, name);
    for channel in ["alpha", "category"] {
        answer(&[
            "export",
            &out,
            "--voxels",
            "24",
            "--channel",
            channel,
            "-o",
            &file(&format!("{channel}.npy")),
        ]);
    }
    let [alpha, category] = ["alpha.npy", "category.npy"].map(|name| fs::read(file(name)).unwrap());
    let from = alpha.len() - 24 * 24 * 24;
    assert!(
        alpha[from..]
            .iter()
            .zip(&category[from..])
            .all(|(alpha, category)| (*alpha == 0) == (*category > 0))
    );
    assert!(alpha[from..].contains(&0) && alpha[from..].contains(&255));
    let turned = answer(&[
        "render",
        &out,
        "--size",
        "40",
        "--turntable",
        "3",
        "--samples",
        "1",
        "-o",
        &file("t.png"),
    ]);
    assert_eq!(turned["pictures"], 3);
    for frame in ["t_000.png", "t_001.png", "t_002.png"] {
        assert_eq!(image::open(file(frame)).unwrap().width(), 40);
    }
}
