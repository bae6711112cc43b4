//! Planes through a packing obey the stereological relations.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use stereology_anneal::{PackOptions, box_for_fraction, lognormal_sizes, mix, pack, populate};
use stereology_shape::{Arrangement, Body, UnitBody};

/// Eq. (1): N_A = D N_V, and Delesse: A_A = V_V, on planes through a packing of spheres.
///
/// Averaged over all depths of one period both hold exactly; a section at one depth varies. Profile counts of a packing
/// vary less than Poisson counts, so a Poisson bound at 10⁻⁶ (4.9 standard deviations) over twenty planes is safe.
#[test]
fn sections_obey_the_fundamental_relation() {
    let bodies = [UnitBody::new(&Body::sphere(1.0).unwrap())];
    let grains = mix(&lognormal_sizes(2000, 0.3, 11).unwrap(), &[1.0], 11).unwrap();
    let period = box_for_fraction(&bodies, &grains, 0.5).unwrap();
    let start = populate(&grains, &period, 11);
    let packing = pack(
        &Arrangement::new(&bodies[..], start, period).unwrap(),
        &PackOptions::default(),
        &|_| ControlFlow::Continue(()),
    )
    .unwrap();
    let side = packing.sides().x;
    let planes = 20;
    for axis in 0..3 {
        let (mut profiles, mut area) = (0.0, 0.0);
        for plane in 0..planes {
            let depth = side * f64::from(plane) / f64::from(planes);
            for particle in packing.particles() {
                let mut height = depth - particle.position[axis];
                height -= side * (height / side).round();
                let square = 0.25 * particle.size.powi(2) - height * height;
                if square > 0.0 {
                    profiles += 1.0;
                    area += PI * square;
                }
            }
        }
        let expected: f64 = f64::from(planes) * packing.particles().iter().map(|p| p.size).sum::<f64>() / side;
        assert!(
            (profiles - expected).abs() < 4.9 * expected.sqrt(),
            "{profiles} profiles, {expected} expected"
        );
        let fraction = area / (f64::from(planes) * side * side);
        assert!((fraction - 0.5).abs() < 0.01, "area fraction {fraction}");
    }
}
