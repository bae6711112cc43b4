//! Labels of the same two profiles in the many ways in which tools write them.

use image::{GrayImage, Luma, Rgb, RgbImage, Rgba, RgbaImage};
use ndarray::Array2;
use stereology_segment::{
    EdgeRule, Exif, Holes, LabelFile, PhotoFile, PhotoOptions, SegmentError, SegmentOptions, Segmentation,
    read_label_file, read_labels_for, read_photo_with, segment, write_labels,
};

use crate::made_files::{MadePage, PLAIN, archive, npy, roi};

const SIZE: (usize, usize) = (40, 60);

/// A square of 20 pixels and one of 10.
fn squares() -> Array2<u32> {
    Array2::from_shape_fn(SIZE, |(y, x)| match (x, y) {
        (5..25, 5..25) => 1,
        (40..50, 10..20) => 2,
        _ => 0,
    })
}

/// A photo of these squares.
fn photo() -> RgbImage {
    let labels = squares();
    RgbImage::from_fn(SIZE.1 as u32, SIZE.0 as u32, |x, y| {
        match labels[[y as usize, x as usize]] {
            1 => Rgb([170, 90, 60]),
            2 => Rgb([40, 60, 160]),
            _ => Rgb([205, 205, 200]),
        }
    })
}

fn read(bytes: &[u8]) -> Result<LabelFile, SegmentError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("labels");
    std::fs::write(&file, bytes).unwrap();
    read_labels_for(&file, SIZE)
}

/// Areas of the profiles, increasing, and the codes of all findings on the labels.
fn imported(bytes: &[u8], options: &SegmentOptions) -> Result<(Vec<f64>, Vec<&'static str>), SegmentError> {
    let read = read(bytes)?;
    let found = Segmentation::from_labels(&photo(), read.labels, options)?;
    let mut areas: Vec<f64> = found.profiles.iter().map(|p| p.area).collect();
    areas.sort_by(f64::total_cmp);
    let of_labels = ["few-profiles", "edge-heavy", "area-fraction", "near-minimum"];
    let codes = read.findings.iter().chain(&found.findings).map(|f| f.code);
    Ok((areas, codes.filter(|code| !of_labels.contains(code)).collect()))
}

#[track_caller]
fn assert_squares(bytes: &[u8], expected: &[&str]) {
    let (areas, codes) = imported(bytes, &SegmentOptions::default()).unwrap();
    assert_eq!((areas, codes.as_slice()), (vec![100.0, 400.0], expected));
}

fn saved(image: &dyn Fn(&std::path::Path) -> image::ImageResult<()>, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    image(&file).unwrap();
    std::fs::read(&file).unwrap()
}

fn coloured(name: &str, colour: impl Fn(u32) -> [u8; 3]) -> Vec<u8> {
    let labels = squares();
    let image = RgbImage::from_fn(60, 40, |x, y| Rgb(colour(labels[[y as usize, x as usize]])));
    saved(&|file| image.save(file), name)
}

/// One colour is one label: COCO's panoptic maps, and those of Segment Anything on white or on nothing.
#[test]
fn colours_are_labels() {
    let on = |ground: [u8; 3]| move |l: u32| [ground, [120, 7, 200], [3, 90, 90]][l as usize];
    for name in ["l.png", "l.bmp", "l.webp", "l.tif", "l.gif"] {
        assert_squares(&coloured(name, on([0; 3])), &["colour-labels"]);
        assert_squares(&coloured(name, on([255; 3])), &["colour-labels"]);
        // Grey levels in three channels are numbers.
        assert_squares(&coloured(name, |l| [l as u8; 3]), &[]);
    }
    let labels = squares();
    let clear = RgbaImage::from_fn(60, 40, |x, y| {
        Rgba([[0, 0, 0, 0], [9, 200, 7, 90], [250, 9, 9, 90]][labels[[y as usize, x as usize]] as usize])
    });
    assert_squares(&saved(&|file| clear.save(file), "l.png"), &["colour-labels"]);
    let id = read(&coloured("l.png", |l| [[0; 3], [1, 2, 3], [4, 0, 0]][l as usize])).unwrap();
    assert_eq!(id.labels[[10, 10]], 1 + 256 * 2 + 65_536 * 3);
}

