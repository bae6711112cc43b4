//! What is written is read again, bit for bit.

use image::{Rgb, RgbImage};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::{Array2, Array4};
use proptest::prelude::*;
use stereology::files::densities::DensityRows;
use stereology::files::packing::PackingFile;
use stereology::files::profiles::ProfileReading;
use stereology::files::voxel_table::{ValueRange, ValueRow};
use stereology::files::{densities, particle_table, profiles, solid as solid_files, voxel_table, vtp, xyz};
use stereology::grid::LengthUnit;
use stereology::pipeline::ParticleTypes;
use stereology::segment::{EdgeRule, SegmentOptions, Segmentation};
use stereology::shape::{Arrangement, Particle, PeriodicBox};
use stereology::volume::{Residual, Solid};

fn particle() -> impl Strategy<Value = Particle> {
    (
        0_usize..2,
        0.1..3.0_f64,
        0_u8..255,
        prop::array::uniform3(0.0..8.0_f64),
        prop::array::uniform3(-3.0..3.0_f64),
    )
        .prop_map(|(shape, size, category, position, turn)| Particle {
            shape,
            size,
            category,
            position: Point3::from(position),
            orientation: UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_packing_comes_back_as_it_was(particles in prop::collection::vec(particle(), 0..20)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("packing.json");
        let period = PeriodicBox::new(Vector3::new(8.0, 9.0, 10.0)).unwrap();
        let file = PackingFile::new(vec!["sphere".into(), "rock:1".into()], &particles, &period);
        file.write(&path).unwrap();
        let (read, sides) = PackingFile::read(&path).unwrap().unpack().unwrap();
        prop_assert_eq!(read, particles);
        prop_assert_eq!(sides, period);
    }

    /// The formats for other programs keep every bit of the particles too.
    #[test]
    fn particles_come_back_as_they_were(particles in prop::collection::vec(particle(), 0..20)) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let bodies = ParticleTypes::parse(&["ellipsoid:1,1,0.5", "rock:1"]).unwrap().unit_bodies();
        let period = PeriodicBox::new(Vector3::new(8.0, 9.0, 10.0)).unwrap();
        let arrangement = Arrangement::new(bodies, particles.clone(), period).unwrap();
        particle_table::write(at("p.csv"), &particles, Some(LengthUnit::Micrometre)).unwrap();
        prop_assert_eq!(&particle_table::read(at("p.csv")).unwrap().rows, &particles);
        vtp::write(at("p.vtp"), &particles).unwrap();
        prop_assert_eq!(&vtp::read(at("p.vtp")).unwrap(), &particles);
        xyz::write(at("p.xyz"), &arrangement).unwrap();
        prop_assert_eq!(xyz::read(at("p.xyz")).unwrap(), (particles, period));
    }

    /// Densities of every type and category come back; the sum over all, which is in the table too, is not read beside
    /// its parts.
    #[test]
    fn densities_come_back_as_they_were(density in prop::collection::vec(prop::option::of(1e-9..1.0_f64), 8), width in 0.01..5.0_f64) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("densities.csv");
        let edges: Vec<f64> = (0..5).map(|k| width * f64::from(k)).collect();
        let mut rows = DensityRows::new(Some(LengthUnit::Millimetre));
        rows.bins(&edges, &[Some(1.0); 4], None, None, None);
        for (category, part) in (0_u8..).zip(density.chunks(4)) {
            rows.bins(&edges, part, None, Some(0), Some(category));
        }
        rows.write(&path).unwrap();
        match densities::read(&path) {
            Ok(table) => {
                let found = table.rows;
                prop_assert_eq!((found.len(), table.head.unit.unit()), (2, Some(LengthUnit::Millimetre)));
                for (category, (found, part)) in found.iter().zip(density.chunks(4)).enumerate() {
                    prop_assert_eq!((found.shape, usize::from(found.category)), (Some(0), category));
                    prop_assert_eq!(&found.edges, &edges);
                    prop_assert_eq!(&found.number_density, &part.iter().map(|n| n.unwrap_or(0.0)).collect::<Vec<_>>());
                }
            }
            Err(error) => prop_assert!(density.iter().all(Option::is_none), "{error}"),
        }
    }

    /// Values of any channels, at points or voxels.
    #[test]
    fn voxel_values_come_back_as_they_were(places in prop::collection::vec(prop::array::uniform3(-50.0..50.0_f64), 1..20), channels in 1_usize..5, whole in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("values.csv");
        let row = |(k, place): (usize, &[f64; 3])| ValueRow {
            line: k as u64 + 2,
            place: if whole { place.map(|x| x.abs().floor()) } else { *place },
            values: (0..channels).map(|c| if whole { (7 * k + c) as f32 } else { 0.1 * (k + c) as f32 }).collect(),
        };
        let rows: Vec<ValueRow> = places.iter().enumerate().map(row).collect();
        voxel_table::write(&path, &rows).unwrap();
        let range = if whole { ValueRange::Bytes } else { ValueRange::Any };
        prop_assert_eq!(&voxel_table::read(&path, channels, range).unwrap().rows, &rows);
        if whole {
            let [x, y, z] = rows[0].place.map(|x| x as usize);
            prop_assert_eq!(rows[0].voxel([50; 3]), Some([z, y, x]));
            prop_assert_eq!(rows[0].voxel([z, 50, 50]), None);
        }
    }

    /// Sizes, categories, weights and edges of a segmentation's profiles.
    #[test]
    fn profiles_come_back_as_they_were(discs in prop::collection::vec((5_usize..75, 5_usize..55, 2_usize..12), 1..8), scale in 0.01..10.0_f64) {
        let mut labels = Array2::<u32>::zeros((60, 80));
        for (id, (x, y, r)) in (1..).zip(&discs) {
            for ((v, u), label) in labels.indexed_iter_mut() {
                if v.abs_diff(*y).pow(2) + u.abs_diff(*x).pow(2) < r * r {
                    *label = id;
                }
            }
        }
        let photo = RgbImage::from_fn(80, 60, |x, y| Rgb([200 - (labels[[y as usize, x as usize]] * 9) as u8, (x % 7) as u8, 90]));
        let Ok(found) = Segmentation::from_labels(&photo, labels, &SegmentOptions::default()) else { return Ok(()) };
        prop_assume!(!found.profiles.is_empty());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("profiles.csv");
        let head = profiles::head(&found, scale, Some(LengthUnit::Inch), EdgeRule::All);
        profiles::write(&path, &found, scale, &head).unwrap();
        let table = profiles::read(&path, &ProfileReading::default()).unwrap();
        prop_assert_eq!(&table.findings, &[]);
        prop_assert_eq!(&table.head, &head);
        let read = table.rows;
        prop_assert_eq!(read.len(), found.profiles.len());
        for (row, profile) in read.iter().zip(&found.profiles) {
            prop_assert_eq!((row.size, row.weight), (profile.size * scale, profile.weight));
            prop_assert_eq!((row.category, row.touches_edge), (Some(profile.category), Some(profile.touches_edge)));
            let sides = row.bounding_box.map(|b| [b.left, b.top, b.right, b.bottom]);
            prop_assert_eq!(sides, Some(profile.bounding_box.map(|side| side as f64 * scale)));
        }
    }

    #[test]
    fn a_solid_comes_back_as_it_was(particles in prop::collection::vec(particle(), 1..12), texture in prop::collection::vec(-0.2..0.2_f32, 4 * 4 * 4 * 3)) {
        let folder = tempfile::tempdir().unwrap();
        let types = ParticleTypes::parse(&["sphere", "rock:1"]).unwrap();
        let period = PeriodicBox::new(Vector3::repeat(8.0)).unwrap();
        let colours = (0..particles.len()).map(|i| [0.1 * i as f32 % 1.0, 0.3, 0.7]).collect();
        let field = Array4::from_shape_vec((4, 4, 4, 3), texture).unwrap();
        let residual = Residual { particles: -&field, binder: field, voxel: 2.0 };
        let solid = Solid::new(Arrangement::new(types.unit_bodies(), particles, period).unwrap(), colours, [0.8, 0.7, 0.6], Some(residual.clone())).unwrap();
        solid_files::write(folder.path(), &solid, Some(&residual), &types, Some(LengthUnit::Nanometre)).unwrap();
        let read = solid_files::read(folder.path()).unwrap().solid;
        for i in 0..200 {
            let p = Point3::new(0.37 * f64::from(i), 0.61 * f64::from(i), 0.17 * f64::from(i));
            prop_assert_eq!(solid.id_at(&p), read.id_at(&p));
            prop_assert_eq!(solid.colour_at(&p), read.colour_at(&p));
        }
    }
}

