//! What is written is read again, bit for bit.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use ndarray::Array4;
use proptest::prelude::*;
use stereology::files::{PackingFile, open_solid, save_solid};
use stereology::pipeline::ParticleTypes;
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

    #[test]
    fn a_solid_comes_back_as_it_was(particles in prop::collection::vec(particle(), 1..12), texture in prop::collection::vec(-0.2..0.2_f32, 4 * 4 * 4 * 3)) {
        let folder = tempfile::tempdir().unwrap();
        let types = ParticleTypes::parse(&["sphere", "rock:1"]).unwrap();
        let period = PeriodicBox::new(Vector3::repeat(8.0)).unwrap();
        let colours = (0..particles.len()).map(|i| [0.1 * i as f32 % 1.0, 0.3, 0.7]).collect();
        let field = Array4::from_shape_vec((4, 4, 4, 3), texture).unwrap();
        let residual = Residual { particles: -&field, binder: field, voxel: 2.0 };
        let solid = Solid::new(Arrangement::new(types.unit_bodies(), particles, period).unwrap(), colours, [0.8, 0.7, 0.6], Some(residual.clone())).unwrap();
        save_solid(folder.path(), &solid, &residual, &types).unwrap();
        let read = open_solid(folder.path()).unwrap().solid;
        for i in 0..200 {
            let p = Point3::new(0.37 * f64::from(i), 0.61 * f64::from(i), 0.17 * f64::from(i));
            prop_assert_eq!(solid.id_at(&p), read.id_at(&p));
            prop_assert_eq!(solid.colour_at(&p), read.colour_at(&p));
        }
    }
}

/// Every fault is told with the file it is in.
#[test]
fn broken_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let told = |error: stereology::files::FileError| error.to_string();
    assert!(told(open_solid(folder.path()).unwrap_err()).contains("solid.json"));
    std::fs::write(folder.path().join("solid.json"), "{").unwrap();
    assert!(told(open_solid(folder.path()).unwrap_err()).contains("solid.json"));
    std::fs::write(folder.path().join("packing.json"), r#"{"box":[1,1,1],"shapes":[],"particles":[{"shape":0,"size":1,"category":0,"position":[0,0,0],"orientation":[1,0,0,0]}]}"#).unwrap();
    assert!(told(PackingFile::read(folder.path().join("packing.json")).unwrap_err()).contains("particle 0"));
}

/// One fault in each file of a good folder: refused, and told where and what.
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
    save_solid(folder.path(), &solid, &residual, &types).unwrap();
    open_solid(folder.path()).unwrap();

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
        ("solid.json", "\"voxel\":2.0", "\"voxel\":0.0", "voxel 0"),
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
        let told = open_solid(folder.path()).unwrap_err().to_string();
        assert!(told.contains(said), "{to}: {told}");
        std::fs::write(at(file), good).unwrap();
    }
    let good = std::fs::read(at("texture.npy")).unwrap();
    let mut not_finite = good.clone();
    let end = good.len();
    not_finite[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    for (bad, said) in [
        (good[..end - 100].to_vec(), "cut off"),
        (b"no array".to_vec(), "texture.npy"),
        (not_finite, "finite"),
    ] {
        std::fs::write(at("texture.npy"), bad).unwrap();
        let told = open_solid(folder.path()).unwrap_err().to_string();
        assert!(told.contains(said), "{told}");
    }
}