/// Photos and blended colours are no label maps, and JPEGs cannot be.
#[test]
fn blended_colours_are_refused() {
    let noise = RgbImage::from_fn(60, 40, |x, y| Rgb([(x * 4) as u8, (y * 6) as u8, (x * y) as u8]));
    for (name, what) in [("l.png", "colours"), ("l.jpg", "JPEG")] {
        let refused = read(&saved(&|file| noise.save(file), name)).unwrap_err().to_string();
        assert!(refused.contains(what), "{refused}");
    }
}

/// A binary mask is divided into connected components, and that is said.
#[test]
fn masks_are_divided() {
    let labels = squares();
    for value in [1, 255] {
        let mask = GrayImage::from_fn(60, 40, |x, y| {
            Luma([if labels[[y as usize, x as usize]] > 0 { value } else { 0 }])
        });
        assert_squares(&saved(&|file| mask.save(file), "m.png"), &["mask-split"]);
    }
    let bytes: Vec<u8> = labels.iter().map(|l| u8::from(*l > 0)).collect();
    assert_squares(&npy("|b1", [40, 60], &bytes), &["mask-split"]);
}

/// OpenCV's watershed: -1 at borders, 1 the background. Missing numbers are the binder.
#[test]
fn watershed_markers() {
    let bytes = |of: &dyn Fn(usize, usize, u32) -> i32| -> Vec<u8> {
        squares()
            .indexed_iter()
            .flat_map(|((y, x), l)| of(y, x, *l).to_le_bytes())
            .collect()
    };
    let markers = bytes(&|y, x, l| if x == 0 || y == 0 { -1 } else { l as i32 + 1 });
    assert_squares(&npy("<i4", [40, 60], &markers), &["binder-numbers"]);
    let page = MadePage::new(60, 40, &[(258, &[32]), (262, &[1]), (339, &[2])], vec![markers]);
    assert_squares(&PLAIN.file(&[page]), &["binder-numbers"]);
    // Without a background, 1 is a label like others.
    let unlabelled = bytes(&|y, x, l| if x == 0 || y == 0 { -1 } else { l as i32 });
    assert_squares(&npy("<i4", [40, 60], &unlabelled), &["binder-numbers"]);
    let negative = bytes(&|_, _, l| l as i32 - 3);
    assert!(read(&npy("<i4", [40, 60], &negative)).is_err());
    let nan: Vec<u8> = squares()
        .iter()
        .flat_map(|l| if *l == 0 { f32::NAN } else { *l as f32 }.to_le_bytes())
        .collect();
    assert_squares(&npy("<f4", [40, 60], &nan), &["binder-numbers"]);
}

/// Samples of other sizes in TIFFs and arrays; halves hold small labels exactly.
#[test]
fn other_numbers() {
    // 1 and 2 as floating point of 16 bits.
    let halves: Vec<u8> = squares()
        .iter()
        .flat_map(|l| [0_u16, 0x3c00, 0x4000][*l as usize].to_le_bytes())
        .collect();
    assert_squares(&npy("<f2", [40, 60], &halves), &[]);
    let page = |bits: &'static [u32], kind: &'static [u32], chunk| {
        PLAIN.file(&[MadePage::new(
            60,
            40,
            &[(258, bits), (262, &[1]), (339, kind)],
            vec![chunk],
        )])
    };
    assert_squares(&page(&[16], &[3], halves), &[]);
    let long = squares().iter().flat_map(|l| u64::from(*l).to_le_bytes()).collect();
    assert_squares(&page(&[64], &[1], long), &[]);
    let two: Vec<u8> = squares()
        .iter()
        .collect::<Vec<_>>()
        .chunks(4)
        .map(|c| c.iter().fold(0, |b, l| b << 2 | **l as u8))
        .collect();
    assert_squares(&page(&[2], &[1], two), &[]);
}

