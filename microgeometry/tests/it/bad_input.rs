//! Invalid input is refused with advice.

use std::ops::ControlFlow;

use ndarray::Array2;
use stereology_microgeometry::{
    ContactDistribution, Design, EstimateOptions, MicrogeometryError, Offset, ReconstructOptions, contact_of_image,
    displace, reconstruct, refined, to_distribution_units,
};
use stereology_shape::{Subdivision, TriangleMesh};

fn flat() -> ContactDistribution {
    ContactDistribution::new(1.0, vec![1.0], vec![1.0]).unwrap()
}

fn try_on(mesh: &TriangleMesh) -> Result<(), MicrogeometryError> {
    reconstruct(mesh, &flat(), &ReconstructOptions::default(), &|_| {
        ControlFlow::Continue(())
    })
    .map(drop)
}

#[test]
fn histograms() {
    use MicrogeometryError::{BinWidth, EmptyDistribution, Frequency, TooManyBins};
    let new = ContactDistribution::new;
    assert!(matches!(new(1.0, vec![], vec![]), Err(EmptyDistribution)));
    assert!(matches!(new(1.0, vec![0.0], vec![0.0, 0.0]), Err(EmptyDistribution)));
    assert!(matches!(
        new(1.0, vec![1.0, -0.1], vec![]),
        Err(Frequency {
            side: "negative",
            bin: 1,
            ..
        })
    ));
    assert!(matches!(
        new(1.0, vec![], vec![f64::NAN]),
        Err(Frequency {
            side: "positive",
            bin: 0,
            ..
        })
    ));
    assert!(matches!(new(1.0, vec![f64::INFINITY], vec![]), Err(Frequency { .. })));
    assert!(matches!(new(0.0, vec![1.0], vec![]), Err(BinWidth(_))));
    assert!(matches!(new(f64::NAN, vec![1.0], vec![]), Err(BinWidth(_))));
    assert!(matches!(new(1.0, vec![1.0; 5000], vec![]), Err(TooManyBins { .. })));
    assert_eq!(new(1.0, vec![1e308; 4], vec![1e308; 4]).unwrap().positive_share(), 0.5);
    for text in [
        "",
        "{}",
        "[1, 2]",
        r#"{"bin_width": 1, "negative": ["a"], "positive": []}"#,
    ] {
        assert!(
            ContactDistribution::from_json(text)
                .unwrap_err()
                .to_string()
                .contains("contact distribution")
        );
    }
    assert!(Design::from_json("{}").unwrap_err().to_string().contains("design"));
}

#[test]
fn meshes() {
    let ball = TriangleMesh::icosphere(2.0, 1);
    let one = TriangleMesh {
        triangles: ball.triangles[..1].to_vec(),
        ..ball.clone()
    };
    assert!(matches!(
        try_on(&one),
        Err(MicrogeometryError::TooFewTriangles { triangles: 1 })
    ));
    assert!(try_on(&TriangleMesh::default()).is_err());
    let mut bad = ball.clone();
    bad.vertices[3].y = f64::NAN;
    assert!(matches!(try_on(&bad), Err(MicrogeometryError::NotFinite { vertex: 3 })));
    assert!(matches!(
        to_distribution_units(&bad, 10.0),
        Err(MicrogeometryError::NotFinite { vertex: 3 })
    ));
    let mut bad = ball.clone();
    bad.triangles[7][2] = 9999;
    assert!(matches!(
        try_on(&bad),
        Err(MicrogeometryError::Index { triangle: 7, .. })
    ));
    let point = ball.mapped(|_| nalgebra::Point3::origin());
    assert!(matches!(try_on(&point), Err(MicrogeometryError::NoArea)));
    assert!(to_distribution_units(&ball, f64::NAN).is_err() && to_distribution_units(&ball, 0.0).is_err());
    assert!(displace(&ball, &[1.0], &Offset::still(), &Offset::still()).is_err());
    assert!(
        refined(&ball, Subdivision::Midpoint, 1e-6)
            .unwrap_err()
            .to_string()
            .contains("larger length")
    );
    assert!(refined(&ball, Subdivision::Loop, -1.0).is_err());
}

/// Two triangles, triangles without area, an edge with three triangles: allowed.
#[test]
fn odd_meshes_are_handled() {
    let p = nalgebra::Point3::new;
    let fan = TriangleMesh {
        vertices: vec![
            p(0.0, 0.0, 0.0),
            p(1.0, 0.0, 0.0),
            p(0.0, 1.0, 0.0),
            p(0.0, -1.0, 0.0),
            p(0.0, 0.0, 1.0),
            p(2.0, 0.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 1, 5]],
    };
    try_on(&fan).unwrap();
    assert_eq!(stereology_microgeometry::EdgeCensus::of(&fan).crowded, 1);
    let two = TriangleMesh {
        triangles: fan.triangles[..2].to_vec(),
        ..fan
    };
    try_on(&two).unwrap();
}

#[test]
fn pictures_of_one_region() {
    let white = Array2::from_elem((5, 5), true);
    let refused = contact_of_image(white.view(), &EstimateOptions::default());
    assert!(matches!(refused, Err(MicrogeometryError::OneRegion(_))));
    let none = Array2::from_elem((0, 0), true);
    assert!(contact_of_image(none.view(), &EstimateOptions::default()).is_err());
    let half = Array2::from_shape_fn((2, 2), |(y, _)| y > 0);
    let wrong = EstimateOptions {
        pixel_size: -1.0,
        ..EstimateOptions::default()
    };
    assert!(contact_of_image(half.view(), &wrong).is_err());
    let wrong = EstimateOptions {
        bins: Some(0),
        ..EstimateOptions::default()
    };
    assert!(contact_of_image(half.view(), &wrong).is_err());
}

#[test]
fn offsets() {
    for wrong in [
        "",
        "out",
        "out,1",
        "up,0.1,x",
        "out,-1,x",
        "out,nan,x",
        "out,1,cube",
        "out,1,1=2;0=1",
        "out,1,-1=2",
    ] {
        assert!(wrong.parse::<Offset>().is_err(), "{wrong}");
    }
    let table: Offset = "-1,0.5,0=0;2=1".parse().unwrap();
    assert_eq!(table.height(1.0), -0.25);
    assert_eq!(table.to_string().parse::<Offset>().unwrap(), table);
}

#[test]
fn a_cancelled_call_says_so() {
    let ball = TriangleMesh::icosphere(2.0, 2);
    let of = ContactDistribution::new(1.0, vec![1.0; 5], vec![1.0; 5]).unwrap();
    let broken_off = reconstruct(&ball, &of, &ReconstructOptions::default(), &|_| ControlFlow::Break(()));
    assert_eq!(broken_off, Err(MicrogeometryError::Cancelled));
}
