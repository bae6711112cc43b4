//! Packs three hundred rings, hooks and jacks, which are not convex, and certifies that their meshes do not overlap.
//!
//! ```text
//! cargo run --release -p stereology-anneal --example hollow_bodies
//! ```

#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;
use std::ops::ControlFlow;
use stereology_anneal::{ConvexParts, PackOptions, Proxy, box_for_fraction, lognormal_sizes, mix, pack, populate};
use stereology_shape::{Arrangement, Body, ClosedMesh, TriangleMesh, UnitBody};

fn main() -> Result<(), Box<dyn Error>> {
    let ring = TriangleMesh::torus(2.0, 0.7, 32, 16);
    let bodies = [ring, hook(), jack()].map(|mesh| ClosedMesh::try_from(mesh).map(Body::from_mesh));
    let bodies = bodies.into_iter().collect::<Result<Vec<_>, _>>()?;
    let bodies: Vec<UnitBody> = bodies.iter().map(UnitBody::new).collect();
    for body in &bodies {
        let parts = ConvexParts::of(body, PackOptions::default().tolerance);
        println!(
            "{} convex parts exceed the body by {:.1} % of its volume",
            parts.hulls().len(),
            100.0 * parts.excess()
        );
    }
    let grains = mix(&lognormal_sizes(300, 0.3, 0)?, &[1.0; 3], 0)?;
    let period = box_for_fraction(&bodies, &grains, 0.2)?;
    for proxy in [Proxy::Parts, Proxy::Hull] {
        let options = PackOptions::default().with_proxy(proxy);
        let start = populate(&grains, &period, 0);
        match pack(&Arrangement::new(&bodies[..], start, period)?, &options, &|_| {
            ControlFlow::Continue(())
        }) {
            Ok(packing) => println!(
                "{proxy:?}: {} particles at a volume fraction of {:.6}, none overlap; {} iterations",
                packing.particles().len(),
                packing.fraction(),
                packing.iterations()
            ),
            Err(error) => println!("{proxy:?}: {error}"),
        }
    }
    Ok(())
}

/// A square bar bent into a U.
fn hook() -> TriangleMesh {
    TriangleMesh::cubes(&[
        [0, 0, 0],
        [1, 0, 0],
        [2, 0, 0],
        [0, 1, 0],
        [2, 1, 0],
        [0, 2, 0],
        [2, 2, 0],
    ])
}

/// Three crossed bars.
fn jack() -> TriangleMesh {
    let mut arms = vec![[2, 2, 2]];
    for axis in 0..3 {
        for place in [0, 1, 3, 4] {
            let mut cell = [2; 3];
            cell[axis] = place;
            arms.push(cell);
        }
    }
    TriangleMesh::cubes(&arms)
}