/// Of several pages, that of the photo's size holds the labels.
#[test]
fn the_page_of_the_photos_size() {
    let grey = |h: u32, w: u32, chunk: Vec<u8>| MadePage::new(w, h, &[(258, &[8]), (262, &[1])], vec![chunk]);
    let labels: Vec<u8> = squares().iter().map(|l| *l as u8).collect();
    let pages = [
        grey(10, 15, vec![3; 150]),
        grey(40, 60, labels.clone()),
        grey(80, 120, vec![4; 9600]),
    ];
    assert_squares(&PLAIN.file(&pages), &["main-page"]);
    let refused = read(&PLAIN.file(&[grey(20, 30, vec![1; 600])]))
        .unwrap_err()
        .to_string();
    assert!(refused.contains("30x20") && refused.contains("60x40"), "{refused}");
    // Two planes without opacity: which one?
    let planes = MadePage::new(
        60,
        40,
        &[(258, &[8]), (262, &[1]), (277, &[2]), (284, &[2])],
        vec![labels.clone(), labels],
    );
    assert!(
        read(&PLAIN.file(&[planes]))
            .unwrap_err()
            .to_string()
            .contains("2 channels")
    );
}

/// Labels drawn on the pixels as stored are turned with a photo that is turned upright, whichever way it is.
#[test]
fn labels_of_stored_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let (file, labels) = (folder.path().join("photo.tif"), folder.path().join("labels.tif"));
    write_labels(&labels, squares().view()).unwrap();
    let stored = photo();
    let open = |orientation: u32, exif| -> PhotoFile {
        let fields: [(u16, &[u32]); 4] = [(258, &[8; 3]), (262, &[2]), (277, &[3]), (274, &[orientation])];
        std::fs::write(
            &file,
            PLAIN.file(&[MadePage::new(60, 40, &fields, vec![stored.clone().into_raw()])]),
        )
        .unwrap();
        read_photo_with(
            &file,
            &PhotoOptions {
                exif,
                ..PhotoOptions::default()
            },
        )
        .unwrap()
    };
    for orientation in 2..=8 {
        let photo = open(orientation, Exif::Auto);
        let read = photo.labels(&labels).unwrap();
        assert_eq!(
            read.findings.iter().map(|f| f.code).collect::<Vec<_>>(),
            ["labels-turned"],
            "{orientation}"
        );
        for (label, pixel) in read.labels.iter().zip(photo.photo.pixels()) {
            assert_eq!(*label == 1, pixel.0 == [170, 90, 60], "{orientation}");
        }
        // Nothing is turned if the pixels are taken as stored.
        let photo = open(orientation, Exif::Ignore);
        let read = photo.labels(&labels).unwrap();
        assert_eq!((read.labels, read.findings.len()), (squares(), 0));
    }
    // Labels of the upright photo stay as they are.
    let upright = Array2::from_shape_fn(SIZE, |(y, x)| squares()[[39 - y, 59 - x]]);
    write_labels(&labels, upright.view()).unwrap();
    let read = open(3, Exif::Auto).labels(&labels).unwrap();
    assert_eq!((read.labels, read.findings.len()), (upright, 0));
}

/// Where a photo shows nothing of the labels, they stay, and a finding says that it could not be seen.
#[test]
fn labels_of_a_blank_photo() {
    let folder = tempfile::tempdir().unwrap();
    let (file, labels) = (folder.path().join("photo.tif"), folder.path().join("labels.tif"));
    write_labels(&labels, squares().view()).unwrap();
    let page = MadePage::new(60, 40, &[(258, &[8]), (262, &[1]), (274, &[3])], vec![vec![90; 2400]]);
    std::fs::write(&file, PLAIN.file(&[page])).unwrap();
    let read = read_photo_with(&file, &PhotoOptions::default())
        .unwrap()
        .labels(&labels)
        .unwrap();
    assert_eq!((read.labels, read.findings[0].code), (squares(), "exif-orientation"));
}

fn square(x: f64, y: f64, side: f64) -> String {
    let (r, b) = (x + side, y + side);
    format!("[[[{x},{y}],[{r},{y}],[{r},{b}],[{x},{b}],[{x},{y}]]]")
}

