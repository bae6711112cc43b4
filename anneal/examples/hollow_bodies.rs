//! Packs three hundred rings, hooks and jacks, which are not convex, and certifies that their meshes do not overlap.
//!
//! ```text
//! cargo run --release -p stereology-anneal --example hollow_bodies
//! ```

#![expect(clippy::print_stdout, reason = "an example shows its result")]

use nalgebra::Vector3;
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
    cells(&[
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
    cells(&arms)
}

/// The surface of unit cubes that share faces.
fn cells(cubes: &[[i32; 3]]) -> TriangleMesh {
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    for cube in cubes {
        for axis in 0..3 {
            for (side, beside) in [(0, -1), (1, 1)] {
                let mut next = *cube;
                next[axis] += beside;
                if cubes.contains(&next) {
                    continue;
                }
                let first = u32::try_from(mesh.vertices.len()).unwrap_or(u32::MAX);
                for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    let mut corner = Vector3::from(cube.map(f64::from));
                    corner[axis] += f64::from(side);
                    corner[(axis + 1) % 3] += f64::from(u);
                    corner[(axis + 2) % 3] += f64::from(v);
                    mesh.vertices.push(corner.into());
                }
                mesh.triangles.extend(if side == 1 {
                    [[first, first + 1, first + 2], [first, first + 2, first + 3]]
                } else {
                    [[first, first + 2, first + 1], [first, first + 3, first + 2]]
                });
            }
        }
    }
    mesh.weld();
    mesh
}