/// Every error names its file.
#[test]
fn broken_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let message = |error: stereology::files::FileError| error.to_string();
    assert!(message(solid_files::read(folder.path()).unwrap_err()).contains("solid.json"));
    std::fs::write(folder.path().join("solid.json"), "{").unwrap();
    assert!(message(solid_files::read(folder.path()).unwrap_err()).contains("solid.json"));
    std::fs::write(folder.path().join("packing.json"), r#"{"box":[1,1,1],"shapes":[],"particles":[{"shape":0,"size":1,"category":0,"position":[0,0,0],"orientation":[1,0,0,0]}]}"#).unwrap();
    assert!(message(PackingFile::read(folder.path().join("packing.json")).unwrap_err()).contains("particle 0"));
}

/// One fault in each file of a good folder: refused, with an error that says where and what.
#[test]
fn damaged_solids_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let types = ParticleTypes::parse(&["sphere"]).unwrap();
    let particle = Particle {
        shape: 0,
        size: 4.0,
        category: 0,
        position: Point3::new(4.0, 4.0, 4.0),
        orientation: UnitQuaternion::identity(),
    };
    let period = PeriodicBox::new(Vector3::repeat(8.0)).unwrap();
    let field = Array4::zeros((4, 4, 4, 3));
    let residual = Residual {
        particles: field.clone(),
        binder: field,
        voxel: 2.0,
    };
    let solid = Solid::new(
        Arrangement::new(types.unit_bodies(), vec![particle], period).unwrap(),
        vec![[0.5; 3]],
        [0.8; 3],
        Some(residual.clone()),
    )
    .unwrap();
    solid_files::write(
        folder.path(),
        &solid,
        Some(&residual),
        &types,
        Some(LengthUnit::Nanometre),
    )
    .unwrap();
    solid_files::read(folder.path()).unwrap();

    let edits: [(&str, &str, &str, &str); 9] = [
        (
            "solid.json",
            "stereology.solid/1",
            "stereology.solid/2",
            "stereology.solid/2",
        ),
        (
            "solid.json",
            "stereology.solid/1\"",
            "stereology.solid/7\",\"new\":1,\"binder_of_7\":0",
            "stereology.solid/7",
        ),
        ("solid.json", "\"voxel\":2.0", "\"voxel\":0.0", "edge 0"),
        (
            "solid.json",
            "\"colours\":[[",
            "\"colours\":[[0,0,0],[",
            "2 colours for 1 particles",
        ),
        ("packing.json", "\"size\":4.0", "\"size\":-4.0", "size"),
        ("packing.json", "\"shape\":0", "\"shape\":3", "shape 3"),
        ("packing.json", "\"box\":[8.0", "\"box\":[0.0", "0 × 8 × 8"),
        ("packing.json", "\"sphere\"", "\"gone.obj\"", "gone.obj"),
        ("packing.json", "}]", "", "packing.json"),
    ];
    for (file, from, to, said) in edits {
        let good = std::fs::read_to_string(at(file)).unwrap();
        let bad = good.replacen(from, to, 1);
        assert_ne!(good, bad, "{from}");
        std::fs::write(at(file), bad).unwrap();
        let message = solid_files::read(folder.path()).unwrap_err().to_string();
        assert!(message.contains(said), "{to}: {message}");
        std::fs::write(at(file), good).unwrap();
    }
    let good = std::fs::read(at("texture.npy")).unwrap();
    let mut not_finite = good.clone();
    let end = good.len();
    not_finite[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    for (bad, said) in [
        (good[..end - 100].to_vec(), "truncated"),
        (b"no array".to_vec(), "texture.npy"),
        (not_finite, "finite"),
    ] {
        std::fs::write(at("texture.npy"), bad).unwrap();
        let message = solid_files::read(folder.path()).unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
}