/// GeoJSON in collections, lists and lines; what has no area is left out, what extends beyond the photo is clipped.
#[test]
fn geojson_kinds() {
    let feature = |polygon: &str, more: &str| {
        format!(r#"{{"type":"Feature"{more},"geometry":{{"type":"Polygon","coordinates":{polygon}}}}}"#)
    };
    let [large, small] = [square(4.5, 4.5, 20.0), square(39.5, 9.5, 10.0)];
    let both = [feature(&large, ""), feature(&small, "")];
    assert_squares(format!("[{}]", both.join(",")).as_bytes(), &[]);
    assert_squares(both.join("\n").as_bytes(), &[]);
    assert_squares(format!("\u{1e}{}\n\u{1e}{}\n", both[0], both[1]).as_bytes(), &[]);
    let geometries = both.clone().map(|f| {
        f.split_once("\"geometry\":")
            .unwrap()
            .1
            .strip_suffix('}')
            .unwrap()
            .to_owned()
    });
    assert_squares(
        format!(r#"{{"type":"Feature","geometry":{}}}{}"#, geometries[0], geometries[1]).as_bytes(),
        &[],
    );
    let empty = r#"{"type":"Feature","geometry":null,"properties":{}}"#;
    let point = r#"{"type":"Feature","geometry":{"type":"Point","coordinates":[1,2]}}"#;
    let collection = format!(
        r#"{{"type":"FeatureCollection","features":[{empty},{},{point},{}]}}"#,
        both[0], both[1]
    );
    assert_squares(collection.as_bytes(), &["lost-labels"]);
    // QuPath's pixel corners are at whole numbers.
    let qupath = [square(5.0, 5.0, 20.0), square(40.0, 10.0, 10.0)]
        .map(|p| feature(&p, r#","properties":{"objectType":"annotation"}"#));
    assert_squares(format!("[{}]", qupath.join(",")).as_bytes(), &[]);
    let over = [feature(&square(-15.5, 4.5, 30.0), ""), both[1].clone()];
    let (areas, codes) = imported(format!("[{}]", over.join(",")).as_bytes(), &SegmentOptions::default()).unwrap();
    assert_eq!((areas, codes), (vec![100.0, 450.0], vec!["clipped-outlines"]));
    for (bad, what) in [
        (point, "points"),
        (r#"{"hello": 1}"#, "hello"),
        (empty, "without a geometry"),
    ] {
        let refused = read(bad.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains(what), "{refused}");
    }
}

/// COCO with ids as text, without sizes, as runs, in several parts, and as a list of results.
#[test]
fn coco_kinds() {
    let ring = |x: u32, y: u32, side: u32| format!("[{x},{y},{0},{y},{0},{1},{x},{1}]", x + side, y + side);
    let file = |image: &str, annotations: &[String]| {
        format!(r#"{{"images":[{image}],"annotations":[{}]}}"#, annotations.join(","))
    };
    let annotation =
        |id: &str, segmentation: &str| format!(r#"{{"id":{id},"image_id":"7","segmentation":{segmentation}}}"#);
    // Runs down the columns of 40 rows.
    let runs = |x: usize, y: usize, side: usize| {
        let mut counts = vec![x * 40 + y];
        for _ in 1..side {
            counts.extend([side, 40 - side]);
        }
        counts.push(side);
        format!(r#"{{"size":[40,60],"counts":{counts:?}}}"#)
    };
    let large = annotation("\"a\"", &format!("[{}]", ring(5, 5, 20)));
    let small = annotation("\"b\"", &runs(40, 10, 10));
    let sized = r#"{"id":"7","width":60,"height":40,"file_name":"p.png"}"#;
    assert_squares(file(sized, &[large.clone(), small.clone()]).as_bytes(), &[]);
    assert_squares(file(r#"{"id":7}"#, &[large.clone(), small.clone()]).as_bytes(), &[]);
    assert_squares(format!("[{large},{small}]").as_bytes(), &[]);
    let parts = annotation("3", "[[5,5,15,5,15,25,5,25],[15,5,25,5,25,25,15,25]]");
    assert_squares(file(sized, &[parts, small.clone()]).as_bytes(), &[]);
    let other = r#"{"id":"8","width":9,"height":9}"#;
    let elsewhere = format!(r#"{{"id":5,"image_id":"8","segmentation":[{}]}}"#, ring(0, 0, 4));
    let both = format!("{sized},{other}");
    assert_squares(file(&both, &[large.clone(), elsewhere, small.clone()]).as_bytes(), &[]);
    let only_box = r#"{"id":9,"image_id":"7","bbox":[1,1,4,4]}"#.to_owned();
    assert_squares(
        file(sized, &[large.clone(), only_box.clone(), small]).as_bytes(),
        &["lost-labels"],
    );
    for (bad, what) in [
        (file(sized, &[only_box]), "boxes"),
        (file(other, std::slice::from_ref(&large)), "9x9"),
        (file(&format!("{sized},{sized}"), &[large]), "2 images"),
        (
            r#"{"annotations":[{"segments_info":[],"file_name":"p.png"}]}"#.to_owned(),
            "panoptic",
        ),
    ] {
        let refused = read(bad.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains(what), "{refused}");
    }
}

/// Shapes of LabelMe, of which a group is one profile; regions of VIA in its project, its export and its old form.
#[test]
fn labelme_and_via() {
    let shape = |kind: &str, points: &str, group: &str| {
        format!(r#"{{"label":"g","shape_type":"{kind}","group_id":{group},"points":{points}}}"#)
    };
    let labelme = |shapes: &[String]| {
        format!(
            r#"{{"version":"5","imageHeight":40,"imageWidth":60,"shapes":[{}]}}"#,
            shapes.join(",")
        )
    };
    let polygon = shape("polygon", "[[5,5],[25,5],[25,25],[5,25]]", "null");
    let small = shape("rectangle", "[[40,10],[50,20]]", "null");
    assert_squares(labelme(&[polygon.clone(), small.clone()]).as_bytes(), &[]);
    let halves = [
        shape("rectangle", "[[5,5],[15,25]]", "4"),
        shape("rectangle", "[[15,5],[25,25]]", "4"),
        small,
    ];
    assert_squares(labelme(&halves).as_bytes(), &[]);
    let line = shape("linestrip", "[[1,1],[5,9]]", "null");
    let circle = shape("circle", "[[45,20],[50,20]]", "null");
    let (areas, codes) = imported(labelme(&[polygon, circle, line]).as_bytes(), &SegmentOptions::default()).unwrap();
    assert!(
        (areas[0] - 25.0 * std::f64::consts::PI).abs() < 4.0 && codes == ["lost-labels"],
        "{areas:?} {codes:?}"
    );
    let regions = [
        r#"{"shape_attributes":{"name":"polygon","all_points_x":[5,25,25,5],"all_points_y":[5,5,25,25]}}"#,
        r#"{"shape_attributes":{"name":"rect","x":40,"y":10,"width":10,"height":10}}"#,
    ];
    let of = |regions: &str| format!(r#"{{"p.png123":{{"filename":"p.png","size":123,"regions":{regions}}}}}"#);
    let list = of(&format!("[{}]", regions.join(",")));
    assert_squares(list.as_bytes(), &[]);
    assert_squares(
        of(&format!(r#"{{"0":{},"1":{}}}"#, regions[0], regions[1])).as_bytes(),
        &[],
    );
    assert_squares(
        format!(r#"{{"_via_settings":{{}},"_via_img_metadata":{list}}}"#).as_bytes(),
        &[],
    );
    let ellipse = of(r#"[{"shape_attributes":{"name":"ellipse","cx":30,"cy":20,"rx":12,"ry":6,"theta":0.3}}]"#);
    let (areas, _) = imported(ellipse.as_bytes(), &SegmentOptions::default()).unwrap();
    assert!(
        (areas[0] / (72.0 * std::f64::consts::PI) - 1.0).abs() < 0.03,
        "{areas:?}"
    );
}

/// Regions of ImageJ: entries of macOS, capitals, folders, ovals by fractions of pixels, and slices.
#[test]
fn imagej_archives() {
    let large = roi(1, [5, 5, 25, 25], &[], &[], &[]);
    let small = roi(1, [10, 40, 20, 50], &[], &[], &[]);
    let entries = [
        ("set/LARGE.ROI", large.clone()),
        ("__MACOSX/set/._LARGE.ROI", b"\0\x05\x16\x07junk".to_vec()),
        ("set/._b.roi", b"junk".to_vec()),
        ("b.roi", small.clone()),
        ("notes.txt", b"hello".to_vec()),
    ];
    assert_squares(&archive(&entries), &[]);
    let point = roi(10, [0, 0, 1, 1], &[(16, 1)], &[], &[0; 4]);
    assert_squares(
        &archive(&[("a.roi", large.clone()), ("p.roi", point), ("b.roi", small.clone())]),
        &["lost-labels"],
    );
    // A circle of diameter 5 around (10.5, 10.5), given in floats.
    let [corner, side] = [8.0_f32, 5.0].map(f32::to_bits);
    let circle = roi(
        2,
        [8, 8, 13, 13],
        &[(50, 128)],
        &[(18, corner), (22, corner), (26, side), (30, side)],
        &[],
    );
    let (areas, _) = imported(
        &archive(&[("c.roi", circle)]),
        &SegmentOptions::default().with_min_area(1),
    )
    .unwrap();
    assert!((19.0..=21.0).contains(&areas[0]), "{areas:?}");
    // Positions: two of slice 2, one of slice 5; and a hyperstack's second header.
    let at = |region: &[u8], slice: u32| {
        let mut bytes = region.to_vec();
        bytes[56..60].copy_from_slice(&slice.to_be_bytes());
        bytes
    };
    let other = at(&roi(1, [30, 30, 38, 38], &[], &[], &[]), 5);
    let stack = archive(&[("a.roi", at(&large, 2)), ("b.roi", at(&small, 2)), ("c.roi", other)]);
    assert_squares(&stack, &["other-slices"]);
    assert_squares(&archive(&[("a.roi", at(&large, 9)), ("b.roi", at(&small, 9))]), &[]);
}

/// The regions of an archive are limited by their sum: small files that unpack to much are refused.
#[test]
fn archives_that_unpack_to_much() {
    let big = roi(7, [0, 0, 9, 9], &[(16, 0)], &[], &vec![0; 23 << 20]);
    let bomb = archive(&[("a.roi", big.clone()), ("b.roi", big.clone()), ("c.roi", big)]);
    assert!(bomb.len() < 200_000);
    let refused = read(&bomb).unwrap_err().to_string();
    assert!(refused.contains("64 megabytes"), "{refused}");
}

/// Holes of imported labels are filled or kept as the option says.
#[test]
fn holes_of_imported_labels() {
    let mut labels = squares();
    let hole = (8..18).flat_map(|y| (8..18).map(move |x| [y, x]));
    hole.for_each(|place| labels[place] = 0);
    let area = |holes| {
        let options = SegmentOptions::default()
            .with_holes(holes)
            .with_edge_rule(EdgeRule::All);
        let found = Segmentation::from_labels(&photo(), labels.clone(), &options).unwrap();
        (
            found.profiles[0].area,
            found.findings.iter().any(|f| f.code == "holes-filled"),
        )
    };
    assert_eq!([area(Holes::Fill), area(Holes::Keep)], [(400.0, true), (300.0, false)]);
}

/// Without a photo, sizes and places are those with a photo.
#[test]
fn labels_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("labels.png");
    write_labels(&file, squares().view()).unwrap();
    let labels = read_label_file(&file).unwrap().labels;
    let options = SegmentOptions::default();
    let alone = Segmentation::of_sizes(labels.clone(), &options).unwrap();
    let with = Segmentation::from_labels(&photo(), labels, &options).unwrap();
    for (a, b) in alone.profiles.iter().zip(&with.profiles) {
        assert_eq!((a.id, a.x, a.y, a.area, a.weight), (b.id, b.x, b.y, b.area, b.weight));
    }
    assert!(!alone.has_colours && with.has_colours);
    assert_eq!(alone.window, with.window);
}

/// Labels that a segmentation wrote come back without a finding on them, also where there are exactly 255.
#[test]
fn own_labels_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("labels.tif");
    let photo = RgbImage::from_fn(17 * 16, 15 * 16, |x, y| {
        let inside = (f64::from(x % 16) - 7.5).hypot(f64::from(y % 16) - 7.5) < 5.5;
        Rgb([if inside { 60 } else { 200 } + ((x * 7 + y * 3) % 5) as u8; 3])
    });
    let found = segment(&photo, &SegmentOptions::default(), &|_| {
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(found.profiles.len(), 255);
    write_labels(&file, found.labels.view()).unwrap();
    let read = read_labels_for(&file, found.labels.dim()).unwrap();
    let again = Segmentation::from_labels(&photo, read.labels, &SegmentOptions::default()).unwrap();
    let kinds = [
        "clipped-labels",
        "split-label",
        "small-labels",
        "mask-split",
        "holes-filled",
    ];
    assert!(read.findings.is_empty());
    assert!(
        again.findings.iter().all(|f| !kinds.contains(&f.code)),
        "{:?}",
        again.findings
    );
    assert_eq!(again.profiles.len(), 255);
}
